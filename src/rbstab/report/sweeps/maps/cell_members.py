"""The members in the cells of a map: which one stands for a cell, and why a cell has no value."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import CellMembers
from rbstab.report.sweeps.maps.cell_grid import MapGrid
from rbstab.report.sweeps.members import LEFT_RANGE, OUTCOMES, Members
from rbstab.report.sweeps.quantities import MemberQuantity

NEAREST, FIRST = "nearest to the median", "the first of them"
"""What the member is that stands for a cell of several: for medians, and for shares."""

FIRST_REASON = 2
"""Before the outcomes of members that did not complete, there are two reasons for a gap."""


def quantity_members(
    members: Members, grid: MapGrid, quantity: MemberQuantity, values: Array
) -> CellMembers:
    """Return the members in the cells of a map of medians.

    Args:
        members: The members.
        grid: The grid of the map.
        quantity: The quantity.
        values: The median in each cell, shape (rows, columns); NaN where there is none.
    """
    own = quantity.values[grid.chosen]
    shown = _first(grid)
    finite = np.isfinite(own)
    cells, numbers = grid.cells[finite], grid.chosen[finite]
    # A cell with too few values has no median; its first member then stands for it.
    distance = np.nan_to_num(np.abs(own[finite] - values.ravel()[cells]), nan=0.0)
    nearest = np.full(len(shown), np.inf)
    np.minimum.at(nearest, cells, distance)
    is_nearest = distance == nearest[cells]
    _set_first(shown, cells[is_nearest], numbers[is_nearest])
    outcomes = members.outcomes[grid.chosen]
    # A member that did not complete has no value for that reason, another one for the quantity's.
    codes = np.where(outcomes >= LEFT_RANGE, outcomes - LEFT_RANGE + FIRST_REASON, 0)
    gaps, reasons = _gaps(grid, values, quantity.missing, np.where(finite, -1, codes))
    counts = grid.counts.reshape(grid.shape)
    return CellMembers(counts, shown.reshape(grid.shape), NEAREST, gaps, reasons)


def share_members(grid: MapGrid, values: Array, reason: str = "no value") -> CellMembers:
    """Return the members in the cells of a map of shares, or of words.

    Args:
        grid: The grid of the map.
        values: The value of each cell, shape (rows, columns); NaN where there is none.
        reason: Why a cell with enough members may have no value.
    """
    codes = np.zeros(len(grid.chosen), dtype=int)
    gaps, reasons = _gaps(grid, values, reason, codes)
    shown = _first(grid).reshape(grid.shape)
    return CellMembers(grid.counts.reshape(grid.shape), shown, FIRST, gaps, reasons)


def _first(grid: MapGrid) -> Array:
    """Return the lowest number of the members in each cell, row by row; -1 without a member."""
    shown = np.full(grid.shape[0] * grid.shape[1], -1)
    _set_first(shown, grid.cells, grid.chosen)
    return shown


def _set_first(result: Array, cells: Array, values: Array) -> None:
    """Set each cell of the result to the first of its values."""
    # Of several assignments to one place, the last one holds.
    result[cells[::-1]] = values[::-1]


def _gaps(
    grid: MapGrid, values: Array, missing: str, of_member: Array
) -> tuple[Array, tuple[str, ...]]:
    """Return why each cell has no value, as an index in the reasons, and the reasons.

    The reasons have the same place in all maps, so that they have the same tone.

    Args:
        grid: The grid of the map.
        values: The value of each cell, shape (rows, columns).
        missing: Why a member that completed may have no value.
        of_member: 0 for a member without a value that completed; from `FIRST_REASON` on, the
            outcome of one that did not; -1 where it has a value.
    """
    counts = grid.counts
    gaps = np.full(len(counts), -1)
    without = of_member >= 0
    _set_first(gaps, grid.cells[without], of_member[without])
    gaps[counts < grid.min_members] = 1
    gaps[np.isfinite(values.ravel()) | (counts == 0)] = -1
    few = f"fewer than {grid.min_members} members"
    return gaps.reshape(grid.shape), (missing, few, *OUTCOMES[LEFT_RANGE:])
