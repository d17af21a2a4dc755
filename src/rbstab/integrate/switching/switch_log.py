"""What is kept of the switches of a run."""

from dataclasses import dataclass, field

from rbstab.integrate.switch_trace import Transition

MAX_TRANSITIONS = 100_000
"""Sticks and releases that are kept; the exact law makes a few, the implicit one up to a step's
number."""


@dataclass
class SwitchLog:
    """Counts of all switches, times of the first ones, and the sticks and releases.

    Args:
        stored: How many switches keep their time and axis.
        limit: How many switches the run may make.
        look_from: The number of switches from which on a weak chatter has to be looked at.
    """

    stored: int
    limit: int
    look_from: int = 1
    counts: list[int] = field(default_factory=lambda: [0, 0, 0])
    total: int = 0
    last_time: float = 0.0
    times: list[float] = field(default_factory=list)
    axes: list[int] = field(default_factory=list)
    transitions: list[tuple[float, int, Transition]] = field(default_factory=list)

    def switch(self, time: float, axis: int) -> bool:
        """Notes a switch; false where it was the last that is allowed."""
        self.counts[axis] += 1
        self.total += 1
        self.last_time = time
        if self.total <= self.stored:
            self.times.append(time)
            self.axes.append(axis)
        return self.total < self.limit

    def mark(self) -> tuple[int, tuple[int, ...], float]:
        """Where the log stands, for `back_to`."""
        return self.total, tuple(self.counts), self.last_time

    def back_to(self, mark: tuple[int, tuple[int, ...], float]) -> None:
        """Forgets the switches after a mark."""
        self.total, counts, self.last_time = mark
        self.counts = list(counts)
        del self.times[self.total :], self.axes[self.total :]

    def transition(self, time: float, axis: int, what: Transition) -> None:
        """Notes a stick or a release, which is counted as a switch besides."""
        if len(self.transitions) < MAX_TRANSITIONS:
            self.transitions.append((time, axis, what))
