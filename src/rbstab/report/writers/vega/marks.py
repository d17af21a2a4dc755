"""Each mark of a panel as layers of Vega-Lite.

The rows of all layers have the columns of `series_of`, the name `series`, and where they need them
`text` for the reader who points at it, `member`, and `k` for the order. The page reads the same
rows when it shows what is under the pointer and when it writes CSV.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from rbstab.files.text import grouped
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import (
    Axis,
    Band,
    Level,
    Line,
    Mark,
    Panel,
    Points,
    Shares,
    Stack,
)
from rbstab.report.model.palette import CASED, CASING, CASING_WIDTH, area_colour, colour, contrast
from rbstab.report.writers.series import series_of

JSON = dict[str, Any]

DASHES = ([1, 0], [6, 4], [2, 3], [7, 3, 2, 3])
"""Dash patterns by their numbers, in pixels."""

SYMBOLS = (
    "circle",
    "M-1,-1L1,1M1,-1L-1,1",
    "square",
    "diamond",
    "triangle-up",
    "triangle-down",
    "M0,-1L0,1M-1,0L1,0",
)
"""Symbols of points by their numbers: names of Vega, or paths."""

WIDTH = 1.5
"""The width of a curve in front, in pixels."""

OF_MANY = 0.6
"""The width and the opacity of a curve that is one of many in its entry of the legend."""

LARGEST = 1e300
"""Numbers beyond this are not drawn: the length of an axis would be infinite."""

BAR, HEIGHT = 32, 28
"""Pixels from one bar of shares to the next, and the height of one."""

NARROWEST_WITH_COUNT = 0.07
"""A part of a bar narrower than this share has no room for its count."""

DECORATION = {"aria": False}
"""What a layer has that repeats the data of another: edges of curves, counts in bars.

The page takes no data from it.
"""

LEVEL: JSON = {"type": "rule", "strokeDash": [4, 3], "strokeWidth": 1.2, "color": "#7F7F7F"}
"""Straight lines through a panel."""

POINT, AREA = {"x": "x", "y": "y"}, {"x": "x", "y": "low", "y2": "high"}
"""The columns of places, by the channel that shows them."""


def entry_of(mark: Line | Points) -> str:
    """Return the entry of the legend that a mark belongs to."""
    return mark.group or mark.label


def layers_of(mark: Mark, panel: Panel) -> Iterator[JSON]:
    """Yield a mark as layers, from back to front; their places lack the look of the axes.

    Args:
        mark: The mark; not `Cells`.
        panel: Its panel.
    """
    for number, (label, columns) in enumerate(series_of(mark)):
        match mark:
            case Line():
                yield from _line(mark, panel, columns)
            case Points():
                yield _points(mark, panel, columns)
            case Stack():
                style = {"type": "area", "color": area_colour(number), "opacity": 0.8}
                yield _layer(panel, label, columns, AREA, style)
            case Band():
                style = {"type": "area", "color": colour(mark.colour), "opacity": 0.25}
                yield _layer(panel, label, columns, AREA, style)
            case Level():
                yield _layer(panel, label, columns, {side: side for side in columns}, LEVEL)
            case Shares():
                yield from _shares(panel, label, columns, mark.colours[number])


def _layer(
    panel: Panel,
    series: str,
    columns: Mapping[str, Array | Sequence[Any]],
    shown: dict[str, str],  # the column by the channel that shows it
    style: JSON,  # of the mark
) -> JSON:
    """Return a layer; it is invisible while its series is hidden."""
    axes = {name: getattr(panel, way[0]) for way, name in shown.items() if way[0] in "xy"}
    entries = {
        name: _numbers(column, axes.get(name)) if isinstance(column, np.ndarray) else column
        for name, column in columns.items()
    }
    rows = [
        {"series": series} | dict(zip(entries, row, strict=True))
        for row in zip(*entries.values(), strict=True)
    ]
    encoding: JSON = {
        channel: {"field": name} | ({} if channel[-1] in "2t" else {"type": "quantitative"})
        for channel, name in shown.items()
    }
    is_shown = {"test": "indexof(hidden, datum.series) < 0", "value": style.get("opacity", 1.0)}
    encoding["opacity"] = {"condition": is_shown, "value": 0}
    mark = style | {"clip": True, "tooltip": None}
    return {"data": {"values": rows}, "mark": mark, "encoding": encoding}


def _numbers(values: Array, axis: Axis | None) -> list[float | None]:
    """Return numbers as JSON takes them, with seven digits; null where none can be drawn."""
    is_log = axis is not None and axis.log
    return [
        float(f"{value:.7g}") if abs(value) <= LARGEST and (value > 0 or not is_log) else None
        for value in values.tolist()
    ]


def _line(mark: Line, panel: Panel, columns: dict[str, Array]) -> Iterator[JSON]:
    rows: dict[str, Any] = columns | {"k": range(len(mark.x))}
    if mark.group:
        rows["text"] = [mark.label] * len(mark.x)
    width = OF_MANY if mark.group else 1.0
    style = {
        "type": "line",
        "color": CASED if mark.cased else colour(mark.colour),
        "opacity": width,
        "strokeWidth": WIDTH * width,
        "strokeDash": DASHES[mark.dash % len(DASHES)],
        "strokeJoin": "round",
        "interpolate": "step-after" if mark.step else "linear",
    }
    series, shown = entry_of(mark), POINT | {"order": "k"}
    if mark.cased:
        edges = {"strokeWidth": CASING_WIDTH * WIDTH, "strokeDash": [1, 0], "color": CASING}
        yield _layer(panel, series, rows, shown, style | edges | DECORATION)
    yield _layer(panel, series, rows, shown, style)


def _points(mark: Points, panel: Panel, columns: dict[str, Array]) -> JSON:
    more = {"text": mark.texts, "member": mark.members}
    rows: dict[str, Any] = columns | {name: values for name, values in more.items() if values}
    style = {
        "type": "point",
        "color": colour(mark.colour),
        "shape": SYMBOLS[mark.symbol % len(SYMBOLS)],
        "filled": mark.symbol == 0,
        "size": 45,
        "strokeWidth": 1.8,
    }
    return _layer(panel, entry_of(mark), rows, POINT, style)


def _shares(panel: Panel, label: str, columns: dict[str, Array], number: int) -> Iterator[JSON]:
    """Yield the parts of bars with one label, and their counts where there is room."""
    counts = [grouped(count) for count in columns["value"].tolist()]
    middle = (columns["low"] + columns["high"]) / 2
    rows: dict[str, Any] = columns | {"text": counts, "middle": middle}
    bars = {"type": "bar", "orient": "horizontal", "size": HEIGHT, "color": colour(number)}
    yield _layer(panel, label, rows, {"x": "low", "x2": "high", "y": "y"}, bars)
    texts = {"type": "text", "fontSize": 11, "color": contrast(number)} | DECORATION
    layer = _layer(panel, label, rows, {"x": "middle", "y": "y", "text": "text"}, texts)
    layer["transform"] = [{"filter": f"datum.x > {NARROWEST_WITH_COUNT}"}]
    yield layer
