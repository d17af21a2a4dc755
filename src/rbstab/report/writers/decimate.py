"""Curves with fewer points that look the same: no peak is cut, no gap is closed.

First, of very many points, each of a few hundred short stretches keeps its lowest and highest one.
Then points are left out that lie on the line between those around them, to a small part of the
panel (Douglas and Peucker, 1973). What is left are points of the curve itself, in their order.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Figure, Line, Mark, Panel, Stack

MAX_SHOWN = 800
"""Points of a curve at most, give or take its gaps: two for each dot of a printed panel."""

TOLERANCE = 1 / 4000
"""Of the width and height of a panel: a quarter of a dot, and a dot where a page zooms in by 4."""

Kept = NDArray[np.intp]
"""Which points are kept, ascending."""


def decimated(figure: Figure, *, most: int = MAX_SHOWN, tolerance: float = TOLERANCE) -> Figure:
    """A figure whose lines and stacks have no more points than can be told apart.

    Args:
        figure: The figure.
        most: Of how many points at most a curve consists.
        tolerance: How far a point that is left out may lie from the curve that is drawn, as a part
            of the panel.
    """
    return replace(
        figure, panels=tuple(_decimated_panel(panel, most, tolerance) for panel in figure.panels)
    )


def kept_points(
    x: Array, y: Array, *, most: int = MAX_SHOWN, tolerance: Array | None = None
) -> Kept:
    """Which points of a curve are to be drawn.

    The first and the last point are, and the lowest and the highest one. A gap (a point that is not
    finite) stays a gap.

    Args:
        x: Shape (n,), as it is seen: its logarithm on such an axis.
        y: Shape (n,), likewise.
        most: As in `decimated`.
        tolerance: The distances in x and in y that cannot be seen, shape (2,); None: none.
    """
    kept = _extremes(x, y, most) if len(x) > most else np.arange(len(x))
    if tolerance is None:
        return kept
    with np.errstate(all="ignore"):
        points = np.column_stack([x, y])[kept] / np.where(tolerance > 0, tolerance, np.inf)
    return kept[_needed(points)]


def _decimated_panel(panel: Panel, most: int, tolerance: float) -> Panel:
    curves = [mark for mark in panel.marks if isinstance(mark, Line | Stack)]
    if not curves:
        return panel
    spans = np.array(
        [
            _span([_seen(curve.x, panel.x) for curve in curves]),
            _span([bound for curve in curves for bound in _bounds(curve, panel.y)]),
        ]
    )
    marks = tuple(_decimated_mark(mark, panel, most, tolerance * spans) for mark in panel.marks)
    return replace(panel, marks=marks)


def _decimated_mark(mark: Mark, panel: Panel, most: int, tolerance: Array) -> Mark:
    if isinstance(mark, Line):
        x, y = _seen(mark.x, panel.x), _seen(mark.y, panel.y)
        # Between two points of a step there is no straight line on which a third could lie.
        kept = kept_points(x, y, most=most, tolerance=None if mark.step else tolerance)
        kept = kept[_changes(y[kept])] if mark.step else kept
        return replace(mark, x=mark.x[kept], y=mark.y[kept])
    if isinstance(mark, Stack):
        x, bounds = _seen(mark.x, panel.x), _bounds(mark, panel.y)
        each = [kept_points(x, y, most=most, tolerance=tolerance) for y in bounds]
        kept = np.unique(np.concatenate(each)) if each else np.arange(len(x))
        return replace(mark, x=mark.x[kept], parts=mark.parts[kept])
    return mark


def _bounds(curve: Line | Stack, axis: Axis) -> list[Array]:
    """The curves that bound what is drawn: of a stack, the sums upwards and downwards."""
    if isinstance(curve, Line):
        return [_seen(curve.y, axis)]
    with np.errstate(over="ignore"):
        sums = [np.cumsum(half(curve.parts, 0.0), axis=1) for half in (np.maximum, np.minimum)]
    return [_seen(column, axis) for total in sums for column in total.T]


def _seen(values: Array, axis: Axis) -> Array:
    """Where values stand on an axis; NaN where they are not drawn."""
    values = np.asarray(values, dtype=float)
    if axis.log:
        shown = np.isfinite(values) & (values > 0)
        return np.log10(np.where(shown, values, np.nan))
    return np.where(np.isfinite(values), values, np.nan)


def _span(curves: list[Array]) -> float:
    values = np.concatenate(curves)
    values = values[np.isfinite(values)]
    with np.errstate(over="ignore"):
        return float(np.ptp(values)) if len(values) else 0.0


def _extremes(x: Array, y: Array, most: int) -> Kept:
    """Of each short stretch the points that are outermost, and one of its gaps."""
    finite = np.isfinite(x) & np.isfinite(y)
    # Along an ascending x only y can have an extreme inside a stretch.
    outlines = [y] if (np.diff(x[finite]) >= 0).all() else [x, y]
    stretches = np.array_split(np.arange(len(x)), max(most // (2 * len(outlines)), 1))
    found = [np.array([0, len(x) - 1])]
    for stretch in stretches:
        inside = stretch[finite[stretch]]
        found.append(stretch[~finite[stretch]][:1])
        if len(inside):
            found += [
                inside[[values[inside].argmin(), values[inside].argmax()]] for values in outlines
            ]
    return np.unique(np.concatenate(found))


def _changes(y: Array) -> Kept:
    """The points of a step at which its value changes, with the first and the last."""
    same = (y[1:] == y[:-1]) | (np.isnan(y[1:]) & np.isnan(y[:-1]))
    needed = np.concatenate([[True], ~same])
    needed[-1] = True
    return np.flatnonzero(needed[: len(y)])


def _needed(points: Array) -> Kept:
    """The points without which a curve would change by more than 1.

    Args:
        points: Shape (n, 2), in tolerances.
    """
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(points).all(axis=1))
    needed = ~finite
    # Of neighbouring gaps one is enough.
    needed[1:] &= finite[:-1]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], finite, [False]]).astype(int)))
    for first, behind in edges.reshape(-1, 2):
        needed[first:behind] |= _cornered(points[first:behind])
    needed[:1] = needed[-1:] = True
    return np.flatnonzero(needed)


def _cornered(points: Array) -> NDArray[np.bool_]:
    """The corners of a curve without gaps, shape (n,)."""
    corner = np.zeros(len(points), dtype=bool)
    fixed = {0, len(points) - 1, int(points[:, 1].argmin()), int(points[:, 1].argmax())}
    order = sorted(fixed)
    corner[order] = True
    open_spans = list(pairwise(order))
    while open_spans:
        first, last = open_spans.pop()
        if last - first < 2:
            continue
        distance = _distances(points[first + 1 : last], points[first], points[last])
        farthest = int(distance.argmax())
        if distance[farthest] > 1.0:
            middle = first + 1 + farthest
            corner[middle] = True
            open_spans += [(first, middle), (middle, last)]
    return corner


def _distances(points: Array, start: Array, end: Array) -> Array:
    """How far points are from a straight piece, shape (n,)."""
    along = end - start
    length = float(along @ along)
    offset = points - start
    share = np.clip(offset @ along / length, 0.0, 1.0) if length > 0 else np.zeros(len(points))
    return np.hypot(*(offset - share[:, np.newaxis] * along).T)
