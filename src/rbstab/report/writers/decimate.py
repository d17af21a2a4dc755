"""Reduce the points of long curves without a visible change: no peak is cut, no gap is closed.

A curve with very many points is divided into a few hundred segments; each keeps its lowest and its
highest point. No point is moved, and the order does not change.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Figure, Line, Mark, Panel, Stack

MAX_POINTS = 800
"""Maximum number of points of a curve, gaps not counted: two for each dot of a printed panel."""

Indices = NDArray[np.intp]
"""Indices of points, ascending."""


def decimate(figure: Figure) -> Figure:
    """Return a figure whose lines and stacks have no more points than are visible."""
    panels = (
        replace(panel, marks=tuple(_decimated(mark, panel) for mark in panel.marks))
        for panel in figure.panels
    )
    return replace(figure, panels=tuple(panels))


def kept_points(x: Array, y: Array, max_points: int = MAX_POINTS) -> Indices:
    """Return the indices of the points of a curve to draw.

    They include the first, the last, the lowest and the highest point. A gap (a point that is not
    finite) stays a gap.

    Args:
        x: Shape (n,); NaN where nothing can be drawn.
        y: Shape (n,), likewise.
        max_points: Maximum number of points, gaps not counted.
    """
    if len(x) <= max_points:
        return np.arange(len(x))
    finite = np.isfinite(x) & np.isfinite(y)
    # Where x is ascending, only y can have an extreme inside a segment.
    outlines = [y] if (np.diff(x[finite]) >= 0).all() else [x, y]
    segments = np.array_split(np.arange(len(x)), max(max_points // (2 * len(outlines)), 1))
    kept = [np.array([0, len(x) - 1])]
    for segment in segments:
        inside = segment[finite[segment]]
        kept.append(segment[~finite[segment]][:1])
        if len(inside):
            kept += [
                inside[[values[inside].argmin(), values[inside].argmax()]] for values in outlines
            ]
    return np.unique(np.concatenate(kept))


def _decimated(mark: Mark, panel: Panel) -> Mark:
    if isinstance(mark, Line):
        x, y = _drawable(mark.x, panel.x), _drawable(mark.y, panel.y)
        kept = _step_changes(y) if mark.step else np.arange(len(y))
        kept = kept[kept_points(x[kept], y[kept])]
        return replace(mark, x=mark.x[kept], y=mark.y[kept])
    if isinstance(mark, Stack):
        x = _drawable(mark.x, panel.x)
        with np.errstate(over="ignore"):
            sums = [np.cumsum(half(mark.parts, 0.0), axis=1) for half in (np.maximum, np.minimum)]
        each = [kept_points(x, y) for total in sums for y in total.T]
        kept = np.unique(np.concatenate([np.zeros(0, dtype=np.intp), *each]))
        return replace(mark, x=mark.x[kept], parts=mark.parts[kept])
    return mark


def _drawable(values: Array, axis: Axis) -> Array:
    """Return values, with NaN where the axis cannot show them."""
    values = np.asarray(values, dtype=float)
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(values) & ((values > 0) | (not axis.log)), values, np.nan)


def _step_changes(y: Array) -> Indices:
    """Return the indices of the points where a step function changes, and of both ends."""
    same = (y[1:] == y[:-1]) | (np.isnan(y[1:]) & np.isnan(y[:-1]))
    needed = np.concatenate([[True], ~same])
    needed[-1] = True
    return np.flatnonzero(needed[: len(y)])
