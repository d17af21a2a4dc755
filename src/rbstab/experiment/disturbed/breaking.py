"""Loads that drive a body beyond a tilt: the worst ones of the linear system, on the body itself.

Near rest the rotation vector is r(T) = ∫ h(T - t)w(t)dt, with the impulse response h. For the
direction n the worst loads are w_i(t) = w̄_i h_i'n/|h_i'n|. They are then applied to the equations
of the body, times factors. This is computed, and proves nothing.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.integrate.straight_line.code import compiled
from rbstab.integrate.straight_line.number import Trace
from rbstab.mechanics import numbers
from rbstab.mechanics.attitude import tilt as tilt_of
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA
from rbstab.proof.disturbed.forms import Load, driven
from rbstab.systems.system import System

DIRECTIONS = 64
"""n that are tried, evenly spread."""

FACTORS = 12
"""On the loads, tried at once."""

ROUNDS = 3
"""In each, the next factors lie between the last that broke and the one before."""

SETTLED = 4.0
"""The loads act for so many time constants of the slowest mode."""

STEP = 0.3
"""The length of a step of Runge and Kutta, in time constants of the fastest mode."""

MOST_STEPS = 6000

MOST = 1e6
"""No factor above it is tried."""

LARGEST = 4.0
"""The largest factor that is tried, on that of the linear system."""


def smallest_breaking(
    system: System, rest: Array, loads: Sequence[Load], sizes: Sequence[float], tilt: float
) -> float | None:
    """Return the smallest factor on loads that was found to drive the body beyond a tilt.

    Args:
        system: The system.
        rest: Its state at rest, with Θ = 0, in the coordinates of `configurations`.
        loads: The loads.
        sizes: w̄ of each.
        tilt: rad.

    Returns:
        The factor; None if none was found.
    """
    system = configurations(system).system
    n, count = system.size, 3 * len(loads)

    def rates(y: Array) -> Array:
        return driven(system, loads, y[n:]).rates(y[:n])

    matrix = jacobian(rates, np.append(rest, np.zeros(count)))
    A, B = matrix[:, :n], matrix[:, n:]
    values = np.linalg.eigvals(A)
    h = STEP / np.abs(values).max()
    steps = int(np.ceil(SETTLED / -values.real.max() / h)) if values.real.max() < 0 else MOST_STEPS
    if steps >= MOST_STEPS:
        return None
    response = _impulses(A, B, h, steps)
    along = np.einsum("di,tij->tdj", _directions(), response).reshape(steps, DIRECTIONS, -1, 3)
    lengths = np.linalg.norm(along, axis=3, keepdims=True)
    worst = along / np.where(lengths > 0, lengths, 1.0) * np.array(sizes)[:, None]
    gains = h * np.einsum("tdki,tdki->d", along, worst)
    inputs = worst[::-1].reshape(steps, DIRECTIONS, count)
    if gains.max() * MOST < tilt:  # nothing but round-off
        return None
    first = tilt / gains.max()
    runs = _Runs(_of_many(rates, n + count), rest, h, tilt)
    factors = first * np.linspace(0.75, LARGEST, 4 * FACTORS)
    chosen, found = np.argsort(-gains)[: DIRECTIONS // 2], None
    for _ in range(ROUNDS):
        broke = runs.break_at(inputs[:, chosen], factors)
        if not broke.any():
            break
        k = int(broke.any(axis=0).argmax())
        found, low = float(factors[k]), float(factors[max(k - 1, 0)])
        chosen = chosen[broke[:, k]]
        factors = np.linspace(low, found, FACTORS + 1)[1:]
    return found


def _directions() -> Array:
    """Return unit vectors on half of a sphere, by the golden angle, shape (directions, 3)."""
    k = np.arange(DIRECTIONS)
    z, turn = (k + 0.5) / DIRECTIONS, k * np.pi * (3.0 - np.sqrt(5.0))
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def _impulses(A: Array, B: Array, h: float, steps: int) -> Array:
    """Return Θ after an impulse of each load, at the middles of steps, shape (steps, 3, inputs)."""
    # Imported late: it takes a while.
    from scipy.linalg import expm

    forward, X = expm(A * h), expm(A * (0.5 * h)) @ B
    found = []
    for _ in range(steps):
        found.append(X[THETA])
        X = forward @ X
    return np.array(found)


def _of_many(rates: Callable[[Array], Array], size: int) -> Callable[[Array], Array]:
    """Return the rates as a function of many states, shape (size, members)."""
    trace = Trace()
    x = np.array([trace.input(varies=True) for _ in range(size)], dtype=object)
    results = [trace.index_of(entry) for entry in rates(x).tolist()]
    evaluate = compiled(trace, results)([], numbers)
    return lambda y: np.array([np.broadcast_to(f, y.shape[1:]) for f in evaluate(list(y))])


class _Runs(NamedTuple):
    """Motions from rest, of many members at once.

    Attributes:
        rates: Of states and loads, shape (states and loads, members).
        rest: The state at rest.
        h: The length of a step, s.
        tilt: rad.
    """

    rates: Callable[[Array], Array]
    rest: Array
    h: float
    tilt: float

    @np.errstate(all="ignore")  # a member may leave the range of the angles
    def break_at(self, inputs: Array, factors: Array) -> Array:
        """Return whether loads (steps, inputs, entries) times factors lead beyond the tilt.

        Returns:
            Shape (inputs, factors).
        """
        h, count = self.h, inputs.shape[1] * len(factors)
        y, beyond = np.repeat(self.rest[:, None], count, axis=1), np.zeros(count, dtype=bool)
        for w in inputs:
            u = np.einsum("mi,f->imf", w, factors).reshape(-1, count)
            k1 = self._at(y, u)
            k2 = self._at(y + 0.5 * h * k1, u)
            k3 = self._at(y + 0.5 * h * k2, u)
            y = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + self._at(y + h * k3, u))
            beyond |= tilt_of(y[THETA].T, np.zeros(3)) > self.tilt
        return beyond.reshape(-1, len(factors))

    def _at(self, y: Array, u: Array) -> Array:
        return self.rates(np.concatenate([y, u]))
