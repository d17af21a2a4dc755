"""The settings of an axis in plotly: its kind, its ends, its ticks and their labels."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Bars, Cells, Intervals, Line, Panel, Points
from rbstab.report.writers.colour_scale import cell_edges
from rbstab.report.writers.plotly_figures.text import escaped
from rbstab.report.writers.plotly_figures.tick_words import tick_label, tick_lines

JSON = dict[str, Any]

LOG_TICKS = 4
"""Ticks that a logarithmic axis has room for; with plotly's own number, labels between the powers
of ten overlap them."""

FEW_DECADES = 3.0
"""A logarithmic axis of fewer decades has labels between powers of ten, written out: 0.2, not 2.

The same holds in `figures.js` after a zoom."""

WRITTEN_OUT = ({"tickformat": "~g", "nticks": 3}, {"tickformat": "~e", "nticks": 3})
"""Settings of such an axis: for numbers of any size, and for those with many zeros, as 2e-6."""

DECADE = {"~g": 95, "~e": 135}
"""The least width of a decade with labels at 1, 2 and 5, px, by the format of the labels."""

MANY_ZEROS = (1e-4, 1e6)
"""Numbers below the first and above the second have many zeros."""

TICK_SIZE, TITLE_SIZE = 11, 13
"""Sizes of all tick labels, and of all titles of axes and colour bars, px."""

STEPS = (1, 2, 2.5, 4, 5, 10)
"""Distances of ticks of a small panel, in units of a power of ten."""

FEW_TICKS, NEAR_TICK = 3, 0.12
"""Number of distances between ticks of a small panel, and how near to a tick an end is moved to it,
as a part of the length of the axis."""

BESIDE, MAX_LINES = 20, 3
"""Characters of a line of the name of a category beside a panel, and the number of such lines."""

FEW_WHOLE = 8
"""On an axis of whole numbers that is at most so long, plotly's own ticks may be at halves."""

TITLE_FONT = {"font": {"size": TITLE_SIZE}}


def axis_settings(panel: Panel, letter: str, shown: Sequence[Panel]) -> JSON:
    """Return the settings of an axis of a panel, without its place.

    Args:
        panel: The panel.
        letter: "x" or "y".
        shown: The panels that have this axis in common; they have the same ticks.
    """
    axis: Axis = getattr(panel, letter)
    settings = _settings(axis, _ends(panel, letter))
    if axis.log:
        settings |= _written_out(shown, letter)
    if axis.whole and max(_length(one, letter) for one in shown) <= FEW_WHOLE:
        settings |= {"tick0": 0, "dtick": 1}
    return settings


def few_ticks(panel: Panel) -> JSON:
    """Return the settings of the horizontal axis of a small panel, with few ticks.

    An end that is near to a tick is moved to it, so that there is more than one tick. After a zoom,
    `figures.js` lets plotly choose the ticks.
    """
    values = _values(panel, "x")
    if panel.x.log or panel.x.categories or len(values) < 2 or np.ptp(values) == 0:
        return {"nticks": FEW_TICKS}
    low, high = float(values.min()), float(values.max())
    rough = (high - low) / FEW_TICKS
    power = 10.0 ** np.floor(np.log10(rough))
    step = float(power * next(size for size in STEPS if rough <= size * power))
    ends = step * np.array([np.floor(low / step), np.ceil(high / step)])
    near = np.abs(ends - [low, high]) <= NEAR_TICK * (high - low)
    return {"range": np.where(near, ends, [low, high]).tolist(), "tick0": 0, "dtick": step}


def only_powers(panel: Panel, settings: JSON, width: float) -> JSON:
    """Return settings with which only powers of ten are labelled, where other labels would overlap.

    After a zoom, `figures.js` lets plotly choose the ticks; it needs the ends of the whole axis.

    Args:
        panel: The panel of a map or a histogram.
        settings: The settings of its horizontal axis.
        width: The width of the panel, px.
    """
    if "tickformat" not in settings:
        return {}
    edges = [np.log10(mark.edges[[0, -1]]) for mark in panel.marks if isinstance(mark, Bars)]
    ends = settings.get("range") or (edges[0].tolist() if edges else None)
    if ends is None:
        return {}
    powers = np.floor(ends[1]) - np.ceil(ends[0]) + 1
    if powers < 2 or width / (ends[1] - ends[0]) >= DECADE[settings["tickformat"]]:
        return {}
    return {"range": ends, "tick0": 0, "dtick": 1}


def _ends(panel: Panel, letter: str) -> tuple[float, float] | None:
    """Return the ends of an axis: those that it has, the edges of a map's cells, or of categories.

    Each category has the same room: plotly leaves out a label that the edge of a page would cut.
    """
    axis: Axis = getattr(panel, letter)
    maps = [mark for mark in panel.marks if isinstance(mark, Cells)]
    if axis.ends is not None:
        return axis.ends
    if not maps:
        return (-0.5, len(axis.categories) - 0.5) if axis.categories else None
    edges = cell_edges(getattr(maps[0], letter), axis)
    return float(edges[0]), float(edges[-1])


def _length(panel: Panel, letter: str) -> float:
    """Return the length of an axis of numbers that its marks need."""
    finite = _values(panel, letter)
    return float(np.ptp(finite)) if len(finite) else 0.0


def _written_out(panels: Sequence[Panel], letter: str) -> JSON:
    """Return the settings of the logarithmic axis of panels that spans few decades; {} if many."""
    values = np.concatenate(
        [np.array(_ends(panel, letter) or _values(panel, letter)) for panel in panels]
    )
    positive = values[values > 0]
    if not len(positive) or np.log10(positive.max()) - np.log10(positive.min()) >= FEW_DECADES:
        return {}
    many = positive.min() < MANY_ZEROS[0] or positive.max() > MANY_ZEROS[1]
    return WRITTEN_OUT[int(many)]


def _values(panel: Panel, letter: str) -> Array:
    """Return the finite values of the marks of a panel along an axis."""
    values = [np.zeros(0)]
    for mark in panel.marks:
        if isinstance(mark, Bars):
            values.append(mark.edges if letter == "x" else np.append(mark.heights, 0.0))
        elif isinstance(mark, Line | Cells | Points | Intervals):
            values.append(getattr(mark, letter))
    every = np.concatenate(values)
    return every[np.isfinite(every)]


def _settings(axis: Axis, ends: tuple[float, float] | None) -> JSON:
    settings: JSON = {
        "title": {"text": escaped(axis.text), "standoff": 6} | TITLE_FONT,
        "type": "log" if axis.log else "linear",
        # Powers of ten are too wide for tick labels, except on logarithmic axes.
        "exponentformat": "power" if axis.log else "SI",
        "zeroline": not axis.log,
        "showline": True,
        "ticks": "outside",
        "ticklen": 4,
        "tickfont": {"size": TICK_SIZE},
    }
    if axis.log:
        settings |= {
            "nticks": LOG_TICKS,
            "minor": {"ticks": "outside", "ticklen": 2},
        }
    if ends is not None:
        settings |= {"range": np.log10(ends).tolist() if axis.log else list(ends)}
    if axis.categories:
        # Beside a panel; `layout.py` knows the room below one.
        broken = [tick_lines(label, BESIDE, MAX_LINES) for label in axis.categories]
        settings |= {
            "tickvals": list(range(len(axis.categories))),
            "ticktext": ["<br>".join(map(tick_label, label)) for label in broken],
        }
    return settings
