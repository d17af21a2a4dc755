"""Many starts at once: the minimum to which each of them is proved to converge, by its region."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rbstab.analysis.proof.boxes import Boxes, joined
from rbstab.analysis.proof.regions.downhill import SAME_POINT, Landscape, descent, stays_below
from rbstab.mechanics.numbers import Array

MAX_DEPTH = 7
"""Halvings of a cell along each axis: the smallest cells of the range of eq. 5 are some 3 degrees
wide."""

MARGINS = -1.07, 1.13
"""The first cell, relative to the end of the range. Its faces and those of all smaller cells are at
no round angles, at which many starts are."""


class RegionLevel(NamedTuple):
    """A minimum with a region: the index of the minimum in its landscape, and the level, J."""

    minimum: int
    level: float


class _Cell(NamedTuple):
    """What is known of a cell, or of any other box of Θ.

    Attributes:
        region: The index of the region of the minimum below its middle, by a descent; None if the
            descent ends elsewhere.
        inside: Whether all of the box is proved to be in this region.
    """

    region: int | None
    inside: bool


class StartRegions:
    """The regions of the minima of a landscape, for starts that are many.

    Cells of Θ, halved along all axes where that is needed, are proved to be in a region; so there
    is one proof for all starts in a cell. The cells do not depend on the starts. So what is proved
    of a start does not depend on the other starts.

    Args:
        landscape: The energy, the minima and the range.
        regions: The minima with a region.
    """

    def __init__(self, landscape: Landscape, regions: Sequence[RegionLevel]) -> None:
        self.landscape = landscape
        self.levels = np.array([region.level for region in regions])
        self._by_minimum = {region.minimum: k for k, region in enumerate(regions)}
        self._cells: dict[bytes, _Cell] = {}

    def find(self, energy: Array, low: Array, high: Array) -> Array:
        """Return the index of the region in which each start is proved to be, -1 if in none.

        Args:
            energy: Upper bounds of the total energy at each start, shape (m,), J.
            low: The lower corner of the box of Θ of each start, shape (m, 3), rad.
            high: The upper corner.
        """
        found = np.full(len(energy), -1)
        end = self.landscape.end
        inside = np.all((low >= -end) & (low <= high) & (high <= end), axis=1)
        rows = np.flatnonzero(inside & (energy < self.levels.max(initial=-np.inf)))
        root = Boxes(*(np.array([margin * end]) for margin in MARGINS))
        pending = [(root, rows, 0)] if len(rows) else []
        while pending:
            box, rows, depth = pending.pop()
            cell = self._cell(box)
            own = Boxes(low[rows], high[rows])
            if cell.inside:
                whole = own.within(box)
                self._assign(found, rows[whole], energy, cell)
                self._examine(found, rows[~whole], energy, low, high)
            elif depth < MAX_DEPTH:
                pending += [(part, some, depth + 1) for part, some in _parts(box, own, rows)]
            elif cell.region is not None:
                rows = rows[energy[rows] < self.levels[cell.region]]
                self._examine(found, rows, energy, low, high)
        return found

    def _examine(self, found: Array, rows: Array, energy: Array, low: Array, high: Array) -> None:
        """Examine starts one by one, by their own boxes."""
        for row in rows.tolist():
            cell = self._cell(Boxes(low[row : row + 1], high[row : row + 1]))
            if cell.inside:
                self._assign(found, np.array([row]), energy, cell)

    def _assign(self, found: Array, rows: Array, energy: Array, cell: _Cell) -> None:
        assert cell.region is not None
        found[rows[energy[rows] < self.levels[cell.region]]] = cell.region

    def _cell(self, box: Boxes) -> _Cell:
        box = self._within_stops(box)
        key = box.low.tobytes() + box.high.tobytes()
        if key not in self._cells:
            self._cells[key] = self._examined(box)
        return self._cells[key]

    def _within_stops(self, box: Boxes) -> Boxes:
        """Return the part of a box that can be reached: no start is beyond a stop."""
        guard = self.landscape.form.guard
        if guard is None or guard.stop is None:
            return box
        low, high = box.low.copy(), box.high.copy()
        low[:, 1], high[:, 1] = np.clip([low[:, 1], high[:, 1]], -guard.end, guard.end)
        return Boxes(low, high)

    @np.errstate(all="ignore")  # comparisons with NaN are false
    def _examined(self, box: Boxes) -> _Cell:
        """Descend from the middle of a box, and prove that the box is in the region reached.

        As in `Landscape.reached_minimum`: the box, and a chain of boxes from it to the minimum, lie
        below the level, so they lie in one component of {U < level}.
        """
        form, domain, minima = (getattr(self.landscape, k) for k in ("form", "domain", "minima"))
        vertices = descent(form, box.centre[0], domain)
        ends = [np.abs(vertices[-1] - minimum.centre[0]).max() for minimum in minima]
        reached = int(np.argmin(ends)) if ends else 0
        region = self._by_minimum.get(reached)
        if region is None or not ends[reached] <= SAME_POINT:
            return _Cell(None, inside=False)
        path = np.concatenate([vertices, minima[reached].centre])
        both_ends, level = joined([box, minima[reached]]), float(self.levels[region])
        return _Cell(region, stays_below(form, path, both_ends, level, domain))


def _parts(box: Boxes, own: Boxes, rows: Array) -> list[tuple[Boxes, Array]]:
    """Halve a cell along all axes; return the parts with a start in them, and these starts."""
    middle = box.centre[0]
    upper = own.centre >= middle
    found = []
    for code in np.unique(upper @ np.array([1, 2, 4])).tolist():
        side = np.array([code & 1, code & 2, code & 4], dtype=bool)
        low, high = np.where(side, middle, box.low[0]), np.where(side, box.high[0], middle)
        some = rows[np.all(upper == side, axis=1)]
        found.append((Boxes(low[np.newaxis], high[np.newaxis]), some))
    return found
