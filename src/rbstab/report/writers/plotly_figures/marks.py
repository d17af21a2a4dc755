"""Convert the marks of a panel to traces and shapes of plotly."""

from functools import singledispatch
from typing import Any

import numpy as np

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
    area_colour,
    colour,
    contrast,
)
from rbstab.report.writers.plotly_figures.cells import cell_traces
from rbstab.report.writers.plotly_figures.text import (
    escaped,
    legend_entry,
    packed_array,
    translucent,
)

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
    line: JSON = {
        "color": colour(mark.colour),
        "dash": DASHES[mark.dash % 4],
        "width": 1.6 * mark.wider,
        "shape": "hv" if mark.step else "linear",
        # `decimate` has removed the invisible points; plotly must not remove more.
        "simplify": False,
    }
    y = _positive_on_log(panel.y, mark.y)
    trace = _scatter(mark.label, mark.x, y, mode="lines", line=line)
    if mark.cased:
        edges = line | {"color": CASING, "width": CASING_WIDTH * line["width"]}
        line["color"] = CASED
        return [trace | {"line": edges, "name": "", "hoverinfo": "skip"}, trace]
    stands_back = bool(mark.depth or mark.group)
    return [trace | {"opacity": mark.opacity, "zorder": -mark.depth} if stands_back else trace]


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
    if any(isinstance(other, Cells) for other in panel.marks):
        # On a map: larger, and whole at its edge.
        trace["marker"] |= {"size": 10, "line": {"width": 2, "color": colour(mark.colour)}}
        trace["cliponaxis"] = False
    if mark.texts:
        texts = [escaped(text).replace("\n", "<br>") for text in mark.texts]
        trace |= {"text": texts, "hoverinfo": "text"}
    if mark.members:
        trace["customdata"] = list(mark.members)
    return [trace]


@_traces.register
def _(mark: Stack, _panel: Panel) -> list[JSON]:
    stacked = []
    for number, label in enumerate(mark.labels):
        values = np.nan_to_num(mark.parts[:, number])
        sides = {"up": values.clip(min=0), "down": values.clip(max=0)}
        for side, part in sides.items():
            if part.any() or (side == "up" and not values.any()):
                tint = area_colour(number)
                line = {"width": 0.5, "color": tint}
                trace = _scatter(label, mark.x, part, mode="lines", line=line)
                stacked.append(trace | {"stackgroup": side, "fillcolor": tint})
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
            "fillcolor": translucent(tint),
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
def _(mark: Band, panel: Panel) -> list[JSON]:
    traces = []
    # A gap divides the band: plotly would fill across it.
    finite = np.isfinite(mark.low) & np.isfinite(mark.high)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], finite, [False]]).astype(int)))
    for first, end in edges.reshape(-1, 2):
        part = slice(first, end)
        x = np.concatenate([mark.x[part], mark.x[part][::-1]])
        y = np.concatenate([mark.low[part], mark.high[part][::-1]])
        tint = colour(mark.colour)
        line = {"width": 0, "color": tint}
        trace = _scatter(mark.label, x, _positive_on_log(panel.y, y), mode="lines", line=line)
        fill = {"fill": "toself", "fillcolor": translucent(tint, 0.25), "hoverinfo": "skip"}
        traces.append(trace | fill)
    return traces


@_traces.register
def _(mark: Shares, panel: Panel) -> list[JSON]:
    totals = mark.counts.sum(axis=1).tolist()
    places = packed_array(np.arange(float(len(mark.counts))))
    bars = []
    for number, label in enumerate(mark.labels):
        counts = mark.counts[:, number].tolist()
        of_each = zip(panel.y.categories, counts, totals, strict=True)
        bars.append(
            {
                "type": "bar",
                "orientation": "h",
                "x": packed_array(mark.values[:, number]),
                "y": places,
                "width": 0.7,
                **legend_entry(label),
                "marker": {"color": colour(mark.colours[number])},
                "text": [grouped(count) if count else "" for count in counts],
                "textposition": "inside",
                "insidetextanchor": "middle",
                "insidetextfont": {"color": contrast(mark.colours[number])},
                "textangle": 0,
                "hovertext": [
                    escaped(f"{name}: {grouped(n)} of {grouped(total)}")
                    for name, n, total in of_each
                ],
                "hoverinfo": "text+name",
            }
        )
    return bars


@_traces.register
def _(mark: Cells, panel: Panel) -> list[JSON]:
    return cell_traces(mark, panel)


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
    return shape | legend_entry(mark.label)


def _scatter(label: str, x: Array, y: Array, **options: Any) -> JSON:
    return {
        "type": "scatter",
        "x": packed_array(x),
        "y": packed_array(y),
        **legend_entry(label),
        **options,
    }


def _positive_on_log(axis: Axis, values: Array) -> Array:
    """Replace values at or below zero by NaN if the axis is logarithmic."""
    if not axis.log:
        return values
    return np.where(np.asarray(values) > 0, values, np.nan)
