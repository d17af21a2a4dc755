"""Energies as landscapes, without any bounds: floods on a grid, and the flow along -∇U."""

import heapq

import numpy as np
from scipy.integrate import solve_ivp

from rbstab.proof.model import RANGE_END

FINE = np.array([-0.05, -0.035, -0.02, -0.01, 0.0, 0.01, 0.02, 0.035, 0.05])
"""rad: the further lines of a grid, about a state."""


def flooded(energies, rest, state, shape=(63, 33, 63)):
    """Return the least energy at which paths on a grid lead from a state to others or the border.

    Every path on the grid is a path, so no proved level can be higher. The state is on the grid,
    with finer lines about it: else the nearest point of a state beside the border may be on the
    border. energies returns U at points of shape (m, 3).
    """
    axes = [
        _line(end, n, x)
        for end, n, x in zip(RANGE_END, shape, rest.states[state].Theta, strict=True)
    ]
    shape = tuple(len(axis) for axis in axes)
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    parts = np.array_split(nodes, 20)
    U = np.concatenate([energies(part) for part in parts]).reshape(shape)
    node_of = [
        tuple(int(np.abs(axis - x).argmin()) for axis, x in zip(axes, point.Theta, strict=True))
        for point in rest.states
    ]
    minima = {node_of[k] for k, point in enumerate(rest.states) if point.stable} - {node_of[state]}
    level, seen, queue = -np.inf, {node_of[state]}, [(U[node_of[state]], node_of[state])]
    while queue:
        energy, node = heapq.heappop(queue)
        level = max(level, energy)
        at_border = any(k in {0, n - 1} for k, n in zip(node, shape, strict=True))
        if at_border or node in minima:
            return level
        for axis in range(3):
            for step in (-1, 1):
                other = tuple(k + step * (axis == j) for j, k in enumerate(node))
                if other not in seen:
                    seen.add(other)
                    heapq.heappush(queue, (U[other], other))
    raise AssertionError("the border is always reached")


def _line(end, count, x):
    """Return places from -end to end, with some about x."""
    near = x + FINE
    even = np.linspace(-end, end, count)
    return np.unique(np.concatenate([even, near[np.abs(near) < end]]))


def end_of_flow(slopes, start):
    """Return the end of the flow along -∇U; slopes returns ∇U at a point."""
    flow = solve_ivp(lambda _, x: -slopes(x), (0, 200), start, method="LSODA", rtol=1e-9, atol=1e-9)
    return flow.y[:, -1]
