"""Each mark of a panel as layers of Vega-Lite.

All layers have rows of the same form: `series`, `x` and `y`, and where they need them `x2` and `y2`
for the other end, `text` for the reader who points at it, `member`, and `k` for the order. The page
reads the same rows when it shows what is under the pointer and when it writes CSV.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rbstab.files.counts import grouped
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import (
    Axis,
    Band,
    Bars,
    Intervals,
    Level,
    Line,
    Mark,
    Panel,
    Points,
    Shares,
    Stack,
)
from rbstab.report.model.palette import CASED, CASING, CASING_WIDTH, area_colour, colour, contrast

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

HALF_BAR = 0.34
"""Half the height of a bar of shares, where the distance of bars is 1."""

NARROWEST_WITH_COUNT = 0.07
"""A part of a bar narrower than this share has no room for its count."""


def entry_of(mark: Line | Points) -> str:
    """Return the entry of the legend that a mark belongs to."""
    return mark.group or mark.label


def layers_of(mark: Mark, panel: Panel, x: JSON, y: JSON) -> list[JSON]:
    """Return a mark as layers, from back to front.

    Args:
        mark: The mark; not `Cells`.
        panel: Its panel.
        x: The encoding of the horizontal axis for the field x.
        y: The encoding of the vertical axis for the field y.
    """
    return list(_layers(mark, panel, {"x": x, "y": y}))


def _layers(mark: Mark, panel: Panel, at: JSON) -> Iterator[JSON]:
    match mark:
        case Line():
            yield from _line(mark, panel, at)
        case Points():
            yield _points(mark, panel, at)
        case Stack():
            yield from _stack(mark, panel, at)
        case Bars():
            rows = _rows(panel, mark.label, x=mark.edges[:-1], x2=mark.edges[1:], y=mark.heights)
            rows = [row | {"y2": 0} for row in rows]
            yield _layer(rows, {"type": "rect"}, at | _ends("x2", "y2"), colour(mark.colour), 0.65)
        case Intervals():
            rows = _rows(panel, mark.label, x=mark.x, y=mark.low, y2=mark.high)
            points = _rows(panel, mark.label, x=mark.x, y=mark.y)
            rows = [row | {"value": point["y"]} for row, point in zip(rows, points, strict=True)]
            tint = colour(mark.colour)
            yield _layer(rows, {"type": "rule", "strokeWidth": 1.5}, at | _ends("y2"), tint)
            yield _layer(points, {"type": "circle", "size": 45} | DECORATION, at, tint)
        case Band():
            rows = _rows(panel, mark.label, x=mark.x, y=mark.low, y2=mark.high)
            yield _layer(rows, {"type": "area"}, at | _ends("y2"), colour(mark.colour), 0.25)
        case Level():
            side = "x" if mark.vertical else "y"
            (value,) = _numbers([mark.value], panel.x if mark.vertical else panel.y)
            rows = [{"series": mark.label, side: value}]
            style = {"type": "rule", "strokeDash": [4, 3], "strokeWidth": 1.2}
            yield _layer(rows, style, {side: at[side]}, LEVEL)
        case Shares():
            yield from _shares(mark, at)


DECORATION = {"aria": False}
"""What a layer has that repeats the data of another: edges of curves, counts in bars."""

LEVEL = "#7F7F7F"
"""The colour of straight lines through a panel."""


def _layer(rows: list[JSON], style: JSON, at: JSON, tint: Any, opacity: float = 1.0) -> JSON:
    """Return a layer of one colour; it is invisible while its series is hidden.

    The page takes no data from a layer with `DECORATION`.
    """
    shown = {
        "condition": {"test": "indexof(hidden, datum.series) < 0", "value": opacity},
        "value": 0,
    }
    return {
        "data": {"values": rows},
        "mark": style | {"clip": True, "tooltip": None},
        "encoding": at | {"opacity": shown, "color": {"value": tint}},
    }


def _ends(*fields: str) -> JSON:
    return {name: {"field": name} for name in fields}


def _rows(panel: Panel, series: str, **columns: Array | Sequence[Any]) -> list[JSON]:
    """Return rows of a mark; what a logarithmic axis cannot show is null."""
    shown = {
        name: _numbers(values, panel.x if name[0] == "x" else panel.y)
        if name[0] in "xy"
        else list(values)
        for name, values in columns.items()
    }
    return [
        {"series": series, **dict(zip(shown, entries, strict=True))}
        for entries in zip(*shown.values(), strict=True)
    ]


def _numbers(values: Array | Sequence[float], axis: Axis) -> list[float | None]:
    """Return numbers as JSON takes them, with seven digits; null where none can be drawn."""
    return [
        float(f"{value:.7g}") if abs(value) <= LARGEST and (value > 0 or not axis.log) else None
        for value in np.asarray(values, dtype=float).tolist()
    ]


def _line(mark: Line, panel: Panel, at: JSON) -> Iterator[JSON]:
    rows = _rows(panel, mark.label, x=mark.x, y=mark.y, k=range(len(mark.x)))
    if mark.group:
        rows = [row | {"series": mark.group, "text": mark.label} for row in rows]
    style = {
        "type": "line",
        "strokeWidth": WIDTH * (OF_MANY if mark.group else 1.0),
        "strokeDash": DASHES[mark.dash % len(DASHES)],
        "strokeJoin": "round",
        "interpolate": "step-after" if mark.step else "linear",
    }
    at = at | {"order": {"field": "k", "type": "quantitative"}}
    if mark.cased:
        edges = {"strokeWidth": CASING_WIDTH * WIDTH, "strokeDash": [1, 0]} | DECORATION
        yield _layer(rows, style | edges, at, CASING)
    tint = CASED if mark.cased else colour(mark.colour)
    yield _layer(rows, style, at, tint, OF_MANY if mark.group else 1.0)


def _points(mark: Points, panel: Panel, at: JSON) -> JSON:
    columns: dict[str, Any] = {"x": mark.x, "y": mark.y}
    if mark.texts:
        columns["text"] = mark.texts
    if mark.members:
        columns["member"] = mark.members
    rows = [row | {"series": entry_of(mark)} for row in _rows(panel, mark.label, **columns)]
    style = {
        "type": "point",
        "shape": SYMBOLS[mark.symbol % len(SYMBOLS)],
        "filled": mark.symbol == 0,
        "size": 45,
        "strokeWidth": 1.8,
    }
    return _layer(rows, style, at, colour(mark.colour))


def _stack(mark: Stack, panel: Panel, at: JSON) -> Iterator[JSON]:
    """Yield the areas; what is negative is stacked downwards."""
    up, down = np.zeros(len(mark.x)), np.zeros(len(mark.x))
    for number, (label, part) in enumerate(zip(mark.labels, mark.parts.T, strict=True)):
        bottom = np.where(part >= 0, up, down)
        with np.errstate(over="ignore"):  # what is infinite is not drawn
            top = bottom + part
        up, down = np.where(part >= 0, top, up), np.where(part < 0, top, down)
        rows = _rows(panel, label, x=mark.x, y=bottom, y2=top, part=_numbers(part, panel.y))
        yield _layer(rows, {"type": "area"}, at | _ends("y2"), area_colour(number), 0.8)


def _shares(mark: Shares, at: JSON) -> Iterator[JSON]:
    ends = mark.values.cumsum(axis=1)
    begins = ends - mark.values
    for part, (label, number) in enumerate(zip(mark.labels, mark.colours, strict=True)):
        columns = begins[:, part].tolist(), ends[:, part].tolist(), mark.counts[:, part].tolist()
        rows: list[JSON] = [
            {
                "series": label,
                "x": begin,
                "x2": end,
                "y": bar - HALF_BAR,
                "y2": bar + HALF_BAR,
                "middle": (begin + end) / 2,
                "bar": bar,
                "text": grouped(count),
                "count": count,
            }
            for bar, (begin, end, count) in enumerate(zip(*columns, strict=True))
        ]
        yield _layer(rows, {"type": "rect"}, at | _ends("x2", "y2"), colour(number))
        wide = [row for row in rows if row["x2"] - row["x"] > NARROWEST_WITH_COUNT]
        places = {
            "x": at["x"] | {"field": "middle"},
            "y": at["y"] | {"field": "bar"},
            "text": {"field": "text"},
        }
        yield _layer(wide, {"type": "text", "fontSize": 11} | DECORATION, places, contrast(number))
