"""Values of members in groups: the cells of a map, or ranges along a parameter."""

import numpy as np

from rbstab.mechanics.numbers import Array


class Grouped:
    """The order that puts members of one group beside one another.

    Sorting whole numbers once, and then only the values in each group, takes an eighth of the time
    of `scipy.ndimage.median` for a million members.

    Args:
        groups: The group of each member, integers from 0, shape (n,).
        size: The number of groups.
    """

    def __init__(self, groups: Array, size: int) -> None:
        self.counts = np.bincount(groups, minlength=size)
        # Numbers of 16 bits are sorted in linear time.
        self._order = np.argsort(groups.astype(np.min_scalar_type(size)), kind="stable")
        self._ends = np.cumsum(self.counts)

    def split(self, values: Array) -> list[Array]:
        """Return the values of each group that has members."""
        return self._parts(values, np.flatnonzero(self.counts))

    def medians(self, values: Array, least: int = 1) -> Array:
        """Return the median of each group, shape (groups,).

        Args:
            values: Without NaN, shape (n,).
            least: Groups of fewer members are NaN.
        """
        found = np.full(len(self.counts), np.nan)
        filled = np.flatnonzero(self.counts >= least)
        for group, own in zip(filled.tolist(), self._parts(values, filled), strict=True):
            low, high = (len(own) - 1) // 2, len(own) // 2
            own.partition((low, high))
            found[group] = (own[low] + own[high]) / 2
        return found

    def _parts(self, values: Array, groups: Array) -> list[Array]:
        ordered, ends = values[self._order], self._ends[groups]
        starts = ends - self.counts[groups]
        bounds = zip(starts.tolist(), ends.tolist(), strict=True)
        return [ordered[start:end] for start, end in bounds]
