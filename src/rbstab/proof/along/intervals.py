"""How many rest states there are along a parameter: intervals on which that is proved, and others.

An interval is proved as one body is: its rest states are isolated, each with its index, for all p
of the interval at once, and all other boxes of Θ are excluded. One that is not proved is halved. So
what stays open lies about folds, pitchforks, and values at which a rest state leaves the range.
"""

from collections import deque
from collections.abc import Iterable, Sequence
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
        states: Their number.
        stable: How many of them are minima.
        proved: Whether this is proved for each p, also for the decimals that both ends mean; else
            it was seen inside.
    """

    low: float
    high: float
    states: int
    stable: int
    proved: bool


def intervals_of(branches: Branches, is_late: IsLate) -> list[Interval]:
    """Return intervals that cover the whole interval of a parameter.

    Args:
        branches: The branches that were found.
        is_late: Returns whether no further interval is to be tried.
    """
    proved = _merged(_proved(branches, is_late))
    ends = [branches.low, *(end for interval in proved for end in interval[:2]), branches.high]
    for low, high in pairwise(ends):
        branches.search(0.5 * low + 0.5 * high)
    gaps = zip(ends[::2], ends[1::2], strict=True)
    return sorted([*proved, *(interval for gap in gaps for interval in _seen(branches, *gap))])


def _proved(branches: Branches, is_late: IsLate) -> list[Interval]:
    low, high = branches.low, branches.high
    pending, intervals = deque([(low, high)]), list[Interval]()
    while pending and not is_late():
        start, end = pending.popleft()
        middle = 0.5 * start + 0.5 * end
        guesses = [Theta for Theta, _ in branches.states(middle)]
        interval = proved_over(branches.energy, start, end, guesses)
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
    index = [zero.index for zero in zeros.zeros]
    if not zeros.proved or None in index:
        return None
    return Interval(low, high, len(index), index.count(0), proved=True)


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
            index = [i for _, i in branches.states(0.5 * a + 0.5 * b)]
            intervals.append(Interval(a, b, len(index), index.count(0), proved=False))
    return _merged(intervals)


def _merged(intervals: Iterable[Interval]) -> list[Interval]:
    """Return intervals without ends between which nothing changes."""
    merged = list[Interval]()
    for interval in intervals:
        joins = merged and merged[-1].high == interval.low and merged[-1][2:] == interval[2:]
        merged.append(interval._replace(low=merged.pop().low) if joins else interval)
    return merged
