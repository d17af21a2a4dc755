"""The impacts of a run against its stop and its rests there, as a trajectory stores them."""

import numpy as np

from rbstab.integrate.traces import ImpactTrace

STORED_RESTS = 100_000
"""The rests that are stored with their times; there may be any number of them."""


class ImpactRecord:
    """The impacts of one run against the stop of its system.

    Attributes:
        lost: The energy that the impacts have taken away so far, J.
        count: The number of impacts so far.
    """

    def __init__(self) -> None:
        self.lost, self.count = 0.0, 0
        self._impacts: list[tuple[float, float]] = []
        self._rests: list[tuple[float, float]] = []
        self._samples: list[tuple[int, float, int]] = []

    @property
    def last_time(self) -> float:
        """The time of the last impact, s."""
        return self._impacts[-1][0] if self._impacts else -np.inf

    def add(self, t: float, rate: float, lost: float) -> None:
        """Keep an impact: its time, s, θ̇2 before it, rad/s, and the energy it takes away, J."""
        self.lost += lost
        self.count += 1
        self._impacts.append((t, rate))

    def follow(self, t: float, before: int, now: int) -> None:
        """Keep the begin or the end of a rest at a time, s, from the sides before and now."""
        if now and not before and len(self._rests) < STORED_RESTS:
            self._rests.append((t, np.nan))
        # A rest that began after the last stored one has no entry to end.
        if before and not now and self._rests and np.isnan(self._rests[-1][1]):
            self._rests[-1] = self._rests[-1][0], t

    def add_sample(self, resting: int) -> None:
        """Keep the impacts so far as those of a sample, at which the body rests on a side or 0."""
        self._samples.append((self.count, self.lost, resting))

    def trace(self) -> ImpactTrace:
        """Return the impacts of the samples so far."""
        counts, lost, resting = map(np.array, zip(*self._samples, strict=True))
        times, rates = np.array(self._impacts).reshape(-1, 2).T
        return ImpactTrace(counts, lost, resting, times, rates, self._rests)
