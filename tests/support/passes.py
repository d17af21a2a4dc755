"""Energies with ridges in a range that is thin along θ3, and ways out of a place on a grid."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

from support.kinks import plane, sphere

Array = np.ndarray[Any, Any]

ENDS = np.array([1.0, 1.0, 0.02])
"""The range, rad: thin along θ3, so that it takes few boxes."""

NODES = 81
"""The nodes of the grid along θ1 and θ2."""

PARTS = 16
"""The parts of an edge of the grid at whose ends the energy is computed."""


class RidgedEnergy(NamedTuple):
    """A quadratic with valleys and ridges at planes and spheres.

    data is `reduced_energy` of a proof; value takes points of shape (..., 3).
    """

    data: dict[str, Any]
    value: Callable[[Array], Array]


def random_surface(rng: np.random.Generator) -> tuple[dict[str, Any], Callable[[Array], Array]]:
    """Return a formula h as data of a proof, and as a function."""
    couple = 10.0 ** rng.uniform(-0.7, 0.8) * float(rng.choice([-1.0, 1.0]))
    if rng.uniform() < 0.4:
        radius = rng.uniform(0.2, 0.9)
        operations = sphere(radius, couple)
        return {
            "name": "h",
            "operations": operations,
        }, lambda x: couple * ((x * x).sum(axis=-1) - radius * radius)
    normal, offset = rng.normal(size=3) * [1, 1, 0.2], rng.uniform(-0.7, 0.7)
    operations = plane(normal, offset, couple)
    return {"name": "h", "operations": operations}, lambda x: couple * (x @ normal - offset)


def random_energy(rng: np.random.Generator) -> RidgedEnergy:
    """Return an energy with at most one valley and one to three ridges."""
    bent = rng.normal(size=(3, 3))
    Q = 0.5 * bent @ bent.T + np.diag([0.3, 0.3, 1.0])
    if rng.uniform() < 0.4:
        Q = np.diag(rng.uniform(-1.0, 1.5, 3))
    q = 0.4 * rng.normal(size=3)
    valleys = [random_surface(rng) for _ in range(rng.integers(0, 2))]
    ridges = [random_surface(rng) for _ in range(rng.integers(1, 4))]

    def value(x: Array) -> Array:
        found: Array = 0.5 * np.einsum("...i,ij,...j->...", x, Q, x) + x @ q
        found = found + sum(np.maximum(h(x), 0) for _, h in valleys)
        return found + sum(np.minimum(h(x), 0) for _, h in ridges)

    data = {"quadratic": Q.tolist(), "linear": q.tolist(), "coefficients": [[[0.0]]]}
    data |= {"kinks": [one for one, _ in valleys], "ridges": [one for one, _ in ridges]}
    return RidgedEnergy(data, value)


def way_out(energy: RidgedEnergy, rng: np.random.Generator) -> tuple[Array, float]:
    """Return a start, and an upper bound of the energy on a way from it to the border of the range.

    The start is the lowest node of a random part of a grid. Of all ways along edges of the grid,
    this one has the lowest bound. Between two points of an edge at which the energy is computed, it
    may exceed both by half the largest change from one to the next: 0.6 of that is added.
    """
    axis = np.linspace(-1.0, 1.0, NODES)
    nodes = np.stack(np.meshgrid(axis, axis, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    numbers = np.arange(len(nodes)).reshape(NODES, NODES)
    pairs = np.concatenate(
        [
            np.stack([numbers[:-1].ravel(), numbers[1:].ravel()], axis=1),
            np.stack([numbers[:, :-1].ravel(), numbers[:, 1:].ravel()], axis=1),
        ]
    )
    shares = np.linspace(0.0, 1.0, PARTS + 1)[:, np.newaxis, np.newaxis]
    begin, end = nodes[pairs[:, 0]], nodes[pairs[:, 1]]
    along = energy.value(begin + shares * (end - begin))
    heights = along.max(axis=0) + 0.6 * np.abs(np.diff(along, axis=0)).max(axis=0)

    values = energy.value(nodes)
    centre = rng.uniform(-0.5, 0.5, 2)
    near = np.flatnonzero(np.abs(nodes[:, :2] - centre).max(axis=1) < 0.25)
    start = int(near[values[near].argmin()])

    outside = len(nodes)
    border = np.flatnonzero(np.abs(nodes[:, :2]).max(axis=1) == 1.0)
    rows = np.concatenate([pairs[:, 0], border])
    columns = np.concatenate([pairs[:, 1], np.full(len(border), outside)])
    weights = np.concatenate([heights, values[border]])
    # In a spanning tree of least weight, the way between two nodes has the least highest edge. An
    # edge of weight zero would be none.
    lift = 1.0 - weights.min()
    graph = coo_array((weights + lift, (rows, columns)), shape=(outside + 1, outside + 1))
    tree = minimum_spanning_tree(graph.tocsr())
    tree = (tree + tree.T).tocsr()
    _, before = breadth_first_order(tree, start, directed=False)
    highest, node = -np.inf, outside
    while node != start:
        highest = max(highest, tree[node, before[node]] - lift)
        node = int(before[node])
    return nodes[start], float(highest)
