"""Values of the cells of a map, computed from members."""

from dataclasses import replace

import numpy as np
from contourpy import contour_generator

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Cells, Line
from rbstab.report.sweeps.basins import Basins
from rbstab.report.sweeps.maps.cell_grid import MapGrid
from rbstab.report.sweeps.maps.cell_members import quantity_members, share_members
from rbstab.report.sweeps.maps.grouped import Grouped
from rbstab.report.sweeps.members import OUTCOME_COLOURS, OUTCOMES, RETURNS, Members
from rbstab.report.sweeps.proofs import proof_codes, proved_shares
from rbstab.report.sweeps.quantities import MemberQuantity

NOT_TRIED = "no proof of the bodies"
"""Why a cell has no share of proved members."""


def medians(grid: MapGrid, values: Array) -> Array:
    """Return the median of the finite values in each cell, shape (rows, columns).

    A cell with too few members is NaN.
    """
    own = values[grid.chosen]
    finite = np.isfinite(own)
    cells, own = grid.cells[finite], own[finite]
    size = grid.shape[0] * grid.shape[1]
    if grid.is_single:
        result = np.full(size, np.nan)
        result[cells] = own
    else:
        result = Grouped(cells, size).medians(own, grid.min_members)
    return result.reshape(grid.shape)


def shares(grid: MapGrid, fulfilled: Array) -> Array:
    """Return the share of members with some property in each cell, shape (rows, columns).

    A member whose property is NaN does not count. A cell with too few members is NaN.
    """
    own = fulfilled[grid.chosen].astype(float)
    known = np.isfinite(own)
    size = grid.shape[0] * grid.shape[1]
    counts = np.bincount(grid.cells[known], minlength=size)
    positive = np.bincount(grid.cells[known], weights=own[known], minlength=size)
    with np.errstate(all="ignore"):
        result = np.where(counts >= grid.min_members, positive / counts, np.nan)
    return result.reshape(grid.shape)


def quantity_cells(members: Members, grid: MapGrid, quantity: MemberQuantity) -> Cells:
    """Return a map of the median of a quantity in each cell; one member is its own median."""
    values = medians(grid, quantity.values)
    found = quantity_members(members, grid, quantity, values)
    return Cells(grid.x.middles, grid.y.middles, values, quantity.axis, members=found)


def counted_outcome(members: Members) -> tuple[str, Array]:
    """Return the outcome whose share is mapped, the first that occurs, and who has it."""
    code = RETURNS if members.outcome_counts[RETURNS] else int(members.outcomes.min())
    return OUTCOMES[code], members.outcomes == code


def outcome_cells(members: Members, grid: MapGrid) -> Cells:
    """Return a map of outcomes.

    If a cell has more than one member, the map shows the share of `counted_outcome` in each cell.
    """
    if not grid.is_single:
        label, fulfilled = counted_outcome(members)
        return replace(
            _cells(grid, shares(grid, fulfilled), Axis(f"share: {label}")), span=(0.0, 1.0)
        )
    occurring = np.flatnonzero(members.outcome_counts)
    indices = np.searchsorted(occurring, members.outcomes).astype(float)
    words = tuple(OUTCOMES[code] for code in occurring.tolist())
    colours = tuple(OUTCOME_COLOURS[code] for code in occurring.tolist())
    return _cells(grid, medians(grid, indices), Axis("outcome", categories=words, colours=colours))


def basin_cells(basins: Basins, grid: MapGrid) -> Cells:
    """Return a map of the rest states that members approach.

    If a cell has more than one member, the map shows the share of those that approach the lowest
    rest state.
    """
    if not grid.is_single:
        scale = Axis("share that approaches rest state 1")
        return replace(_cells(grid, shares(grid, basins.codes == 0), scale), span=(0.0, 1.0))
    codes = np.where(basins.codes < 0, np.nan, basins.codes)
    scale = Axis("approaches", categories=basins.labels)
    return _cells(grid, medians(grid, codes), scale, "no rest state was found")


def proof_cells(members: Members, grid: MapGrid) -> Cells:
    """Return a map of what is proved of the members.

    If a cell has more than one member, the map shows the share of those that are proved to
    converge, of those whose body has a proof.
    """
    if not grid.is_single:
        found_shares = shares(grid, proved_shares(members))
        scale = Axis("share proved to converge")
        return replace(_cells(grid, found_shares, scale, NOT_TRIED), span=(0.0, 1.0))
    found = proof_codes(members)
    scale = Axis("convergence of the exact motion", categories=found.labels, colours=found.colours)
    return _cells(grid, medians(grid, found.codes.astype(float)), scale)


def contour_line(grid: MapGrid, values: Array, level: float, label: str) -> Line | None:
    """Return the contour line of a quantity at one level; None if there is none.

    Args:
        grid: The grid of the map.
        values: The values of the quantity, shape (n,).
        level: The value of the quantity on the contour line.
        label: The label of the line.
    """
    z = medians(grid, values)
    if min(z.shape) < 2:
        return None
    lines = contour_generator(grid.x.middles, grid.y.middles, np.ma.masked_invalid(z)).lines(level)
    if not lines:
        return None
    gap = np.full((1, 2), np.nan)
    points = np.concatenate([part for line in lines for part in (np.asarray(line), gap)])[:-1]
    return Line(points[:, 0], points[:, 1], label=label, cased=True)


def _cells(grid: MapGrid, values: Array, scale: Axis, missing: str = "no value") -> Cells:
    """Return a map of shares or words; missing is why a cell of members may have no value."""
    found = share_members(grid, values, missing)
    return Cells(grid.x.middles, grid.y.middles, values, scale, members=found)
