"""Reduce the points of curves without a visible change: no peak is cut, no gap is closed.

There are two steps. First, a curve with very many points is divided into a few hundred segments;
each keeps its lowest and its highest point. Second, the algorithm of Douglas and Peucker (1973)
removes points that are closer than a small fraction of the panel to the line between their
neighbours. No point is moved, and the order does not change.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Figure, Line, Mark, Panel, Stack

MAX_POINTS = 800
"""Maximum number of points of a curve, gaps not counted: two for each dot of a printed panel."""

TOLERANCE = 1 / 4000
"""Fraction of a panel's width and height: a quarter of a dot, and one dot after a zoom by 4."""

Indices = NDArray[np.intp]
"""Indices of points, ascending."""


def decimate(
    figure: Figure, *, max_points: int = MAX_POINTS, tolerance: float = TOLERANCE
) -> Figure:
    """Return a figure whose lines and stacks have no more points than are visible.

    Args:
        figure: The figure.
        max_points: Maximum number of points of a curve.
        tolerance: Maximum distance of a removed point from the drawn curve, as a fraction of the
            panel.
    """
    return replace(
        figure,
        panels=tuple(_decimate_panel(panel, max_points, tolerance) for panel in figure.panels),
    )


def kept_points(
    x: Array, y: Array, *, max_points: int = MAX_POINTS, tolerance: Array | None = None
) -> Indices:
    """Return the indices of the points of a curve to draw.

    They include the first, the last, the lowest and the highest point. A gap (a point
    that is not finite) stays a gap.

    Args:
        x: Shape (n,), in axis coordinates: the logarithm on a logarithmic axis.
        y: Shape (n,), likewise.
        max_points: As in `decimate`.
        tolerance: The invisible distances in x and in y, shape (2,); None: no tolerance.
    """
    kept = _extremes(x, y, max_points) if len(x) > max_points else np.arange(len(x))
    if tolerance is None:
        return kept
    (visible,) = visible_points([np.column_stack([x, y])[kept]], tolerance)
    return kept[visible]


def visible_points(curves: Sequence[Array], tolerance: Array) -> list[Indices]:
    """Return the indices of the points of each curve whose removal would change it visibly.

    Many short curves together take a small part of the time that they take one after the other.

    Args:
        curves: Points in axis coordinates, shape (n, 2) each.
        tolerance: As in `kept_points`.
    """
    if not curves:
        return []
    lengths = np.array([len(curve) for curve in curves])
    with np.errstate(all="ignore"):
        points = np.concatenate(curves) / np.where(tolerance > 0, tolerance, np.inf)
    needed = np.split(_needed_points(points, lengths[lengths > 0]), np.cumsum(lengths)[:-1])
    return [np.flatnonzero(mask) for mask in needed]


def _decimate_panel(panel: Panel, max_points: int, tolerance: float) -> Panel:
    curves = [mark for mark in panel.marks if isinstance(mark, Line | Stack)]
    if not curves:
        return panel
    spans = np.array(
        [
            _span([_axis_coordinates(curve.x, panel.x) for curve in curves]),
            _span([bound for curve in curves for bound in _outlines(curve, panel.y)]),
        ]
    )
    lines = [mark for mark in panel.marks if isinstance(mark, Line) and not mark.step]
    decimated = iter(_decimate_lines(lines, panel, max_points, tolerance * spans))
    marks = (
        next(decimated)
        if isinstance(mark, Line) and not mark.step
        else _decimate_mark(mark, panel, max_points, tolerance * spans)
        for mark in panel.marks
    )
    return replace(panel, marks=tuple(marks))


def _decimate_lines(
    lines: Sequence[Line], panel: Panel, max_points: int, tolerance: Array
) -> list[Line]:
    curves = [
        np.column_stack([_axis_coordinates(line.x, panel.x), _axis_coordinates(line.y, panel.y)])
        for line in lines
    ]
    kept = [kept_points(*curve.T, max_points=max_points) for curve in curves]
    visible = visible_points([c[k] for c, k in zip(curves, kept, strict=True)], tolerance)
    chosen = (k[v] for k, v in zip(kept, visible, strict=True))
    return [replace(m, x=m.x[k], y=m.y[k]) for m, k in zip(lines, chosen, strict=True)]


def _decimate_mark(mark: Mark, panel: Panel, max_points: int, tolerance: Array) -> Mark:
    """Return a mark that is no line, or a line in steps, with the points that it needs."""
    if isinstance(mark, Line):
        # Steps have no straight line between points, so Douglas and Peucker does not apply.
        x, y = _axis_coordinates(mark.x, panel.x), _axis_coordinates(mark.y, panel.y)
        kept = kept_points(x, y, max_points=max_points)
        kept = kept[_step_changes(y[kept])]
        return replace(mark, x=mark.x[kept], y=mark.y[kept])
    if isinstance(mark, Stack):
        x, outlines = _axis_coordinates(mark.x, panel.x), _outlines(mark, panel.y)
        each = [kept_points(x, y, max_points=max_points, tolerance=tolerance) for y in outlines]
        kept = np.unique(np.concatenate(each)) if each else np.arange(len(x))
        return replace(mark, x=mark.x[kept], parts=mark.parts[kept])
    return mark


def _outlines(curve: Line | Stack, axis: Axis) -> list[Array]:
    """Return the outlines of a curve; for a stack, its cumulative sums upwards and downwards."""
    if isinstance(curve, Line):
        return [_axis_coordinates(curve.y, axis)]
    with np.errstate(over="ignore"):
        sums = [np.cumsum(half(curve.parts, 0.0), axis=1) for half in (np.maximum, np.minimum)]
    return [_axis_coordinates(column, axis) for total in sums for column in total.T]


def _axis_coordinates(values: Array, axis: Axis) -> Array:
    """Return the axis coordinates of values: logarithms on a logarithmic axis; NaN if not drawn."""
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


def _extremes(x: Array, y: Array, max_points: int) -> Indices:
    """Return the indices of the extreme points of each segment, and of one point of its gaps."""
    finite = np.isfinite(x) & np.isfinite(y)
    # Where x is ascending, only y can have an extreme inside a segment.
    outlines = [y] if (np.diff(x[finite]) >= 0).all() else [x, y]
    segments = np.array_split(np.arange(len(x)), max(max_points // (2 * len(outlines)), 1))
    found = [np.array([0, len(x) - 1])]
    for segment in segments:
        inside = segment[finite[segment]]
        found.append(segment[~finite[segment]][:1])
        if len(inside):
            found += [
                inside[[values[inside].argmin(), values[inside].argmax()]] for values in outlines
            ]
    return np.unique(np.concatenate(found))


def _step_changes(y: Array) -> Indices:
    """Return the indices of the points where a step function changes, and of both ends."""
    same = (y[1:] == y[:-1]) | (np.isnan(y[1:]) & np.isnan(y[:-1]))
    needed = np.concatenate([[True], ~same])
    needed[-1] = True
    return np.flatnonzero(needed[: len(y)])


def _needed_points(points: Array, lengths: Indices) -> NDArray[np.bool_]:
    """Return the mask of the points that curves need, shape (n,).

    Args:
        points: The points of all curves, one after the other, in units of the tolerance; shape
            (n, 2).
        lengths: The number of points of each curve, at least 1.
    """
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(points).all(axis=1))
    is_first, is_last = np.zeros((2, len(points)), dtype=bool)
    is_last[np.cumsum(lengths) - 1] = is_first[np.cumsum(lengths) - lengths] = True
    gap_before, gap_after = is_first.copy(), is_last.copy()
    gap_before[1:] |= ~finite[:-1]
    gap_after[:-1] |= ~finite[1:]
    # One point is enough for a gap of several points.
    needed = is_first | is_last
    needed[1:] |= ~finite[1:] & finite[:-1]
    firsts, lasts = np.flatnonzero(finite & gap_before), np.flatnonzero(finite & gap_after)
    needed[firsts] = needed[lasts] = True
    for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True):
        heights = points[first : last + 1, 1]
        needed[[first + heights.argmin(), first + heights.argmax()]] = True
    return _douglas_peucker(points, needed, np.flatnonzero(finite & ~needed))


def _douglas_peucker(
    points: Array, needed: NDArray[np.bool_], inside: Indices
) -> NDArray[np.bool_]:
    """Return the mask of the needed points, shape (n,).

    In each pass, all spans between needed points are divided where they are too far from a straight
    line.

    Args:
        points: Shape (n, 2), in units of the tolerance.
        needed: The points that are needed in any case, among them both ends of each curve.
        inside: The indices of the others; a gap has none.
    """
    while len(inside):
        ends = np.flatnonzero(needed)
        # The number of the needed point at the end of the span of each point.
        span = np.searchsorted(ends, inside)
        distance = _distances(points[inside], points[ends[span - 1]], points[ends[span]])
        first = _first_of_each(span)
        farthest = np.zeros(len(ends))
        farthest[span[first]] = np.maximum.reduceat(distance, first)
        is_open = farthest[span] > 1.0
        # Of points that are equally far, the first.
        most = np.flatnonzero(is_open & (distance == farthest[span]))
        middle = most[_first_of_each(span[most])]
        needed[inside[middle]], is_open[middle] = True, False
        inside = inside[is_open]
    return needed


def _first_of_each(numbers: Indices) -> Indices:
    """Return the index of the first of each run of equal numbers."""
    changes = np.flatnonzero(numbers[1:] != numbers[:-1]) + 1
    return np.concatenate([np.zeros(min(len(numbers), 1), dtype=np.intp), changes])


def _distances(points: Array, starts: Array, ends: Array) -> Array:
    """Return the distance of each point from a line segment of its own, shape (n,)."""
    along, offset = ends - starts, points - starts
    length = (along * along).sum(axis=1)
    share = (offset * along).sum(axis=1) / np.where(length > 0, length, np.inf)
    nearest = np.clip(share, 0.0, 1.0)[:, np.newaxis] * along
    return np.hypot(*(offset - nearest).T)
