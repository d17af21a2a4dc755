"""What is kept of the switches of a run."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from rbstab.mechanics.numbers import Array


class Transition(StrEnum):
    """How an axis changed its mode, other than by crossing the surface."""

    STICK = "stick"
    RELEASE = "release"


@dataclass
class SwitchLog:
    """Counts of all switches, times of the first ones, and every stick and release.

    Args:
        stored: How many switches keep their time and axis.
        limit: How many switches the run may make.
        pause_at: The number of switches at which it has to be looked at, if it has.
    """

    stored: int
    limit: int
    pause_at: int | None = None
    counts: list[int] = field(default_factory=lambda: [0, 0, 0])
    total: int = 0
    last_time: float = 0.0
    times: list[float] = field(default_factory=list)
    axes: list[int] = field(default_factory=list)
    transitions: list[tuple[float, int, Transition]] = field(default_factory=list)

    def switch(self, time: float, axis: int) -> bool:
        """Notes a switch; false where the run has to pause behind it."""
        self.counts[axis] += 1
        self.total += 1
        self.last_time = time
        if self.total <= self.stored:
            self.times.append(time)
            self.axes.append(axis)
        return self.total < (self.limit if self.pause_at is None else self.pause_at)

    def mark(self) -> tuple[int, tuple[int, ...], float]:
        """Where the log stands, for `back_to`."""
        return self.total, tuple(self.counts), self.last_time

    def back_to(self, mark: tuple[int, tuple[int, ...], float]) -> None:
        """Forgets the switches after a mark."""
        self.total, counts, self.last_time = mark
        self.counts = list(counts)
        del self.times[self.total :], self.axes[self.total :]

    def transition(self, time: float, axis: int, what: Transition) -> None:
        """Notes a stick or a release, which is a switch too."""
        self.transitions.append((time, axis, what))
        self.switch(time, axis)


class SwitchTrace(NamedTuple):
    """The switching of a run along its samples, and its switches.

    modes (n, 3) is -1, 0 or 1 for each axis; counts (n, 3) are the switches so far; chatter_energy
    (n,) and discarded_energy (n,), J; switch_times and switch_axes are those of the first switches;
    transitions are all sticks and releases; trusted_until, s, is how far the motion is reproducible
    in double precision (the slow quantities, Θ and e, are meaningful beyond it).
    """

    modes: Array
    counts: Array
    chatter_energy: Array
    discarded_energy: Array
    switch_times: Array
    switch_axes: Array
    transitions: list[tuple[float, int, Transition]]
    trusted_until: float
