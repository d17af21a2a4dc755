"""Draw marks with matplotlib."""

from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import (
    BoundaryNorm,
    LinearSegmentedColormap,
    ListedColormap,
    LogNorm,
    Normalize,
)
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from rbstab.files.counts import grouped
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import (
    Axis,
    Band,
    Bars,
    Cells,
    Intervals,
    Level,
    Line,
    Mark,
    Panel,
    Points,
    Shares,
    Stack,
)
from rbstab.report.model.palette import (
    CASED,
    CASING,
    CASING_WIDTH,
    COLOURS,
    GREY,
    SCALE,
    area_colour,
    colour,
    contrast,
    gap_opacity,
)
from rbstab.report.writers.colour_scale import (
    bar_title,
    cell_edges,
    diverges,
    diverging_colours,
    gap_label,
    scale_ends,
    scale_ticks,
)

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

LINE_ORDER = 2.0
"""Order of drawing of a curve in front: that of matplotlib."""

COUNT_WIDTH = 0.017
"""Width of a digit of a count in a bar, as a share of the width of the panel."""

EMPTY = "#f4f4f4"
"""Colour of cells without a value."""


def _line(line: Line, axes: Axes, panel: Panel) -> dict[str, Artist]:
    x, y = _drawable(line.x, panel.x), _drawable(line.y, panel.y)
    # A curve of one point would be invisible without a marker.
    drawn = np.isfinite(x * 0 + y * 0).sum()
    (curve,) = axes.plot(
        x,
        y,
        color=CASED if line.cased else colour(line.colour),
        linestyle=DASHES[line.dash % len(DASHES)],
        drawstyle="steps-post" if line.step else "default",
        linewidth=line.wider * mpl.rcParams["lines.linewidth"],
        alpha=line.opacity,
        zorder=LINE_ORDER - 0.01 * line.depth,
        marker="o" if drawn == 1 else "",
        markersize=3.0,
    )
    if line.cased:
        edges = withStroke(linewidth=CASING_WIDTH * curve.get_linewidth(), foreground=CASING)
        curve.set_path_effects([edges])
    # Of zeros on a logarithmic axis nothing is seen: no entry in the legend.
    return {line.group or line.label: curve} if drawn else {}


def _points(points: Points, axes: Axes, panel: Panel) -> dict[str, Artist]:
    (points_line,) = axes.plot(
        _drawable(points.x, panel.x),
        _drawable(points.y, panel.y),
        color=colour(points.colour),
        alpha=0.6 if points.group else 1.0,
        linestyle="none",
        **SYMBOLS[points.symbol % len(SYMBOLS)],
        # On a map, whole at its edge.
        clip_on=not any(isinstance(mark, Cells) for mark in panel.marks),
    )
    if points.key is None:
        return {points.group or points.label: points_line}
    entry = Line2D([], [], linestyle="none", **SYMBOLS[points.symbol % len(SYMBOLS)])
    entry.set_color(colour(points.key))
    return {points.label: entry}


def _stack(stack: Stack, axes: Axes, panel: Panel) -> dict[str, Artist]:
    x = _drawable(stack.x, panel.x)
    parts = _drawable(stack.parts, Axis(""))
    handles: dict[str, Artist] = {}
    for half in (np.maximum, np.minimum):
        base = np.zeros(len(x))
        for number, label in enumerate(stack.labels):
            top = base + half(parts[:, number], 0.0)
            tint = area_colour(number)
            axes.fill_between(x, base, top, color=tint, alpha=0.75, linewidth=0.3, zorder=2)
            handles[label] = Patch(color=tint, alpha=0.75)
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
    # Whole at the ends of its axis: a share of 1 is often there.
    (middle,) = axes.plot(
        x, y, color=tint, linestyle="none", marker="o", markersize=4, clip_on=panel.y.ends is None
    )
    return {intervals.label: middle}


def _band(band: Band, axes: Axes, panel: Panel) -> dict[str, Artist]:
    x = _drawable(band.x, panel.x)
    low, high = _drawable(band.low, panel.y), _drawable(band.high, panel.y)
    tint = mpl.colors.to_rgba(colour(band.colour), 0.25)
    area = axes.fill_between(x, low, high, facecolor=tint, linewidth=0.0, zorder=1.5)
    return {band.label: area}


def _shares(shares: Shares, axes: Axes, _panel: Panel) -> dict[str, Artist]:
    places = np.arange(len(shares.counts))
    begin = np.zeros(len(places))
    handles: dict[str, Artist] = {}
    axes.grid(visible=False)
    for number, label in enumerate(shares.labels):
        tint, widths = colour(shares.colours[number]), shares.values[:, number]
        axes.barh(places, widths, 0.7, left=begin, color=tint, edgecolor="white", linewidth=0.5)
        handles[label] = Patch(color=tint)
        for place, left, width, count in zip(
            places, begin, widths, shares.counts[:, number].tolist(), strict=True
        ):
            # A narrow part has no room for its count.
            if width > COUNT_WIDTH * len(grouped(count)):
                style = {"color": contrast(shares.colours[number]), "ha": "center", "va": "center"}
                axes.text(left + width / 2, float(place), grouped(count), style)
        begin = begin + widths
    return handles


def _cells(cells: Cells, axes: Axes, panel: Panel) -> dict[str, Artist]:
    values = np.ma.masked_invalid(_drawable(cells.values, cells.scale))
    words = cells.scale.categories
    tints = _tints(cells.scale)
    style: dict[str, Any] = (
        {
            "cmap": ListedColormap(tints),
            "norm": BoundaryNorm(np.arange(len(words) + 1) - 0.5, len(words)),
        }
        if words
        else {
            "cmap": LinearSegmentedColormap.from_list("diverging", diverging_colours(cells))
            if diverges(cells)
            else SCALE,
            "norm": _norm(cells),
        }
    )
    axes.set_facecolor(EMPTY)
    axes.grid(visible=False)
    edges = cell_edges(cells.x, panel.x), cell_edges(cells.y, panel.y)
    axes.pcolormesh(*edges, values, rasterized=True, **style)
    for letter, ends in zip("xy", edges, strict=True):
        # Marks on the map, such as its extremes, must not widen the panel.
        getattr(axes, f"set_{letter}lim")(ends[0], ends[-1])
    present = {int(value) for value in np.unique(values.compressed())} if words else set()
    return {
        word: Patch(color=tint)
        for number, (word, tint) in enumerate(zip(words, tints, strict=True))
        if number in present
    } | _gaps(cells, axes, edges)


def _gaps(cells: Cells, axes: Axes, edges: tuple[Array, Array]) -> dict[str, Artist]:
    """Draw the cells without a value in the tone of the reason."""
    if cells.members is None:
        return {}
    handles: dict[str, Artist] = {}
    for number, reason in enumerate(cells.members.reasons):
        own = cells.members.gaps == number
        if own.any():
            tint = mpl.colors.to_rgba(GREY, gap_opacity(number))
            shown = np.ma.masked_where(~own, np.zeros(own.shape))
            axes.pcolormesh(*edges, shown, rasterized=True, cmap=ListedColormap([tint]))
            handles[gap_label(reason)] = Patch(color=tint)
    return handles


def draw_colour_bar(cells: Cells, axes: Sequence[Axes], *, titled: bool) -> None:
    """Draw the colour bar of a map of numbers.

    Args:
        cells: The map.
        axes: The axes that it belongs to; the first one has the map.
        titled: Whether it has a title.
    """
    mesh = next(found for found in axes[0].collections if isinstance(found, QuadMesh))
    bar = axes[0].figure.colorbar(mesh, ax=list(axes), pad=0.02)
    ticks = scale_ticks(*scale_ends(cells), log=cells.scale.log)
    bar.minorticks_off()
    bar.set_ticks(list(ticks), labels=list(ticks.values()))
    title = bar_title(cells.scale, titled=titled)
    if title:
        bar.set_label(title.replace("$", r"\$"))


def _norm(cells: Cells) -> Normalize:
    ends = scale_ends(cells)
    return LogNorm(*ends) if cells.scale.log else Normalize(*ends)


def _tints(scale: Axis) -> Sequence[Any]:
    count = len(scale.categories)
    if scale.colours:
        return [colour(number) for number in scale.colours]
    if count <= len(COLOURS):
        return COLOURS[:count]
    return [mpl.colormaps[SCALE](share) for share in np.linspace(0.0, 1.0, count)]


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
    Band: _band,
    Cells: _cells,
    Level: _level,
    Shares: _shares,
}


def draw(mark: Mark, axes: Axes, panel: Panel) -> dict[str, Artist]:
    """Draw a mark; return its legend handles by label ("" for none)."""
    return _DRAWERS[type(mark)](mark, axes, panel)
