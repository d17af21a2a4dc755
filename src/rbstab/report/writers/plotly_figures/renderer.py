"""Figures as plotly draws them: plain dictionaries, to become JSON in a page."""

from typing import Any

from rbstab.report.model.figure import Figure, Level, Panel
from rbstab.report.writers.decimate import decimated
from rbstab.report.writers.plotly_figures.layout import Placing, axis_keys, axis_name, laid_out
from rbstab.report.writers.plotly_figures.marks import coloured, level, traces
from rbstab.report.writers.plotly_figures.text import plain

WIDE, NARROW = 880, 340
"""Widths, in pixels of CSS, for which a figure is laid out: a page, and a telephone."""

MAX_UNIFIED = 8
"""With more curves in a panel than these, the pointer names one of them, not all."""

JSON = dict[str, Any]


def drawn(figure: Figure) -> JSON:
    """A figure as plotly draws it.

    Texts are escaped: plotly takes some of HTML for markup. Curves of the same label have the same
    `legendgroup`, which is the label as it is; the first of them stands in the legend.

    Returns:
        `data` and `layout` as plotly knows them; `narrow`, the layout in one column, for a
        telephone. Layouts have no colours of their own but those of the marks.
    """
    figure = decimated(figure)
    named: set[str] = set()
    data: list[JSON] = []
    shapes: list[JSON] = []
    scales: dict[str, JSON] = {}
    for number, panel in enumerate(figure.panels):
        for mark in panel.marks:
            if isinstance(mark, Level):
                shapes.append(_in_panel(level(mark), mark.upright, number))
                continue
            drawings, scale = traces(mark, panel), coloured(mark)
            for trace in drawings:
                trace |= {"xaxis": axis_name("x", number), "yaxis": axis_name("y", number)}
                if scale:
                    trace["coloraxis"] = axis_name("coloraxis", number)
            if scale:
                scales[axis_name("coloraxis", number)] = scale
            data += drawings
    for entry in (*data, *shapes):
        label = entry.get("legendgroup", "")
        entry["showlegend"] = bool(label) and label not in named
        named.add(label)
    layouts = {
        name: _layout(figure, placing, shapes, scales)
        for name, placing in (
            ("layout", Placing(figure, min(figure.columns, len(figure.panels)), WIDE)),
            ("narrow", Placing(figure, 1, NARROW)),
        )
    }
    return {"data": data, **layouts}


def _in_panel(shape: JSON, upright: bool, number: int) -> JSON:
    """A line through a panel: along the one axis it goes from end to end."""
    x, y = axis_name("x", number), axis_name("y", number)
    if upright:
        return shape | {"xref": x, "yref": f"{y} domain"}
    return shape | {"xref": f"{x} domain", "yref": y}


def _layout(figure: Figure, placing: Placing, shapes: list[JSON], scales: dict[str, JSON]) -> JSON:
    unified = figure.shares_time and all(len(panel.marks) <= MAX_UNIFIED for panel in figure.panels)
    layout: JSON = {
        **laid_out(placing),
        "shapes": shapes,
        "annotations": [
            _heading(panel, number) for number, panel in enumerate(figure.panels) if panel.title
        ],
        "hovermode": "x unified" if unified else "closest",
        "showlegend": False,
        "legend": {"groupclick": "togglegroup"},
        "meta": {"axes": axis_keys(len(figure.panels)), "time": figure.shares_time},
    }
    for name, scale in scales.items():
        layout[name] = scale | {"colorbar": scale["colorbar"] | placing.bar(name)}
    return layout


def _heading(panel: Panel, number: int) -> JSON:
    return {
        "text": plain(panel.title),
        "xref": f"{axis_name('x', number)} domain",
        "yref": f"{axis_name('y', number)} domain",
        "x": 0,
        "y": 1,
        "xanchor": "left",
        "yanchor": "bottom",
        "yshift": 2,
        "showarrow": False,
        "font": {"size": 12, "weight": 600},
    }
