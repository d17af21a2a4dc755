"""The time of an event within a step: a zero of an event function on SciPy's dense output.

All code that follows a motion step by step with SciPy locates its events here: the switches of
sliding connectors and of elements, and the end of the range of eq. 5. heyoka locates its events
itself, as zeros of the Taylor polynomials of its steps.
"""

from collections.abc import Callable
from typing import NamedTuple

from scipy.optimize import brentq

EventFunction = Callable[[float], float]
"""A continuous function of the time, s."""


class TimeTolerance(NamedTuple):
    """How closely a zero is bracketed: absolute, s, and relative to the time."""

    absolute: float
    relative: float


OF_SWITCHES = TimeTolerance(1e-16, 9e-16)
"""Round-off: `brentq` takes no relative tolerance below 8.9e-16. The absolute one matters only for
events near t = 0."""

OF_RANGE = TimeTolerance(1e-15, 8.881784197001252e-16)
"""The run ends there, so nothing follows from the last digit of the time. The tolerance is not that
of switches only because stored runs were made with it."""


def zero_between(
    value: EventFunction, before: float, after: float, tolerance: TimeTolerance = OF_SWITCHES
) -> float:
    """Return the zero of an event function between two times at which its signs differ.

    Args:
        value: The event function. It may be zero at one of the times: then this time is returned.
        before: The first time, s.
        after: The second time, s.
        tolerance: How closely the zero is bracketed.

    Raises:
        ValueError: The signs at both times are the same.
    """
    absolute, relative = tolerance
    return float(brentq(value, before, after, xtol=absolute, rtol=relative))


def event_time(
    value: EventFunction, before: float, after: float, tolerance: TimeTolerance = OF_SWITCHES
) -> float:
    """Return the time of an event in an interval at whose end it has happened.

    The event is at the start of the interval if it has happened there already: a projection, or the
    error of the dense output, can put the start of a step past it.

    Args:
        value: The event function. It is negative before the event, and not negative at `after`.
        before: The start of the interval, s.
        after: Its end, s.
        tolerance: How closely the time is bracketed.
    """
    if value(before) >= 0:
        return before
    return zero_between(value, before, after, tolerance)
