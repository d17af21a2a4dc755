"""The deadline of a run: one limit of wall time for everything that takes time in it."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Deadline:
    """The end of the wall time that a run may take, counted from the creation of this object.

    One object serves the whole run: the motion, the second run for `trusted_until`, and the
    quantities and the certificate. Every loop calls `expired` or `remaining`.

    Args:
        limit: The wall time, s.
        clock: Returns the time, s.

    Attributes:
        limit: The wall time, s.
        recording_time: The time to record one sample after the motion, s.
        samples: The number of samples that must be recorded. The motion ends early enough to leave
            `recording_time` for each.
    """

    def __init__(self, limit: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.limit = limit
        self.recording_time = 0.0
        self.samples = 0
        self._clock = clock
        self._end = clock() + limit

    def expired(self) -> bool:
        """Return whether the motion must end now, so that its samples can still be recorded."""
        return self._clock() + self.samples * self.recording_time > self._end

    def is_late(self, margin: float) -> bool:
        """Return whether the samples could be recorded only later than `margin`, s, after the end.

        Then the work between the motion and the recording must stop.
        """
        return self.remaining() < self.samples * self.recording_time - margin

    def remaining(self) -> float:
        """Return the time that is left, s; it is negative after the end."""
        return self._end - self._clock()

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Return a context whose time does not count, for a compilation."""
        begin = self._clock()
        try:
            yield
        finally:
            self._end += self._clock() - begin

    @property
    def reason(self) -> str:
        """Why a run ended at this deadline, as text."""
        return f"stopped after {self.limit:g} s of wall time"
