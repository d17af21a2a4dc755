"""Draw marks with matplotlib."""

from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize
from matplotlib.patches import Patch
from matplotlib.ticker import FormatStrFormatter, LogLocator

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import (
    Axis,
    Bars,
    Cells,
    Intervals,
    Level,
    Line,
    Mark,
    Panel,
    Points,
    Stack,
)
from rbstab.report.model.palette import COLOURS, SCALE, colour

DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1.2, 1.6)), (0, (6, 2, 1.2, 2)))
"""Solid, dashed, dotted, dash-dotted."""

SYMBOLS: tuple[dict[str, Any], ...] = (
    {"marker": "o", "markersize": 4.0},
    {"marker": "x", "markersize": 5.0, "markeredgewidth": 1.2},
    {"marker": "s", "markersize": 4.5, "markerfacecolor": "none"},
    {"marker": "D", "markersize": 4.5, "markerfacecolor": "none"},
    {"marker": "^", "markersize": 5.0, "markerfacecolor": "none"},
    {"marker": "v", "markersize": 5.0, "markerfacecolor": "none"},
    {"marker": "+", "markersize": 6.0, "markeredgewidth": 1.2},
)
"""Disc, cross, open square, open diamond, open triangles up and down, plus sign."""

MAX_VALUE = 1e150
"""Larger values are not drawn; axis limits would overflow."""

LEVEL: dict[str, Any] = {"color": "#555555", "linewidth": 0.9, "linestyle": (0, (4, 3))}

MIN_DECADE_RATIO = 200.0
"""If its ends have a smaller ratio, a logarithmic scale needs ticks between powers of ten."""

EMPTY = "#f4f4f4"
"""Colour of cells without a value."""


def _line(line: Line, axes: Axes, panel: Panel) -> dict[str, Artist]:
    x, y = _drawable(line.x, panel.x), _drawable(line.y, panel.y)
    # A curve of one point would be invisible without a marker.
    is_single = np.isfinite(x * 0 + y * 0).sum() == 1
    (curve,) = axes.plot(
        x,
        y,
        color=colour(line.colour),
        linestyle=DASHES[line.dash % len(DASHES)],
        drawstyle="steps-post" if line.step else "default",
        marker="o" if is_single else "",
        markersize=3.0,
    )
    return {line.label: curve}


def _points(points: Points, axes: Axes, panel: Panel) -> dict[str, Artist]:
    (points_line,) = axes.plot(
        _drawable(points.x, panel.x),
        _drawable(points.y, panel.y),
        color=colour(points.colour),
        linestyle="none",
        **SYMBOLS[points.symbol % len(SYMBOLS)],
    )
    return {points.label: points_line}


def _stack(stack: Stack, axes: Axes, panel: Panel) -> dict[str, Artist]:
    x = _drawable(stack.x, panel.x)
    parts = _drawable(stack.parts, Axis(""))
    handles: dict[str, Artist] = {}
    for half in (np.maximum, np.minimum):
        base = np.zeros(len(x))
        for number, label in enumerate(stack.labels):
            top = base + half(parts[:, number], 0.0)
            axes.fill_between(
                x, base, top, color=colour(number), alpha=0.75, linewidth=0.3, zorder=2
            )
            handles[label] = Patch(color=colour(number), alpha=0.75)
            base = top
    return handles


def _bars(bars: Bars, axes: Axes, _panel: Panel) -> dict[str, Artist]:
    patch = axes.stairs(
        bars.heights,
        bars.edges,
        fill=True,
        facecolor=mpl.colors.to_rgba(colour(bars.colour), 0.65),
        edgecolor=colour(bars.colour),
        linewidth=0.8,
        zorder=2,
    )
    return {bars.label: patch}


def _intervals(intervals: Intervals, axes: Axes, panel: Panel) -> dict[str, Artist]:
    x, y = _drawable(intervals.x, panel.x), _drawable(intervals.y, panel.y)
    low, high = _drawable(intervals.low, panel.y), _drawable(intervals.high, panel.y)
    tint = colour(intervals.colour)
    # If one end cannot be drawn (0 on a logarithmic axis), only the other half is drawn.
    axes.vlines(x, np.where(np.isnan(low), y, low), np.where(np.isnan(high), y, high), color=tint)
    for end in (low, high):
        axes.plot(x, end, color=tint, linestyle="none", marker="_", markersize=6)
    (middle,) = axes.plot(x, y, color=tint, linestyle="none", marker="o", markersize=4)
    return {intervals.label: middle}


def _cells(cells: Cells, axes: Axes, panel: Panel) -> dict[str, Artist]:
    values = np.ma.masked_invalid(_drawable(cells.values, cells.scale))
    words = cells.scale.categories
    tints = _tints(len(words))
    style: dict[str, Any] = (
        {
            "cmap": ListedColormap(tints),
            "norm": BoundaryNorm(np.arange(len(words) + 1) - 0.5, len(words)),
        }
        if words
        else {"cmap": SCALE, "norm": _norm(values, cells)}
    )
    axes.set_facecolor(EMPTY)
    axes.grid(visible=False)
    mesh = axes.pcolormesh(
        _edges(cells.x, panel.x), _edges(cells.y, panel.y), values, rasterized=True, **style
    )
    if not words:
        bar = axes.figure.colorbar(mesh, ax=axes, pad=0.02)
        if cells.scale.log:
            _set_log_ticks(bar)
        bar.set_label(cells.scale.text.replace("$", r"\$"))
    present = {int(value) for value in np.unique(values.compressed())}
    return {
        word: Patch(color=tint)
        for number, (word, tint) in enumerate(zip(words, tints, strict=True))
        if number in present
    }


def _set_log_ticks(bar: Colorbar) -> None:
    """Set ticks of a logarithmic scale that do not overlap; the default ticks would overlap."""
    bar.minorticks_off()
    low, high = bar.ax.get_ylim()
    if high < MIN_DECADE_RATIO * low:
        bar.locator, bar.formatter = LogLocator(subs=(1.0, 2.0, 5.0)), FormatStrFormatter("%g")
        bar.update_ticks()


def _norm(values: "np.ma.MaskedArray[Any, Any]", cells: Cells) -> Normalize:
    present, scale = values.compressed(), cells.scale
    low, high = (float(present.min()), float(present.max())) if len(present) else (1.0, 1.0)
    low, high = cells.span or (low, high)
    if low == high:
        # A single value gets the colour in the middle of the scale.
        low, high = (low / 2, high * 2) if scale.log else (low - 0.5, high + 0.5)
    return LogNorm(low, high) if scale.log else Normalize(low, high)


def _tints(count: int) -> Sequence[Any]:
    if count <= len(COLOURS):
        return COLOURS[:count]
    return [mpl.colormaps[SCALE](share) for share in np.linspace(0.0, 1.0, count)]


def _edges(centres: Array, axis: Axis) -> Array:
    """Return the edges of cells, halfway between their centres on the axis, shape (n + 1,)."""
    places = np.log10(centres) if axis.log else np.asarray(centres, dtype=float)
    if len(places) == 1:
        edges = np.array([places[0] - 0.5, places[0] + 0.5])
    else:
        between = (places[1:] + places[:-1]) / 2
        first, last = 2 * places[0] - between[0], 2 * places[-1] - between[-1]
        edges = np.concatenate([[first], between, [last]])
    return 10.0**edges if axis.log else edges


def _level(level: Level, axes: Axes, panel: Panel) -> dict[str, Artist]:
    axis = panel.x if level.vertical else panel.y
    if np.isnan(_drawable(np.array([level.value]), axis)[0]):
        return {}
    line = (axes.axvline if level.vertical else axes.axhline)(level.value, **LEVEL)
    return {level.label: line}


def _drawable(values: Array, axis: Axis) -> Array:
    """Replace values that an axis cannot show by NaN."""
    values = np.asarray(values, dtype=float)
    is_drawable = np.isfinite(values) & (
        np.abs(np.where(np.isnan(values), 0.0, values)) < MAX_VALUE
    )
    if axis.log:
        is_drawable &= values > 1.0 / MAX_VALUE
    return np.where(is_drawable, values, np.nan)


_DRAWERS: dict[type, Callable[[Any, Axes, Panel], dict[str, Artist]]] = {
    Line: _line,
    Points: _points,
    Stack: _stack,
    Bars: _bars,
    Intervals: _intervals,
    Cells: _cells,
    Level: _level,
}


def draw(mark: Mark, axes: Axes, panel: Panel) -> dict[str, Artist]:
    """Draw a mark; return its legend handles by label ("" for none)."""
    return _DRAWERS[type(mark)](mark, axes, panel)
