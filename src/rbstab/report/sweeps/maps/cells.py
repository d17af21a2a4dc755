"""The cells of a map: the members in them, their values, and why a cell has no value."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import CellMembers, Cells
from rbstab.report.sweeps.members import LEFT_RANGE, OUTCOMES, Members
from rbstab.report.sweeps.parameters import BinnedAxis
from rbstab.report.sweeps.quantiles import Ascending, quantiles_by_group
from rbstab.report.sweeps.quantities import MemberQuantity

MIN_MEMBERS = 5
"""A cell of sampled values with fewer members stays empty: its value would be unreliable."""

NEAREST, MAJORITY = "nearest to the median", "one of the majority"
"""What the member is that stands for a cell of several: for medians, and for shares."""

FIRST_REASON = 2
"""Before the outcomes of members that did not complete, there are two reasons for a gap."""


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
    def size(self) -> int:
        """The number of cells."""
        return self.shape[0] * self.shape[1]

    @property
    def counts(self) -> Array:
        """The number of members in each cell, row by row."""
        return np.bincount(self.cells, minlength=self.size)

    @property
    def is_single(self) -> bool:
        """Whether no cell has more than one member."""
        return int(self.counts.max(initial=0)) <= 1

    @property
    def min_members(self) -> int:
        """The number of members that a cell needs to have a value."""
        return MIN_MEMBERS if self.x.sampled or self.y.sampled else 1


def map_grid(x: BinnedAxis, y: BinnedAxis, chosen: Array | None = None) -> MapGrid:
    """Return the grid of two axes with the chosen members.

    Args:
        x: The horizontal axis.
        y: The vertical axis.
        chosen: The numbers of the members; None: all.
    """
    chosen = np.arange(len(x.indices)) if chosen is None else chosen
    cells = y.indices[chosen] * len(x.middles) + x.indices[chosen]
    return MapGrid(x, y, chosen, cells)


def cell_values(grid: MapGrid, values: Array, *, is_share: bool = False) -> Array:
    """Return the median of the finite values in each cell, or their mean, shape (rows, columns).

    Args:
        grid: The grid.
        values: The value of each member of the sweep, shape (n,); for shares 0 or 1. What is not
            finite does not count. A cell with too few values is NaN.
        is_share: Whether the mean is wanted.
    """
    chosen = values[grid.chosen].astype(float)
    finite = np.isfinite(chosen)
    counts = np.bincount(grid.cells[finite], minlength=grid.size)
    if is_share:
        sums = np.bincount(grid.cells[finite], weights=chosen[finite], minlength=grid.size)
        averages = sums / np.maximum(counts, 1)
    else:
        chosen = np.where(finite, chosen, np.nan)
        (averages,) = quantiles_by_group(grid.cells, grid.size, Ascending(chosen), (0.5,))
    enough: Array = np.where(counts >= grid.min_members, averages, np.nan)
    return enough.reshape(grid.shape)


def cells_of(members: Members, grid: MapGrid, quantity: MemberQuantity) -> Cells:
    """Return the map of a quantity, with the members in its cells.

    Args:
        members: The members of the sweep.
        grid: The cells, and the members in them.
        quantity: The quantity, with a number for each member.
    """
    values = cell_values(grid, quantity.values, is_share=quantity.is_share)
    chosen = quantity.values[grid.chosen]
    finite = np.isfinite(chosen)
    # The member with the least distance stands for a cell, one without a value only if no other.
    distance = np.where(finite, np.abs(chosen - values.ravel()[grid.cells]), np.inf)
    # A cell with too few values has no median; the first member with a value then stands for it.
    distance[np.isnan(distance)] = 0.0
    nearest = np.full(grid.size, np.inf)
    np.minimum.at(nearest, grid.cells, distance)
    is_nearest = distance == nearest[grid.cells]
    # Of several assignments to one place the last one holds: here that of the first member.
    shown = np.full(grid.size, -1)
    shown[grid.cells[is_nearest][::-1]] = grid.chosen[is_nearest][::-1]
    # Of a member without a value, that it did not complete says more than what the quantity lacks.
    outcomes = members.outcomes[grid.chosen]
    is_early = (outcomes >= LEFT_RANGE) & (not quantity.is_share)
    reason = np.where(is_early, outcomes - LEFT_RANGE + FIRST_REASON, 0)
    gaps = np.full(grid.size, -1)
    gaps[grid.cells[~finite][::-1]] = reason[~finite][::-1]
    gaps[grid.counts < grid.min_members] = 1
    gaps[np.isfinite(values.ravel()) | (grid.counts == 0)] = -1
    reasons = (quantity.missing, f"fewer than {grid.min_members} members", *OUTCOMES[LEFT_RANGE:])
    in_cells = CellMembers(
        grid.counts.reshape(grid.shape),
        shown.reshape(grid.shape),
        MAJORITY if quantity.is_share else NEAREST,
        gaps.reshape(grid.shape),
        reasons,
    )
    span = (0.0, 1.0) if quantity.is_share else None
    return Cells(grid.x.middles, grid.y.middles, values, quantity.axis, span, in_cells)
