"""Loads that drive a body beyond a tilt: the worst ones of the linear system, on the body itself.

Near rest the rotation vector is r(T) = ∫ h(T - t)w(t)dt, with the impulse response h. For the
direction n the worst loads are w_i(t) = w̄_i h_i'n/|h_i'n|. They are then applied to the equations
of the body, times factors. This is computed, and proves nothing.
"""

from collections.abc import Callable, Sequence

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

DIRECTIONS = 100
"""Random n."""

FACTORS = np.linspace(0.75, 4.0, 24)
"""On the loads of the linear system, tried at once; then as many between two of them."""

MOST = 1e6
"""No factor above it is tried."""

SETTLED = 4.0
"""The loads act for so many time constants of the slowest mode."""

STEP = 0.3
"""The length of a step of Runge and Kutta, in time constants of the fastest mode."""

MOST_STEPS = 6000


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
    slowest = -values.real.max()
    if not slowest * h * MOST_STEPS > SETTLED:
        return None
    steps = int(SETTLED / slowest / h)
    directions = np.random.default_rng(0).normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    along = (directions @ _impulses(A, B, h, steps)).reshape(steps, DIRECTIONS, -1, 3)
    lengths = np.linalg.norm(along, axis=3, keepdims=True)
    worst = along / np.where(lengths > 0, lengths, 1.0) * np.array(sizes)[:, None]
    gains = h * (along * worst).sum(axis=(0, 2, 3))
    if gains.max() * MOST < tilt:  # nothing but round-off
        return None
    inputs = worst[::-1].reshape(steps, DIRECTIONS, count)
    evaluate, factors, least = rates_of_many(rates, n + count), FACTORS * (tilt / gains.max()), None
    for _ in range(2):
        broke = _largest_tilts(evaluate, rest, inputs, factors, h) > tilt
        if broke.any():
            k = int(broke.argmax())
            least = float(factors[k])
            factors = np.linspace(factors[max(k - 1, 0)], least, len(FACTORS))
    return least


def _impulses(A: Array, B: Array, h: float, steps: int) -> Array:
    """Return Θ after an impulse of each load, at the middles of steps, shape (steps, 3, inputs)."""
    # Imported late: it takes a while.
    from scipy.linalg import expm

    forward, X = expm(A * h), expm(A * (0.5 * h)) @ B
    responses = []
    for _ in range(steps):
        responses.append(X[THETA])
        X = forward @ X
    return np.array(responses)


def rates_of_many(rates: Callable[[Array], Array], size: int) -> Callable[[Array], Array]:
    """Return the rates as a function of many states, shape (size, members)."""
    trace = Trace()
    x = np.array([trace.input(varies=True) for _ in range(size)], dtype=object)
    results = [trace.index_of(entry) for entry in rates(x).tolist()]
    evaluate = compiled(trace, results)([], numbers)
    return lambda y: np.array([np.broadcast_to(f, y.shape[1:]) for f in evaluate(list(y))])


@np.errstate(all="ignore")  # a member may leave the range of the angles
def _largest_tilts(
    rates: Callable[[Array], Array], rest: Array, inputs: Array, factors: Array, h: float
) -> Array:
    """Return the largest tilt from rest for each factor on inputs (steps, inputs, entries)."""
    y = np.repeat(rest[:, None], inputs.shape[1] * len(factors), axis=1)
    largest = np.zeros(y.shape[1])
    for w in inputs:
        u = np.einsum("mi,f->imf", w, factors).reshape(w.shape[1], -1)
        k1 = rates(np.concatenate([y, u]))
        k2 = rates(np.concatenate([y + 0.5 * h * k1, u]))
        k3 = rates(np.concatenate([y + 0.5 * h * k2, u]))
        k4 = rates(np.concatenate([y + h * k3, u]))
        y = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        largest = np.fmax(largest, tilt_of(y[THETA].T, np.zeros(3)))
    return np.asarray(largest.reshape(-1, len(factors)).max(axis=0))
