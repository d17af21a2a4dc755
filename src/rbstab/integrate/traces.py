"""The switches and the impacts of a run, as stored in a trajectory."""

from enum import StrEnum
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array


class StickSlip(StrEnum):
    """A change of mode other than a crossing of the surface: sticking begins or ends."""

    STICK = "stick"
    RELEASE = "release"


class SwitchTrace(NamedTuple):
    """The switching of a run: its modes at the samples, and its switches.

    Attributes:
        modes: -1, 0 or 1 for each axis, shape (n, 3).
        counts: Switches so far, shape (n, 3).
        chatter_energy: Shape (n,), J; NaN if the problem is not diagnosed.
        discarded_energy: Shape (n,), J.
        switch_times: Times of the first switches, s.
        switch_axes: Axes of the first switches.
        transitions: All sticks and releases: time (s), axis and kind.
    """

    modes: Array
    counts: Array
    chatter_energy: Array
    discarded_energy: Array
    switch_times: Array
    switch_axes: Array
    transitions: list[tuple[float, int, StickSlip]]

    def until(self, time: float, samples: int) -> "SwitchTrace":
        """Return the switching up to a time, with the first samples."""
        stored = self.switch_times <= time
        # The first four fields have a row for each sample.
        modes, counts, energies, discarded = (rows[:samples] for rows in self[:4])
        return SwitchTrace(
            modes,
            counts,
            energies,
            discarded,
            self.switch_times[stored],
            self.switch_axes[stored],
            [entry for entry in self.transitions if entry[0] <= time],
        )


class ImpactTrace(NamedTuple):
    """The impacts of a run, and the times at which it rested against its stop.

    Attributes:
        counts: Impacts so far, shape (n,).
        lost: The energy that they have taken away so far, shape (n,), J. It includes what was
            discarded when the body came to rest against the stop.
        resting: The side on which the body rests: -1, 0 or 1, shape (n,).
        times: Times of the first impacts, s.
        rates: θ̇2 before each of them, rad/s; its sign is that of the side.
        rests: The begin and the end of each rest against the stop, s; NaN for one without an end.
    """

    counts: Array
    lost: Array
    resting: Array
    times: Array
    rates: Array
    rests: list[tuple[float, float]]

    def until(self, time: float, samples: int) -> "ImpactTrace":
        """Return the impacts up to a time, with the first samples."""
        stored = self.times <= time
        counts, lost, resting = (rows[:samples] for rows in (self.counts, self.lost, self.resting))
        return ImpactTrace(
            counts,
            lost,
            resting,
            self.times[stored],
            self.rates[stored],
            [(begin, end if end <= time else np.nan) for begin, end in self.rests if begin <= time],
        )
