"""Numbers of members brought into the cells of a map."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from contourpy import contour_generator
from scipy import ndimage

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Cells, Line
from rbstab.report.sweeps.members import ENDS, SETTLED, Members
from rbstab.report.sweeps.parameters import Cut
from rbstab.report.sweeps.quantities import Quantity

MIN_MEMBERS = 5
"""Members in a cell of drawn values below which it stays empty: they would say little."""


class Area(NamedTuple):
    """Two axes in cells, and the members that are in them.

    chosen are the numbers of these members, in ascending order; cells the cell of each, counted
    row by row.
    """

    x: Cut
    y: Cut
    chosen: Array
    cells: Array

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.y.middles), len(self.x.middles)

    @property
    def counts(self) -> Array:
        """Members in each cell, counted row by row."""
        return np.bincount(self.cells, minlength=self.shape[0] * self.shape[1])

    @property
    def is_single(self) -> bool:
        """Whether no cell has more than one member."""
        return int(self.counts.max(initial=0)) <= 1

    @property
    def fewest(self) -> int:
        """How many members a cell needs to be filled."""
        return MIN_MEMBERS if self.x.drawn or self.y.drawn else 1


def area_of(x: Cut, y: Cut, chosen: Array | None = None) -> Area:
    """The area of two axes, with all members or with those that are chosen (their numbers)."""
    chosen = np.arange(len(x.places)) if chosen is None else chosen
    cells = y.places[chosen] * len(x.middles) + x.places[chosen]
    return Area(x, y, chosen, cells)


def medians(area: Area, values: Array) -> Array:
    """The median of the finite numbers in each cell, shape (rows, columns); NaN: too few."""
    own = values[area.chosen]
    finite = np.isfinite(own)
    cells, own = area.cells[finite], own[finite]
    size = area.shape[0] * area.shape[1]
    counts, found = np.bincount(cells, minlength=size), np.full(size, np.nan)
    if counts.max(initial=0) <= 1:
        found[cells] = own
    else:
        filled = np.flatnonzero(counts >= area.fewest)
        found[filled] = ndimage.median(own, cells, filled)
    return found.reshape(area.shape)


def shares(area: Area, yes: Array) -> Array:
    """The share of the members of each cell that fulfil something; NaN where there are too few."""
    counts = area.counts
    filled = np.bincount(area.cells, weights=yes[area.chosen], minlength=len(counts))
    with np.errstate(all="ignore"):
        found = np.where(counts >= area.fewest, filled / counts, np.nan)
    return found.reshape(area.shape)


def quantity_cells(area: Area, quantity: Quantity) -> Cells:
    """A map of the medians of a quantity; of single members, of the quantity itself."""
    return _cells(area, medians(area, quantity.values), quantity.axis)


def event(members: Members) -> tuple[str, Array]:
    """What a share of members is counted of: that they settled, or else that they completed."""
    settled = members.ends == ENDS.index(SETTLED)
    return (SETTLED, settled) if settled.any() else ("completed", members.completed)


def end_cells(members: Members, area: Area) -> Cells:
    """A map of how members end; where cells have several, of a share of them (`event`)."""
    if not area.is_single:
        label, yes = event(members)
        return replace(_cells(area, shares(area, yes), Axis(f"share {label}")), span=(0.0, 1.0))
    occurring = np.flatnonzero(members.counts)
    places = np.searchsorted(occurring, members.ends).astype(float)
    words = tuple(ENDS[code] for code in occurring.tolist())
    return _cells(area, medians(area, places), Axis("outcome", words=words))


def outline(area: Area, values: Array, level: float, label: str) -> Line | None:
    """The curve on which a quantity has some value; None where it has not.

    Args:
        area: The map.
        values: The quantity, shape (n,).
        level: The value.
        label: Of the curve.
    """
    z = medians(area, values)
    if min(z.shape) < 2:
        return None
    lines = contour_generator(area.x.middles, area.y.middles, np.ma.masked_invalid(z)).lines(level)
    if not lines:
        return None
    gap = np.full((1, 2), np.nan)
    points = np.concatenate([part for line in lines for part in (np.asarray(line), gap)])[:-1]
    return Line(points[:, 0], points[:, 1], label=label, colour=1)


def _cells(area: Area, values: Array, scale: Axis) -> Cells:
    return Cells(area.x.middles, area.y.middles, values, scale)
