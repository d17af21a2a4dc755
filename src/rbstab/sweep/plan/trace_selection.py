"""Select the members whose trajectories are stored."""

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array


@dataclass(frozen=True)
class TraceSelection:
    """The members with traces: every n-th, or a list. For other members only a summary is stored.

    Args:
        every: Members 0, n, 2n, ... have traces; 0: none.
        members: Numbers of members with traces, ascending.
    """

    every: int = 0
    members: tuple[int, ...] = ()

    def selected(self, start: int, stop: int) -> Array:
        """Return whether each member from `start` up to `stop` has a trace, shape (stop - start,).

        Args:
            start: The first member.
            stop: One after the last member, as in `range`.
        """
        if self.every:
            return np.arange(start, stop) % self.every == 0
        first, end = (bisect_left(self.members, number) for number in (start, stop))
        selected = np.zeros(stop - start, dtype=bool)
        selected[np.array(self.members[first:end], dtype=np.int64) - start] = True
        return selected

    def count(self, members: int) -> int:
        """Return the number of traces of a sweep with this number of members."""
        return -(-members // self.every) if self.every else len(self.members)


NO_TRACES = TraceSelection()
