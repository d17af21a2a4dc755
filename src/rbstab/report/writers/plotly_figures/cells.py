"""Convert the cells of a map to traces and a colour axis of plotly."""

from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Cells, Mark, Panel
from rbstab.report.model.palette import GREY, SCALE, colour, gap_opacity
from rbstab.report.writers.colour_scale import (
    bar_title,
    cell_edges,
    diverges,
    diverging_colours,
    gap_label,
    scale_ends,
    scale_ticks,
)
from rbstab.report.writers.plotly_figures.text import (
    escaped,
    legend_entry,
    packed_array,
    packed_integers,
    translucent,
)

JSON = dict[str, Any]


def cell_traces(mark: Cells, panel: Panel) -> list[JSON]:
    """Return the traces of the cells of a map, without their axes."""
    values = np.asarray(mark.values, dtype=float)
    shown = _log10(values) if mark.scale.log else values
    edges: JSON = {
        "type": "heatmap",
        "x": packed_array(cell_edges(mark.x, panel.x)),
        "y": packed_array(cell_edges(mark.y, panel.y)),
    }
    # The script of the page shows what a cell holds; texts of all cells would need megabytes.
    cells = edges | {"z": packed_array(shown), "hoverinfo": "none"}
    return [cells, *_gaps(mark, edges), *_words(mark)]


def _words(mark: Cells) -> list[JSON]:
    """Return traces without points, for the legend entries of the words of a map."""
    if not mark.scale.categories:
        return []
    present = np.unique(mark.values[np.isfinite(mark.values)]).astype(int)
    tones = _tones(mark.scale)
    return [
        {
            "type": "scatter",
            "x": [None],
            "y": [None],
            "mode": "markers",
            **legend_entry(word),
            "fillcolor": tones[number],
            "marker": {"color": tones[number], "symbol": "square", "size": 10},
            "hoverinfo": "skip",
        }
        for number, word in enumerate(mark.scale.categories)
        if number in present
    ]


def _tones(scale: Axis) -> list[str]:
    """Return the colours of the words of a map."""
    return [colour(number) for number in scale.colours or range(len(scale.categories))]


def _gaps(mark: Cells, edges: JSON) -> list[JSON]:
    """Return a trace of the cells without a value for each reason."""
    if mark.members is None:
        return []
    gaps = mark.members.gaps
    return [
        edges
        | legend_entry(gap_label(reason))
        | {
            "z": packed_integers((gaps == number).astype(int)),
            "colorscale": [[0, "rgba(0,0,0,0)"], [1, translucent(GREY, gap_opacity(number))]],
            "zmin": 0,
            "zmax": 1,
            "showscale": False,
            "hoverinfo": "skip",
        }
        for number, reason in enumerate(mark.members.reasons)
        if (gaps == number).any()
    ]


def colour_axis(mark: Mark, *, titled: bool = True) -> JSON:
    """Return the colour axis of a map; {} for all other marks.

    Args:
        mark: The mark.
        titled: Whether the colour bar has a title.
    """
    if not isinstance(mark, Cells):
        return {}
    scale = mark.scale
    if scale.categories:
        # The legend has the words; beside a bar, long ones have no room.
        tones = _tones(scale)
        count = len(tones)
        steps = [[end / count, tones[n]] for n in range(count) for end in (n, n + 1)]
        return {"colorscale": steps, "cmin": -0.5, "cmax": count - 0.5, "showscale": False}
    title = escaped(bar_title(scale, titled=titled))
    bar: JSON = {"title": {"text": title, "side": "right"}, "outlinewidth": 0}
    low, high = scale_ends(mark)
    labels = scale_ticks(low, high, log=scale.log)
    places, ends = np.array(list(labels)), np.array([low, high])
    if scale.log:
        places, ends = _log10(places), _log10(ends)
    bar |= {"tickvals": places.tolist(), "ticktext": list(labels.values())}
    colours = [*map(list, diverging_colours(mark))] if diverges(mark) else SCALE.capitalize()
    found: JSON = {"colorscale": colours, "colorbar": bar}
    return found | dict(zip(("cmin", "cmax"), ends.tolist(), strict=True))


def _log10(values: Array) -> Array:
    positive = np.where(values > 0, values, np.nan)
    return np.log10(positive)
