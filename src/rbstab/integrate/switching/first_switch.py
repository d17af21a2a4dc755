"""The first switch within a step: margins that fall below zero, also if they rise again."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from rbstab.integrate.event_time import zero_between
from rbstab.integrate.switching.phases import Phase, Switch
from rbstab.mechanics.numbers import Array

TESTS_PER_STEP = 8
"""Each step is divided into this many intervals, at whose ends the margins are tested."""

MIN_ACCURACY = 1e-9
"""The accuracy of the time of a least margin, relative to its interval. The margin itself is far
more accurate there."""

ROUND_OFF = 2e-15
"""A margin that is below zero by less than this may be zero. If it stays so, as that of a body at
rest at a slack length, nothing switches; if it keeps falling, the mode switches as soon as it is
clearly below zero."""

Path = Callable[[Any], Array]
"""The audited state as a function of time, within a step; states are columns for several times."""


def first_switch(
    phase: Phase, path: Path, ends: tuple[float, float], states: Array, rates: Array
) -> Switch | None:
    """Return the first switch of a step, or None.

    A margin that falls below zero and rises again within the step is least in between. Such a least
    margin lies beside the smallest of three neighbouring tests, or beside an end of the step at
    which the margin is falling (at the start) or rising (at the end). Only one that is small enough
    to reach zero is searched.

    Args:
        phase: The phase of the step.
        path: The motion.
        ends: The start and the end of the step, s.
        states: The audited states at both ends, shape (2, states).
        rates: Their audited rates, of the same shape.
    """
    times = np.linspace(*ends, TESTS_PER_STEP + 1)
    columns = [states[0], *path(times[1:-1]).T, states[1]]
    pairs = zip(columns, times.tolist(), strict=True)
    margins = np.array([phase.margins(state, t) for state, t in pairs])
    slopes = [phase.margin_rates(y, t, f) for y, t, f in zip(states, ends, rates, strict=True)]
    found = [
        switch
        for mode in _suspects(margins, slopes, times[1] - times[0])
        if (switch := _Margin(phase, path, mode).first_zero(times, margins, slopes)) is not None
    ]
    return min(found, key=lambda switch: switch.time, default=None)


def _suspects(margins: Array, slopes: list[Array], length: float) -> list[int]:
    """Return the modes whose margin may be negative somewhere in the step."""
    negative = (margins[1:] < -ROUND_OFF).any(axis=0)
    # The parabola through three points reaches below them by at most an eighth of this.
    bends = np.abs(margins[:-2] - 2.0 * margins[1:-1] + margins[2:])
    lowest = (margins[1:-1] <= margins[:-2]) & (margins[1:-1] <= margins[2:])
    dips = (lowest & (margins[1:-1] <= bends)).any(axis=0)
    falls = (slopes[0] < 0) & (margins[1] >= margins[0]) & (margins[0] <= -slopes[0] * length)
    rises = (slopes[1] > 0) & (margins[-2] >= margins[-1]) & (margins[-1] <= slopes[1] * length)
    return np.flatnonzero(negative | dips | falls | rises).tolist()


class _Margin:
    """The margin of one mode along a step."""

    def __init__(self, phase: Phase, path: Path, mode: int) -> None:
        self.phase, self.path, self.mode = phase, path, mode

    def __call__(self, t: float) -> float:
        """Return the margin at a time."""
        return float(self.phase.margins(self.path(t), t)[self.mode])

    def first_zero(self, times: Array, margins: Array, slopes: list[Array]) -> Switch | None:
        """Return where the margin first falls to zero; see `first_switch`."""
        h, t = margins[:, self.mode].tolist(), times.tolist()
        falls, rises = float(slopes[0][self.mode]), float(slopes[1][self.mode])
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

    def _before(self, below: float, h: list[float], t: list[float], falls: float) -> Switch:
        """Return the zero before the first time at which the margin is known to be negative.

        Args:
            below: This time, s.
            h: The margins at the tests before it. None is clearly negative.
            t: The times of the tests, s.
            falls: The rate of the margin at the first test.
        """
        positive = [time for time, margin in zip(t, h, strict=False) if margin > 0]
        if positive:
            return self._between(positive[-1], below)
        if falls <= 0:
            return Switch(self.mode, t[0], t[0])
        # The mode has just switched: its margin rises from zero, and falls again.
        high = self._extreme(t[0], below, -1.0)
        return self._between(high, below) if self(high) > 0 else Switch(self.mode, high, high)

    def _extreme(self, begin: float, end: float, sign: float) -> float:
        """Return the time of the least margin in an interval, or of the largest if sign is -1."""
        found = minimize_scalar(
            lambda t: sign * self(t),
            bounds=(begin, end),
            method="bounded",
            options={"xatol": MIN_ACCURACY * (end - begin)},
        )
        return float(found.x)

    def _between(self, above: float, below: float) -> Switch:
        """Return the zero between a time with a positive and one with a negative margin."""
        if self(below) >= 0:
            # A step that ends at an event: its last state is below zero by the round-off of both.
            return Switch(self.mode, below, below)
        return Switch(self.mode, zero_between(self, above, below), below)
