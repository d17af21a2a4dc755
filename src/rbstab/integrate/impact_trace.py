"""The impacts of a run against a stop, as stored in a trajectory."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array


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
        is_stored = self.times <= time
        return self._replace(
            counts=self.counts[:samples],
            lost=self.lost[:samples],
            resting=self.resting[:samples],
            times=self.times[is_stored],
            rates=self.rates[is_stored],
            rests=[
                (begin, end if end <= time else np.nan)
                for begin, end in self.rests
                if begin <= time
            ],
        )
