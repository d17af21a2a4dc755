"""Find where a step leaves the range of eq. 5, also if the motion returns within the step."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from rbstab.integrate.event_time import OF_RANGE, event_time, zero_between
from rbstab.mechanics.attitude import rate_matrix, regularity
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, PITCH, THETA

TESTS_PER_STEP = 16
"""Each step is divided into this many intervals, which are tested one by one."""

Path = Callable[[float], Array]
"""The state as a function of time, within a step."""


def may_leave(before: Array, after: Array, length: float, range_bound: float) -> bool:
    """Whether cos θ2 may have fallen to its bound in a step; the test is cheap and cautious.

    |θ̇2| <= |Ω|, because the second row of B has unit length. So a step with both ends far enough
    inside the range cannot have reached the bound.

    Args:
        before: The state at the start of the step.
        after: The state at its end.
        length: Its length, s.
        range_bound: The bound of cos θ2.
    """
    largest_end_angle = max(abs(before[PITCH]), abs(after[PITCH]))
    speed = max(np.linalg.norm(before[OMEGA]), np.linalg.norm(after[OMEGA]))
    return not largest_end_angle + speed * length < np.arccos(range_bound)


def excess(state: Array, range_bound: float) -> float:
    """Return how far cos θ2 is below its bound; negative inside the range."""
    return range_bound - float(regularity(state[THETA]))


def excess_rate(state: Array) -> float:
    """Return the rate of `excess`, 1/s: sin θ2 times θ̇2."""
    pitch_rate = rate_matrix(state[THETA])[1] @ state[OMEGA]
    return float(np.sin(state[PITCH]) * pitch_rate)


def exit_inside(path: Path, before: float, after: float, range_bound: float) -> float | None:
    """Return when a motion leaves the range in an interval at whose end it is inside again.

    cos θ2 has a minimum in the interval if its rate changes sign; this minimum is located. So a
    dip of any length is found.

    Args:
        path: The motion.
        before: The start of the interval, s; the motion is inside the range there.
        after: Its end, s.
        range_bound: The bound of cos θ2.

    Returns:
        The time at which cos θ2 falls to its bound, s; None if it does not.
    """
    if not excess_rate(path(before)) > 0 > excess_rate(path(after)):
        return None
    lowest = zero_between(lambda t: excess_rate(path(t)), before, after, OF_RANGE)
    if not excess(path(lowest), range_bound) >= 0:
        return None
    return event_time(lambda t: excess(path(t), range_bound), before, lowest, OF_RANGE)


def first_exit(path: Path, begin: float, end: float, range_bound: float) -> float | None:
    """Return when a motion first leaves the range within a step, s; None if it does not.

    Args:
        path: The motion.
        begin: The start of the step, s.
        end: Its end, s.
        range_bound: The bound of cos θ2.
    """

    def value(t: float) -> float:
        return excess(path(t), range_bound)

    for before, after in pairwise(np.linspace(begin, end, TESTS_PER_STEP + 1).tolist()):
        if value(after) >= 0:
            return event_time(value, before, after, OF_RANGE)
        stop = exit_inside(path, before, after, range_bound)
        if stop is not None:
            return stop
    return None
