"""A log of the switches of a run."""

from dataclasses import dataclass, field

from rbstab.integrate.switch_trace import StickSlip

MAX_TRANSITIONS = 100_000
"""At most this many sticks and releases are stored. The exact law makes a few; the implicit law may
make one in every step."""

MIN_STICK_TEST_INTERVAL = 32
"""The minimum number of switches between two stick tests, because one test costs as much as many
switches."""

STICK_TEST_DIVISOR = 64
"""The number of switches between two stick tests grows to 1/64 of all switches so far."""


@dataclass
class SwitchLog:
    """Counts of all switches, times of the first switches, and all sticks and releases.

    Args:
        stored: How many switches are stored with time and axis.
        limit: How many switches the run may make.
        next_stick_test: The number of switches at which sticking is tested next.
    """

    stored: int
    limit: int
    next_stick_test: int = 1
    counts: list[int] = field(default_factory=lambda: [0, 0, 0])
    total: int = 0
    last_time: float = 0.0
    times: list[float] = field(default_factory=list)
    axes: list[int] = field(default_factory=list)
    transitions: list[tuple[float, int, StickSlip]] = field(default_factory=list)

    def add_switch(self, time: float, axis: int) -> bool:
        """Record a switch; return False if the limit is reached."""
        self.counts[axis] += 1
        self.total += 1
        self.last_time = time
        if self.total <= self.stored:
            self.times.append(time)
            self.axes.append(axis)
        return self.total < self.limit

    def checkpoint(self) -> tuple[int, tuple[int, ...], float]:
        """Return the state of the log, for `restore`."""
        return self.total, tuple(self.counts), self.last_time

    def restore(self, checkpoint: tuple[int, tuple[int, ...], float]) -> None:
        """Remove the switches recorded after a checkpoint."""
        self.total, counts, self.last_time = checkpoint
        self.counts = list(counts)
        del self.times[self.total :], self.axes[self.total :]

    def add_transition(self, time: float, axis: int, kind: StickSlip) -> None:
        """Record a stick or a release; only `add_switch` counts it as a switch."""
        if len(self.transitions) < MAX_TRANSITIONS:
            self.transitions.append((time, axis, kind))

    def add_sticks(self, time: float, axes: tuple[int, ...]) -> None:
        """Record axes that stick to end a weak chatter."""
        for axis in axes:
            self.add_switch(time, axis)
            self.add_transition(time, axis, StickSlip.STICK)

    def schedule_stick_test(self) -> None:
        """Set the number of switches at which sticking is tested next, after a test."""
        interval = max(MIN_STICK_TEST_INTERVAL, self.total // STICK_TEST_DIVISOR)
        self.next_stick_test = self.total + interval
