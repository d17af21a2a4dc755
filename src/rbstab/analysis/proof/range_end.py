"""The part of a range of Θ in which a rest state is possible: up to a stop, and to a barrier."""

import numpy as np

from rbstab.analysis.proof.boxes import ROUNDING_FACTOR
from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH

NO_SLOPES = np.zeros(3)
"""J/rad: what is added to U has no slope."""


def within_stops(form: TrigonometricForm, end: Array) -> Array:
    """Return the largest |Θ| in a range that a motion can reach with stops, shape (3,), rad."""
    if form.guard is None:
        return end
    return np.array([end[0], min(end[1], form.guard.end), end[2]])


def end_of_rest_states(
    form: TrigonometricForm, end: Array, slopes: Array = NO_SLOPES, times: float = 1.0
) -> Array:
    """Return the largest |Θ| in a range at which a rest state is possible, shape (3,), rad.

    It is that of a stop. And from some angle on, the slope of a barrier is larger than any slope of
    the rest of U, so that U rises with this angle up to the end: soft guards rise too.

    Args:
        form: U.
        end: The largest |Θ| in the range, shape (3,), rad.
        slopes: Bounds on the slopes of what is added to U, shape (3,), J/rad.
        times: The slope of the barrier is so many times that of the rest: a farther end.

    Raises:
        NoReducedEnergy: The barrier is too weak for double precision, or no bound is found on the
            slopes of the rest.
    """
    wide, end = end, within_stops(form, end).copy()
    guard = form.guard
    if guard is None:
        return end
    for axis, barrier in ((PITCH, guard.barrier), (0, guard.outer), (2, guard.outer)):
        if barrier is not None:
            steepest = np.abs(form.quadratic[axis]) @ wide + abs(form.linear[axis])
            steepest += form.steepest[axis] + slopes[axis]
            if not np.isfinite(steepest):
                raise NoReducedEnergy(NoEnergyReason.NO_SLOPES)
            angle = barrier.end_beyond(times * float(steepest) * ROUNDING_FACTOR)
            if angle is None:
                raise NoReducedEnergy(NoEnergyReason.WEAK_BARRIER)
            end[axis] = min(end[axis], angle)
    return end
