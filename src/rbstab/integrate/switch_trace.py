"""The switches of a run, as stored in a trajectory."""

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

    chatter_energy and trusted_until are NaN if the problem is not diagnosed. trusted_until is also
    NaN if the run, or the second run that determines it, ends at the deadline.

    Attributes:
        modes: -1, 0 or 1 for each axis, shape (n, 3).
        counts: Switches so far, shape (n, 3).
        chatter_energy: Shape (n,), J.
        discarded_energy: Shape (n,), J.
        switch_times: Times of the first switches, s.
        switch_axes: Axes of the first switches.
        transitions: All sticks and releases: time (s), axis and kind.
        trusted_until: The time up to which the motion is reproducible in double precision, s. After
            it, only the slow quantities Θ and e are meaningful.
    """

    modes: Array
    counts: Array
    chatter_energy: Array
    discarded_energy: Array
    switch_times: Array
    switch_axes: Array
    transitions: list[tuple[float, int, StickSlip]]
    trusted_until: float

    def until(self, time: float, samples: int) -> "SwitchTrace":
        """Return the switching up to a time, with the first samples."""
        is_stored = self.switch_times <= time
        return self._replace(
            modes=self.modes[:samples],
            counts=self.counts[:samples],
            chatter_energy=self.chatter_energy[:samples],
            discarded_energy=self.discarded_energy[:samples],
            switch_times=self.switch_times[is_stored],
            switch_axes=self.switch_axes[is_stored],
            transitions=[entry for entry in self.transitions if entry[0] <= time],
            trusted_until=float(np.minimum(self.trusted_until, time)),
        )
