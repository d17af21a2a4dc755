"""The impacts, rests and switches of a run, as a trajectory stores them.

A stop has impacts, and rests against it; the axes of a sliding controller switch.
"""

from typing import Any

import numpy as np

from rbstab.integrate.problem import Problem
from rbstab.integrate.switching.chatter import Chatter
from rbstab.integrate.traces import ImpactTrace, StickSlip, SwitchTrace
from rbstab.mechanics.numbers import Array

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
        """Keep an impact.

        Args:
            t: The time, s.
            rate: θ̇2 before it, rad/s.
            lost: The energy that it takes away, J.
        """
        self.lost += lost
        self.count += 1
        self._impacts.append((t, rate))

    def follow(self, t: float, before: int, now: int) -> None:
        """Keep the begin or the end of a rest.

        Args:
            t: The time, s.
            before: The side on which the body rested before, 1 or -1, or 0.
            now: The side on which it rests now, or 0.
        """
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


MAX_TRANSITIONS = 100_000
"""At most this many sticks and releases are stored. The exact law makes a few; the implicit law may
make one in every step."""


class SwitchRecord:
    """Counts of all switches, times of the first ones, sticks and releases, and the samples.

    Args:
        problem: The problem; it has rules for its switches.

    Attributes:
        counts: The switches of each axis so far.
        total: All switches so far.
        transitions: The sticks and releases so far: time (s), axis and kind.
        discarded: The energy discarded so far, J.
    """

    def __init__(self, problem: Problem) -> None:
        assert problem.switching is not None
        self._diagnosed, self._stored = problem.diagnosed, problem.switching.stored_switches
        self.chatter = Chatter(problem.system)
        self.counts, self.total, self.discarded = [0, 0, 0], 0, 0.0
        self.transitions: list[tuple[float, int, StickSlip]] = []
        self._switches: list[tuple[float, int]] = []
        self._samples: list[tuple[Any, ...]] = []

    def add_switch(self, t: float, axis: int) -> None:
        """Count a switch of an axis at a time, s."""
        self.counts[axis] += 1
        self.total += 1
        if self.total <= self._stored:
            self._switches.append((t, axis))

    def add_transition(self, t: float, axis: int, *, held: bool) -> None:
        """Keep that an axis is held or released; only `add_switch` counts it.

        Args:
            t: The time, s.
            axis: The axis.
            held: Whether it is held from now on.
        """
        if len(self.transitions) < MAX_TRANSITIONS:
            kind = StickSlip.STICK if held else StickSlip.RELEASE
            self.transitions.append((t, axis, kind))

    def add_sample(self, sides: Array, y: Array, counts: tuple[int, ...] | None = None) -> None:
        """Keep a sample.

        Args:
            sides: The side of each axis, 0 for one that is held.
            y: The audited state.
            counts: The switches of each axis so far; default all.
        """
        energy = self.chatter.energy(y) if self._diagnosed else np.nan
        self._samples.append((sides, counts or tuple(self.counts), energy, self.discarded))

    def trace(self) -> SwitchTrace:
        """Return the switches of the samples so far."""
        modes, counts, energies, discarded = map(np.array, zip(*self._samples, strict=True))
        times, axes = zip(*self._switches, strict=True) if self._switches else ((), ())
        return SwitchTrace(
            modes=modes,
            counts=counts,
            chatter_energy=energies,
            discarded_energy=discarded,
            switch_times=np.array(times),
            switch_axes=np.array(axes, dtype=int),
            transitions=self.transitions,
        )
