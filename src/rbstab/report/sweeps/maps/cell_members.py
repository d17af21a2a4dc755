"""The members in the cells of a map: which one stands for a cell, and why a cell has no value."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import CellMembers
from rbstab.report.sweeps.maps.cell_grid import MapGrid
from rbstab.report.sweeps.members import OUTCOMES, Members
from rbstab.report.sweeps.quantities import MemberQuantity

NEAREST, FIRST = "nearest to the median", "the first of them"
"""What the member is that stands for a cell of several: for medians, and for shares."""


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
    with np.errstate(invalid="ignore"):
        distance = np.abs(own[finite] - values.ravel()[cells])
    # The nearest member of each cell comes first; of several, the one with the lowest number.
    order = np.lexsort((numbers, distance, cells))
    occupied, first = np.unique(cells[order], return_index=True)
    shown[occupied] = numbers[order][first]
    outcomes = members.outcomes[grid.chosen]
    # A member that did not complete has no value for that reason, another one for the quantity's.
    codes = np.where(outcomes > 1, outcomes, len(OUTCOMES))
    reasons = (*OUTCOMES, quantity.missing)
    gaps = _gaps(grid, values, reasons, np.where(finite, -1, codes))
    return CellMembers(grid.counts.reshape(grid.shape), shown.reshape(grid.shape), NEAREST, *gaps)


def share_members(grid: MapGrid, values: Array, reason: str = "no value") -> CellMembers:
    """Return the members in the cells of a map of shares, or of words.

    Args:
        grid: The grid of the map.
        values: The value of each cell, shape (rows, columns); NaN where there is none.
        reason: Why a cell with enough members may have no value.
    """
    codes = np.zeros(len(grid.chosen), dtype=int)
    gaps = _gaps(grid, values, (reason,), codes)
    shown = _first(grid).reshape(grid.shape)
    return CellMembers(grid.counts.reshape(grid.shape), shown, FIRST, *gaps)


def _first(grid: MapGrid) -> Array:
    """Return the lowest number of the members in each cell, row by row; -1 without a member."""
    shown = np.full(grid.shape[0] * grid.shape[1], -1)
    occupied, first = np.unique(grid.cells, return_index=True)
    shown[occupied] = grid.chosen[first]
    return shown


def _gaps(
    grid: MapGrid, values: Array, reasons: tuple[str, ...], of_member: Array
) -> tuple[Array, tuple[str, ...]]:
    """Return why each cell has no value, as an index in the reasons that occur, and these reasons.

    Args:
        grid: The grid of the map.
        values: The value of each cell, shape (rows, columns).
        reasons: The reasons of members.
        of_member: The reason of each chosen member; -1 where it has a value.
    """
    counts = grid.counts
    gaps = np.full(len(counts), -1)
    missing = of_member >= 0
    occupied, first = np.unique(grid.cells[missing], return_index=True)
    gaps[occupied] = of_member[missing][first]
    gaps[counts < grid.min_members] = len(reasons)
    words = (*reasons, f"fewer than {grid.min_members} members")
    gaps[np.isfinite(values.ravel()) | (counts == 0)] = -1
    occurring = np.unique(gaps[gaps >= 0])
    gaps = np.where(gaps < 0, -1, np.searchsorted(occurring, gaps))
    return gaps.reshape(grid.shape), tuple(words[k] for k in occurring.tolist())
