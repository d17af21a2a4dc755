"""A time axis in two parts, so that a fast transient at the start of a run has room."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array

FIRST_SHARE = 0.4
"""The share of the width of the axis that its first part has."""


class SplitTime(NamedTuple):
    """A time axis with two scales, each linear: a wide one before a time, and a narrow one after.

    Attributes:
        begin: The first time, s.
        at: The time at which the scale changes, s.
        end: The last time, s.
    """

    begin: float
    at: float
    end: float

    def places(self, times: Array) -> Array:
        """Return the places of times on the axis: 0 at its begin, 1 at its end."""
        first, second = self._slopes
        after = np.asarray(times, dtype=float) - self.at
        return FIRST_SHARE + np.where(after < 0, first, second) * after

    def times(self, places: Array) -> Array:
        """Return the times at places on the axis: the inverse of `places`."""
        first, second = self._slopes
        after = np.asarray(places, dtype=float) - FIRST_SHARE
        return self.at + after / np.where(after < 0, first, second)

    @property
    def _slopes(self) -> tuple[float, float]:
        """The width of a second in each part, as a share of the axis."""
        first = FIRST_SHARE / (self.at - self.begin)
        return first, (1.0 - FIRST_SHARE) / (self.end - self.at)
