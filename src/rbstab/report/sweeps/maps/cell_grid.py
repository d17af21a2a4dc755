"""The cells of a map, and the members in them."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.sweeps.parameters import BinnedAxis

MIN_MEMBERS = 5
"""A cell of sampled values with fewer members stays empty: its value would be unreliable."""


class MapGrid(NamedTuple):
    """Two axes divided into cells, and the members in the cells.

    chosen are the numbers of the members, in ascending order. cells has the index of the cell of
    each of them, counted row by row.
    """

    x: BinnedAxis
    y: BinnedAxis
    chosen: Array
    cells: Array

    @property
    def shape(self) -> tuple[int, int]:
        """The numbers of rows and columns."""
        return len(self.y.middles), len(self.x.middles)

    @property
    def counts(self) -> Array:
        """The number of members in each cell, row by row."""
        return np.bincount(self.cells, minlength=self.shape[0] * self.shape[1])

    @property
    def is_single(self) -> bool:
        """Whether no cell has more than one member."""
        return int(self.counts.max(initial=0)) <= 1

    @property
    def min_members(self) -> int:
        """The number of members that a cell needs to have a value."""
        return MIN_MEMBERS if self.x.sampled or self.y.sampled else 1


def map_grid(x: BinnedAxis, y: BinnedAxis, chosen: Array | None = None) -> MapGrid:
    """Return the grid of two axes with the chosen members (their numbers; None: all)."""
    chosen = np.arange(len(x.indices)) if chosen is None else chosen
    cells = y.indices[chosen] * len(x.middles) + x.indices[chosen]
    return MapGrid(x, y, chosen, cells)
