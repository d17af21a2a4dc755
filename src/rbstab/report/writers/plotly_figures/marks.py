"""Convert the marks of a panel to traces and shapes of plotly."""

from functools import singledispatch
from typing import Any

import numpy as np

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
from rbstab.report.model.palette import SCALE, colour
from rbstab.report.writers.plotly_figures.text import escaped, packed_array, tick_label

JSON = dict[str, Any]

DASHES = ("solid", "dash", "dot", "dashdot")
SYMBOLS = (
    "circle",
    "x",
    "square-open",
    "diamond-open",
    "triangle-up-open",
    "triangle-down-open",
    "cross-thin-open",
)
LEVEL_COLOUR = "#7F7F7F"


def traces(mark: Mark, panel: Panel) -> list[JSON]:
    """Return the traces of a mark, without their axes.

    Args:
        mark: Any mark except a level.
        panel: The panel of the mark.
    """
    return _traces(mark, panel)


@singledispatch
def _traces(mark: object, _panel: Panel) -> list[JSON]:
    raise TypeError(f"plotly cannot draw a mark of type {type(mark).__name__}")


@_traces.register
def _(mark: Line, panel: Panel) -> list[JSON]:
    line = {
        "color": colour(mark.colour),
        "dash": DASHES[mark.dash % 4],
        "width": 1.6,
        "shape": "hv" if mark.step else "linear",
        # `decimate` has removed the invisible points; plotly must not remove more.
        "simplify": False,
    }
    return [
        _scatter(mark.label, mark.x, _positive_on_log(panel.y, mark.y), mode="lines", line=line)
    ]


@_traces.register
def _(mark: Points, panel: Panel) -> list[JSON]:
    trace = _scatter(
        mark.label,
        mark.x,
        _positive_on_log(panel.y, mark.y),
        mode="markers",
        marker={
            "color": colour(mark.colour),
            "symbol": SYMBOLS[mark.symbol % len(SYMBOLS)],
            "size": 7,
        },
    )
    if mark.texts:
        trace |= {"text": [escaped(text) for text in mark.texts], "hoverinfo": "text"}
    return [trace]


@_traces.register
def _(mark: Stack, _panel: Panel) -> list[JSON]:
    stacked = []
    for number, label in enumerate(mark.labels):
        values = np.nan_to_num(mark.parts[:, number])
        sides = {"up": values.clip(min=0), "down": values.clip(max=0)}
        for side, part in sides.items():
            if part.any() or (side == "up" and not values.any()):
                line = {"width": 0.5, "color": colour(number)}
                trace = _scatter(label, mark.x, part, mode="lines", line=line)
                stacked.append(trace | {"stackgroup": side, "fillcolor": colour(number)})
    return stacked


@_traces.register
def _(mark: Bars, panel: Panel) -> list[JSON]:
    # An outline, not bars: on logarithmic axes plotly does not place bars by their edges.
    x = np.repeat(mark.edges, 2)
    y = np.concatenate([[0.0], np.repeat(mark.heights, 2), [0.0]])
    inner = [
        f"{low:.4g} to {high:.4g}: {height:.4g}"
        for low, high, height in zip(mark.edges[:-1], mark.edges[1:], mark.heights, strict=True)
    ]
    texts = ["", *(text for text in inner for _ in range(2)), ""]
    tint = colour(mark.colour)
    line = {"color": tint, "width": 1}
    trace = _scatter(mark.label, x, _positive_on_log(panel.y, y), mode="lines", line=line)
    return [
        trace
        | {
            "fill": "tozeroy",
            "fillcolor": _translucent(tint),
            "text": texts,
            "hoverinfo": "text+name",
        }
    ]


@_traces.register
def _(mark: Intervals, panel: Panel) -> list[JSON]:
    tint = colour(mark.colour)
    trace = _scatter(
        mark.label,
        mark.x,
        _positive_on_log(panel.y, mark.y),
        mode="markers",
        marker={"color": tint, "size": 7},
    )
    trace["error_y"] = {
        "type": "data",
        "symmetric": False,
        "array": packed_array(mark.high - mark.y),
        "arrayminus": packed_array(mark.y - mark.low),
        "color": tint,
        "thickness": 1.4,
    }
    return [trace]


@_traces.register
def _(mark: Cells, panel: Panel) -> list[JSON]:
    values = np.asarray(mark.values, dtype=float)
    shown = _log10(values) if mark.scale.log else values
    trace: JSON = {
        "type": "heatmap",
        "x": packed_array(_edges(mark.x, panel.x)),
        "y": packed_array(_edges(mark.y, panel.y)),
        "z": packed_array(shown),
        "text": _hover_texts(mark, values, panel),
        "hoverinfo": "text",
    }
    return [trace]


def colour_axis(mark: Mark) -> JSON:
    """Return the colour axis of a map; {} for all other marks."""
    if not isinstance(mark, Cells):
        return {}
    scale = mark.scale
    bar: JSON = {"title": {"text": escaped(scale.text), "side": "right"}, "outlinewidth": 0}
    if scale.categories:
        count = len(scale.categories)
        steps = [
            [end / count, colour(number)] for number in range(count) for end in (number, number + 1)
        ]
        ticks = {
            "tickvals": list(range(count)),
            "ticktext": [tick_label(label) for label in scale.categories],
        }
        return {"colorscale": steps, "cmin": -0.5, "cmax": count - 0.5, "colorbar": bar | ticks}
    found = {"colorscale": SCALE.capitalize(), "colorbar": bar}
    ends = np.array(mark.span or _value_range(mark), dtype=float)
    if scale.log:
        ends = _log10(ends)
        bar |= _log_ticks(*ends)
    return found | dict(zip(("cmin", "cmax"), ends.tolist(), strict=True))


def _value_range(mark: Cells) -> tuple[float, float]:
    """Return the smallest and the largest drawn value; 1 and 10 if there are no values."""
    values = np.asarray(mark.values, dtype=float)
    shown = values[np.isfinite(values) & ((values > 0) | (not mark.scale.log))]
    return (float(shown.min()), float(shown.max())) if len(shown) else (1.0, 10.0)


def _log_ticks(low: float, high: float) -> JSON:
    """Return ticks of a log scale from 10^low to 10^high: powers of ten, times 1, 2 and 5."""
    first, last = int(np.floor(low)), int(np.ceil(high))
    powers = range(first, last + 1, max((last - first) // 8, 1))
    factors = (1, 2, 5) if high - low < 2 else (1,)
    ticks = [(power, factor) for power in powers for factor in factors]
    return {
        "tickvals": [power + float(np.log10(factor)) for power, factor in ticks],
        "ticktext": [f"{factor * 10.0**power:g}" for power, factor in ticks],
    }


def level_shape(mark: Level) -> JSON:
    """Return the line of a level, without its axes."""
    along, across = ("y", "x") if mark.vertical else ("x", "y")
    shape: JSON = {
        "type": "line",
        f"{along}0": 0,
        f"{along}1": 1,
        f"{across}0": mark.value,
        f"{across}1": mark.value,
        "line": {"color": LEVEL_COLOUR, "width": 1.2, "dash": "dash"},
    }
    return shape | _legend_entry(mark.label)


def _scatter(label: str, x: Array, y: Array, **options: Any) -> JSON:
    return {
        "type": "scatter",
        "x": packed_array(x),
        "y": packed_array(y),
        **_legend_entry(label),
        **options,
    }


def _legend_entry(label: str) -> JSON:
    return {"name": escaped(label), "legendgroup": label} if label else {"name": ""}


def _positive_on_log(axis: Axis, values: Array) -> Array:
    """Replace values at or below zero by NaN if the axis is logarithmic."""
    if not axis.log:
        return values
    return np.where(np.asarray(values) > 0, values, np.nan)


def _log10(values: Array) -> Array:
    positive = np.where(values > 0, values, np.nan)
    return np.log10(positive)


def _edges(centres: Array, axis: Axis) -> Array:
    """Return the edges of cells, halfway between their centres on the axis, shape (n + 1,)."""
    places = _log10(centres) if axis.log else np.asarray(centres, dtype=float)
    steps = np.diff(places) if len(places) > 1 else np.ones(1)
    inner = places[:-1] + steps[: len(places) - 1] / 2
    edges = np.concatenate([[places[0] - steps[0] / 2], inner, [places[-1] + steps[-1] / 2]])
    return 10.0**edges if axis.log else edges


def _hover_texts(mark: Cells, values: Array, panel: Panel) -> list[list[str]]:
    """Return the hover text of each cell, row by row."""
    return [
        [
            f"{_value(panel.x, x)}, {_value(panel.y, y)}: {_value(mark.scale, value)}"
            if np.isfinite(value)
            else ""
            for x, value in zip(mark.x.tolist(), row, strict=True)
        ]
        for y, row in zip(mark.y.tolist(), values.tolist(), strict=True)
    ]


def _value(axis: Axis, value: float) -> str:
    if axis.categories:
        return escaped(axis.categories[round(value)])
    return f"{value:.4g}"


def _translucent(tint: str) -> str:
    red, green, blue = (int(tint[begin : begin + 2], 16) for begin in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, 0.35)"
