"""When a motion has settled: it is at its rest state, and stays there."""

from collections.abc import Callable

import numpy as np

from rbstab.analysis.extrema import Crossings, Steps, last_above
from rbstab.mechanics.numbers import Array

SETTLED_FRACTION = 1e-3
"""A motion has settled when v stays below this fraction of v(0)."""

SETTLED_ANGLE = 0.1
"""rad: at the end, the angles of a motion that has settled are this close to those at rest."""

LAST_PART = 0.1
"""The last part of a run, in which v of a motion that comes to rest still falls."""

LEAST_FALL = 1e-3
"""The fraction of v by which it falls there, at least: else it would last a hundred such runs until
v has fallen to a third."""

MOVING = 0.01
"""The kinetic energy of a body that moves, relative to v, at least. In an oscillation the largest
is v itself; in a rotation at a constant rate v is kinetic energy alone."""

ROUND_OFF = 1e-9
"""v may be this far below zero, relative to the largest |v|: it is a sum of larger energies, and so
it has round-off."""

DIGITS_LOST = 2 * float(np.finfo(float).eps)
"""The round-off of v, relative to the energies and to the forces that it is made of."""

SHIFTS = 1e-12 * np.arange(8)
"""Changes of a state, in SI units, that show the slopes of energies and their scatter."""


def value_round_off(energies: Callable[[Array], Array], start: Array) -> Array:
    """Return the energy below which v is round-off, shape () or (m,), J; it is never zero.

    It is the round-off of the energies at the start, the work of each force along the round-off of
    1 m or 1 rad, and the scatter of energies that are differences of larger numbers.

    Args:
        energies: Returns the energy of each part at a state, shape (parts,) or (parts, m), J.
        start: The state at the start, shape (states,) or (states, m).
    """
    # Uneven changes, because an even one may be at right angles to the weight.
    direction = np.linspace(1.0, 2.0, len(start))
    with np.errstate(all="ignore"):
        values = np.array([energies((start.T + shift * direction).T) for shift in SHIFTS])
        slopes = (values[-1] - values[0]) / SHIFTS[-1]
        # Part by part: numpy sums those of a single member in another order.
        scatter = sum(np.abs(np.diff(values, 2, axis=0)).max(axis=0))
        size = sum(np.abs(values[0])) + sum(np.abs(slopes))
        noise = DIGITS_LOST * size + 2.0 * scatter
    return np.maximum(np.where(np.isfinite(noise), noise, 0.0), np.finfo(float).tiny)


def settling_level(largest: Array | float, round_off: Array | float) -> Array:
    """Return the value of v below which a motion has settled, J; it is never zero."""
    return np.maximum(SETTLED_FRACTION * np.asarray(largest), round_off)


def settling_times(  # noqa: PLR0913, PLR0917 (a motion, its rest state and its round-off)
    steps: Steps,
    row: int,
    largest: Array,
    from_rest: Array,
    round_off: Array,
    supplied: bool,
) -> Crossings:
    """Return the times after which v stays below `SETTLED_FRACTION` v(0).

    A motion has also settled where v is round-off: one that starts at rest, from t = 0. Where
    elements supply power, a motion may start at rest, and v may rise. Then the largest v of the
    motion takes the place of v(0): without inputs, v(0) is the largest.

    A time is NaN if the member is not at rest at the end: v is not below this bound, or is
    negative, or an angle is farther than `SETTLED_ANGLE` from that of the rest state. It is also
    NaN if v is not finite at the end of a step.

    Args:
        steps: The steps of m members.
        row: The number of v among their quantities, J.
        largest: The v of each member farthest from zero, shape (m,), J.
        from_rest: Θ at the end minus Θ of the rest state, shape (m, 3), rad.
        round_off: `value_round_off`, shape (m,), J.
        supplied: Whether elements supply power.
    """
    last = np.append(steps.first[1:], len(steps.begin)) - 1
    begin, end = steps.values[0][row, steps.first], steps.values[1][row, last]
    crossings = last_above(steps, row, settling_level(largest if supplied else begin, round_off))
    at_rest = ends_near_rest(end, np.abs(largest), from_rest, round_off)
    at_rest &= np.isfinite(np.add.reduceat(steps.values[1][row], steps.first))
    return Crossings(*(np.where(at_rest, part, np.nan) for part in crossings))


def moves_on(times: Array, value: Array, kinetic: Array, round_off: float) -> bool:
    """Return whether the body moves on without damping: v stays, and is not that of a body at rest.

    A body may move in a direction that nothing damps, with a v that is small but does not fall. One
    that is held away from the rest state, such as by a sliding connector, has a v that does not
    fall either, but no kinetic energy.

    Args:
        times: Shape (n,), s.
        value: v, shape (n,), J.
        kinetic: The kinetic energy, shape (n,), J.
        round_off: `value_round_off`, J.
    """
    begin = times[-1] - LAST_PART * (times[-1] - times[0])
    before, end = float(np.interp(begin, times, value)), float(value[-1])
    if not end > max(ROUND_OFF * float(np.abs(value).max()), round_off):
        return False
    is_moving = float(kinetic[times >= begin].max()) >= MOVING * before
    return is_moving and before - end < LEAST_FALL * before


def ends_near_rest(end: Array, largest: Array, from_rest: Array, round_off: Array) -> Array:
    """Return whether motions end near their rest states, shape (m,): v not negative, angles close.

    The caller checks that v is small.

    Args:
        end: v at the end, shape (m,), J.
        largest: The largest |v|, shape (m,), J.
        from_rest: Θ at the end minus Θ of the rest state, shape (m, 3), rad.
        round_off: `value_round_off`, shape (m,), J.
    """
    near: Array = np.abs(from_rest).max(axis=1) <= SETTLED_ANGLE
    return near & (end >= -np.maximum(ROUND_OFF * largest, round_off))
