"""The first event within a step: an event function that falls below zero, also if it rises again.

Event functions are positive before their events: the margins of modes, the distance from the end of
the range, the lengths of springs. SciPy's steps are searched here. heyoka finds most events itself,
as zeros of the Taylor polynomials of its steps.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array

TESTS_PER_STEP = 8
"""Each step is divided into this many intervals, at whose ends the event functions are tested."""

MIN_ACCURACY = 1e-9
"""The accuracy of the time of a least value, relative to its interval. The value itself is far more
accurate there."""

ROUND_OFF = 2e-15
"""A value that is below zero by less than this may be zero. If it stays so, as that of a body at
rest at a slack length, nothing happens; if it keeps falling, the event is as soon as it is clearly
below zero."""

ABSOLUTE, RELATIVE = 1e-16, 9e-16
"""How closely the time of a zero is bracketed, s and relative: `brentq` takes no relative tolerance
below 8.9e-16, and the absolute one matters only near t = 0."""

Path = Callable[[Any], Array]
"""The audited state as a function of time, within a step; states are columns for several times."""

EventFunctions = Callable[[Array, float], Array]
"""The event functions at an audited state and a time, s."""


class Event(NamedTuple):
    """Which event function falls to zero, when, s, and the end of the bracket of this time, s."""

    number: int
    time: float
    latest: float


def first_event(
    functions: EventFunctions,
    path: Path,
    ends: tuple[float, float],
    states: tuple[Array, Array],
    slopes: Sequence[Array],
) -> Event | None:
    """Return the first event of a step, or None.

    A function that falls below zero and rises again within the step is least in between. Such a
    least value lies beside the smallest of three neighbouring tests, or beside an end of the step
    at which the function is falling (at the start) or rising (at the end). Only one that is small
    enough to reach zero is searched.

    Args:
        functions: The event functions.
        path: The motion.
        ends: The start and the end of the step, s.
        states: The audited states at both ends.
        slopes: The rates of the event functions at both ends.
    """
    times = np.linspace(*ends, TESTS_PER_STEP + 1)
    columns = [states[0], *path(times[1:-1]).T, states[1]]
    pairs = zip(columns, times.tolist(), strict=True)
    values = np.array([functions(state, t) for state, t in pairs])
    events = [
        event
        for number in _suspects(values, slopes, times[1] - times[0])
        if (event := _Search(functions, path, number).first_zero(times, values, slopes)) is not None
    ]
    return min(events, key=lambda event: event.time, default=None)


def _suspects(values: Array, slopes: Sequence[Array], length: float) -> list[int]:
    """Return the functions that may be negative somewhere in the step."""
    negative = (values[1:] < -ROUND_OFF).any(axis=0)
    # The parabola through three points reaches below them by at most an eighth of this.
    bends = np.abs(values[:-2] - 2.0 * values[1:-1] + values[2:])
    lowest = (values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:])
    dips = (lowest & (values[1:-1] <= bends)).any(axis=0)
    falls = (slopes[0] < 0) & (values[1] >= values[0]) & (values[0] <= -slopes[0] * length)
    rises = (slopes[1] > 0) & (values[-2] >= values[-1]) & (values[-1] <= slopes[1] * length)
    return np.flatnonzero(negative | dips | falls | rises).tolist()


class _Search:
    """One event function along a step."""

    def __init__(self, functions: EventFunctions, path: Path, number: int) -> None:
        self.functions, self.path, self.number = functions, path, number

    def __call__(self, t: float) -> float:
        """Return the value at a time."""
        return float(self.functions(self.path(t), t)[self.number])

    def first_zero(self, times: Array, values: Array, slopes: Sequence[Array]) -> Event | None:
        """Return where the function first falls to zero; see `first_event`."""
        h, t = values[:, self.number].tolist(), times.tolist()
        falls, rises = float(slopes[0][self.number]), float(slopes[1][self.number])
        last = len(t) - 1
        for k in range(1, last + 1):
            if h[k] < -ROUND_OFF:
                return self._before(t[k], h[:k], t, falls)
            begin, end = k - 1, k
            if k < last and h[k] <= h[k - 1] and h[k] <= h[k + 1]:
                end = k + 1
            elif not (k == 1 and falls < 0 and h[1] >= h[0]) and not (
                k == last and rises > 0 and h[last - 1] >= h[last]
            ):
                continue
            low = self._extreme(t[begin], t[end], 1.0)
            if self(low) < -ROUND_OFF:
                return self._before(low, h[: begin + 1], t, falls)
        return None

    def _before(self, below: float, h: list[float], t: list[float], falls: float) -> Event:
        """Return the zero before `below`, s, at which the function is known to be negative."""
        # The values `h`, at the times `t` before it, are not clearly negative.
        positive = [time for time, value in zip(t, h, strict=False) if value > 0]
        if positive:
            return self._between(positive[-1], below)
        # `falls` is the rate at the first of them.
        if falls <= 0:
            return Event(self.number, t[0], t[0])
        # The mode has just switched: its margin rises from zero, and falls again.
        high = self._extreme(t[0], below, -1.0)
        return self._between(high, below) if self(high) > 0 else Event(self.number, high, high)

    def _extreme(self, begin: float, end: float, sign: float) -> float:
        """Return the time of the least value in an interval, or of the largest if sign is -1."""
        # Imported late: heyoka finds the zeros of most events itself, and sweeps start faster.
        from scipy.optimize import minimize_scalar

        optimum = minimize_scalar(
            lambda t: sign * self(t),
            bounds=(begin, end),
            method="bounded",
            options={"xatol": MIN_ACCURACY * (end - begin)},
        )
        return float(optimum.x)

    def _between(self, above: float, below: float) -> Event:
        """Return the zero between a time with a positive and one with a negative value."""
        if self(below) >= 0:
            # A step that ends at an event: its last state is below zero by the round-off of both.
            return Event(self.number, below, below)
        from scipy.optimize import brentq  # imported late, as above

        time = float(brentq(self, above, below, xtol=ABSOLUTE, rtol=RELATIVE))
        return Event(self.number, time, below)
