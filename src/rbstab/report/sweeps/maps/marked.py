"""Marks on a map: its extremes, and members as points with the texts that a pointer shows."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Cells, Points
from rbstab.report.model.words import number
from rbstab.report.sweeps.maps.cell_grid import MapGrid
from rbstab.report.sweeps.members import FAILED as FAILED_CODE
from rbstab.report.sweeps.members import Members

SMALLEST, LARGEST = "smallest value", "largest value"

ROUND_OFF = 1e-9
"""Values that differ by less than this fraction of the range of a map are the same."""

EXTREME_COLOUR, SQUARE, DIAMOND = 1, 2, 3
"""Red-orange open symbols: the colour map has neither that colour nor lines."""


def extremes(cells: Cells, x: Axis, y: Axis) -> list[Points]:
    """Return points at the smallest and the largest value of a map of numbers.

    An extreme that several cells share is not marked: a mark would single out one of them.

    Args:
        cells: The map; without different values nothing is marked.
        x: The horizontal axis.
        y: The vertical axis.
    """
    if cells.scale.categories or cells.members is None or not np.isfinite(cells.values).any():
        return []
    low, high = int(np.nanargmin(cells.values)), int(np.nanargmax(cells.values))
    alike = ROUND_OFF * (cells.values.flat[high] - cells.values.flat[low])
    if alike == 0:
        return []
    found = []
    for word, symbol, place in ((SMALLEST, SQUARE, low), (LARGEST, DIAMOND, high)):
        if np.count_nonzero(np.abs(cells.values - cells.values.flat[place]) <= alike) > 1:
            continue
        row, column = np.unravel_index(place, cells.values.shape)
        at = float(cells.x[column]), float(cells.y[row])
        value = value_text(cells.scale, float(cells.values[row, column]))
        shown = int(cells.members.shown[row, column])
        text = point_text(f"{word}: {value}", x, y, at, shown)
        x_, y_ = np.array([at[0]]), np.array([at[1]])
        found.append(Points(x_, y_, word, EXTREME_COLOUR, symbol, (text,), (shown,)))
    return found


MOST_FAILED = 50
"""More members that failed are seen without marks."""

FAILED, FAILED_TINT, CROSS = "failed", -7, 1
"""Purple crosses: neither a map nor its other marks have them."""


def failed_points(members: Members, grid: MapGrid) -> list[Points]:
    """Return crosses on the cells of a few members that failed; a cell may be a pixel."""
    failed = members.outcomes[grid.chosen] == FAILED_CODE
    if not 0 < np.count_nonzero(failed) <= MOST_FAILED:
        return []
    rows, columns = np.divmod(np.unique(grid.cells[failed]), grid.shape[1])
    x, y = np.asarray(grid.x.middles)[columns], np.asarray(grid.y.middles)[rows]
    return [Points(x, y, FAILED, FAILED_TINT, CROSS)]


def member_points(
    numbers: Array,
    x: tuple[Axis, Array],
    y: tuple[Axis, Array],
    word: str,
    colour_and_symbol: tuple[int, int],
) -> Points:
    """Return members as points over two parameters.

    Args:
        numbers: The numbers of the members, shape (n,).
        x: The horizontal axis, and the value of every member of the sweep.
        y: The vertical axis, likewise.
        word: What they have in common, the name of the points.
        colour_and_symbol: The numbers of their colour and of their symbol.
    """
    colour, symbol = colour_and_symbol
    across, up = (values[numbers].astype(float) for _, values in (x, y))
    places = zip(across.tolist(), up.tolist(), numbers.tolist(), strict=True)
    texts = tuple(point_text(word, x[0], y[0], (a, b), k) for a, b, k in places)
    return Points(across, up, word, colour, symbol, texts, tuple(numbers.tolist()))


def point_text(first: str, x: Axis, y: Axis, at: tuple[float, float], member: int) -> str:
    """Return the text of a point of a map: what it is, both parameters, and the member."""
    lines = [first, *(f"{a.label} = {value_text(a, v)}" for a, v in zip((x, y), at, strict=True))]
    return "\n".join([*lines, f"member {member}"])


def value_text(axis: Axis, value: float) -> str:
    """Return a value on an axis with its unit, or its category."""
    if axis.categories:
        return axis.categories[round(value)]
    return number(value) if axis.unit in ("", "1") else f"{number(value)} {axis.unit}"
