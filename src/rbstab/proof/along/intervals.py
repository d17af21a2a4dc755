"""How many rest states there are along a parameter: intervals on which that is proved, and others.

An interval is proved as one body is: its rest states are isolated, each with its index, for all p
of the interval at once, and all other boxes of Θ are excluded. One that is not proved is halved. So
what stays open lies about folds, pitchforks, and values at which a rest state leaves the range.

The degree Σ (-1)^index over all rest states is the same for all p between which none of them leaves
the range. So what branches show is not trusted if it has the degree of no proved interval, and of
none at whose ends a branch leaves the range.
"""

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.along.branches import Branches
from rbstab.proof.along.energy import RANGE, AlongEnergy, OverInterval
from rbstab.proof.robust.part import IsLate
from rbstab.proof.search import Search

FINEST = 2.0**-10
"""Shorter shares of the whole interval are not halved."""

THIN = 1e-4
"""Shares of the whole interval that are not told apart where nothing is proved."""

MOST_BOXES = 10_000
"""Boxes of Θ at which the search for one interval ends."""


class Interval(NamedTuple):
    """The rest states in the range for each p of an interval.

    Attributes:
        low: The lower end.
        high: The upper end.
        states: Their number; None if it is not decided.
        stable: How many of them are minima.
        proved: Whether this is proved for each p, also for the decimals that both ends mean; else
            it was seen in the middle, where these rest states are isolated.
        degree: Σ (-1)^index.
    """

    low: float
    high: float
    states: int | None
    stable: int | None
    proved: bool
    degree: int | None

    @classmethod
    def of(cls, low: float, high: float, indices: list[int], *, proved: bool) -> "Interval":
        """Return an interval with rest states.

        Args:
            low: Its lower end, in the unit of the parameter.
            high: Its upper end.
            indices: The Morse index of each rest state.
            proved: Whether they are proved to be all.
        """
        degree = sum((-1) ** index for index in indices)
        return cls(low, high, len(indices), indices.count(0), proved, degree)

    @property
    def not_decided(self) -> "Interval":
        """The same without numbers of states."""
        return self._replace(states=None, stable=None, degree=None)


Between = Callable[[float, float], AlongEnergy]
"""Returns the energy made for the middle of an interval."""


def intervals_of(
    branches: Branches, is_late: IsLate, between: Between | None = None
) -> list[Interval]:
    """Return intervals that cover the whole interval of a parameter.

    Args:
        branches: The branches that were found.
        is_late: Returns whether no further interval is to be tried.
        between: Makes the energy for each interval; by default that of the branches is taken.
    """
    proved = _merged(_proved(branches, is_late, between))
    ends = [branches.low, *(end for interval in proved for end in interval[:2]), branches.high]
    for low, high in pairwise(ends):
        branches.search(0.5 * low + 0.5 * high)
    gaps = zip(ends[::2], ends[1::2], strict=True)
    seen = [interval for gap in gaps for interval in _seen(branches, *gap)]
    counted = sorted((interval for interval in seen if interval.states is not None), key=_width)
    degrees = {interval.degree for interval in proved or counted[-1:]}
    degrees |= {interval.degree for interval in seen if branches.leave(interval.low, interval.high)}
    seen = [interval if interval.degree in degrees else interval.not_decided for interval in seen]
    return _merged(sorted([*proved, *seen]))


def _width(interval: Interval) -> float:
    return interval.high - interval.low


def _proved(branches: Branches, is_late: IsLate, between: Between | None) -> list[Interval]:
    low, high = branches.low, branches.high
    pending, intervals = deque([(low, high)]), list[Interval]()
    while pending and not is_late():
        start, end = pending.popleft()
        middle = 0.5 * start + 0.5 * end
        guesses = [Theta for Theta, _ in branches.states(middle)]
        energy = between(start, end) if between else branches.energy
        interval = proved_over(energy, start, end, guesses)
        if interval is not None:
            intervals.append(interval)
        elif end - start > FINEST * (high - low):
            pending += [(start, middle), (middle, end)]
    return sorted(intervals)


def proved_over(
    energy: AlongEnergy, low: float, high: float, guesses: Sequence[Array]
) -> Interval | None:
    """Prove the number of rest states for all p from `low` to `high`; None if that fails.

    Args:
        energy: V(Θ, p).
        low: The lower end.
        high: The upper end.
        guesses: Θ near rest states in the middle, of shape (3,): tried first, as most intervals
            fail at one of them.
    """
    search = Search(OverInterval(energy, low, high), RANGE)
    if guesses:
        search.with_zeros_near(np.array(guesses).T)
        if len(search.zeros) < len(guesses):
            return None
    zeros = search.run(MOST_BOXES)
    index = [zero.index for zero in zeros.zeros if zero.index is not None]
    if not zeros.proved or len(index) < len(zeros.zeros):
        return None
    return Interval.of(low, high, index, proved=True)


def _seen(branches: Branches, low: float, high: float) -> list[Interval]:
    """Return what the branches show between two values; they are cut where branches turn or end."""
    ends = [turn.value for turn in branches.turns.values()]
    ends += [float(curve.values[k]) for curve in branches.curves for k in (0, -1)]
    thin, cuts, intervals = THIN * (branches.high - branches.low), [low], list[Interval]()
    for end in sorted(ends):
        if cuts[-1] + thin < end < high - thin:
            cuts.append(end)
    for a, b in pairwise([*cuts, high]):
        if a < b:
            middle = 0.5 * a + 0.5 * b
            near = [Theta for Theta, _ in branches.states(middle)]
            search = Search(OverInterval(branches.energy, middle, middle), RANGE)
            zeros = search.with_zeros_near(np.array(near).T).zeros if near else ()
            index = [zero.index for zero in zeros if zero.index is not None]
            i = Interval.of(a, b, index, proved=False)
            intervals.append(i if len(index) == len(near) else i.not_decided)
    return _merged(intervals)


def _merged(intervals: Iterable[Interval]) -> list[Interval]:
    """Return intervals without ends between which nothing changes."""
    merged = list[Interval]()
    for interval in intervals:
        joins = merged and merged[-1].high == interval.low and merged[-1][2:] == interval[2:]
        merged.append(interval._replace(low=merged.pop().low) if joins else interval)
    return merged
