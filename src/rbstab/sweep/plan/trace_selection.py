"""Of which members the whole motion is kept, and not only the summary."""

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array


@dataclass(frozen=True)
class TraceSelection:
    """The members with traces: every n-th, or some by number; of all others only the summary.

    Args:
        every: Members 0, n, 2n, ... have traces; 0: none.
        members: Numbers of members with traces, ascending.
    """

    every: int = 0
    members: tuple[int, ...] = ()

    def traces(self, start: int, stop: int) -> Array:
        """Whether each member from number `start` up to `stop` has a trace."""
        if self.every:
            return np.arange(start, stop) % self.every == 0
        first, behind = (bisect_left(self.members, number) for number in (start, stop))
        found = np.zeros(stop - start, dtype=bool)
        found[np.array(self.members[first:behind], dtype=np.int64) - start] = True
        return found

    def count(self, members: int) -> int:
        """How many of so many members have traces."""
        return -(-members // self.every) if self.every else len(self.members)


SUMMARY = TraceSelection()
"""No traces."""
