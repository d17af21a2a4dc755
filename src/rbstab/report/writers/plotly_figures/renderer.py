"""Render figures for plotly: as plain dictionaries, which become JSON in a page."""

from typing import Any

from rbstab.report.model.figure import Cells, Figure, Level, Line, Panel, Points
from rbstab.report.model.palette import CASING, colour
from rbstab.report.writers.decimate import decimate
from rbstab.report.writers.plotly_figures.cells import colour_axis
from rbstab.report.writers.plotly_figures.layout import panel_layout
from rbstab.report.writers.plotly_figures.marks import level_shape, traces
from rbstab.report.writers.plotly_figures.page_data import page_data
from rbstab.report.writers.plotly_figures.panel_grid import (
    PanelGrid,
    axis_keys,
    axis_name,
    has_bar_title,
)
from rbstab.report.writers.plotly_figures.split_time import parts_of, split_axes
from rbstab.report.writers.plotly_figures.text import escaped

WIDE, NARROW = 880, 340
"""Widths of the two layouts of a figure, in CSS pixels: for a desktop page, and for a phone."""

MAX_UNIFIED = 8
"""If a panel has more marks than this, the hover label shows only the nearest curve."""

JSON = dict[str, Any]


def plotly_data(figure: Figure) -> JSON:
    """Render a figure for plotly.

    Texts are escaped, since plotly interprets some HTML. Curves with the same label have the same
    `legendgroup` (the label, not escaped). Only the first of them has a legend entry. Curves of
    several names that share an entry have its name as `group` in `meta`.

    Returns:
        `data` and `layout` in plotly's format; `narrow`, a layout in one column, or in two of small
        panels, for a phone. The layouts set no colours except those of the marks. `meta` of a trace
        has the number of its panel and the kind of its mark. More keys are those of `page_data`.
    """
    figure = decimate(figure)
    in_legend: set[str] = set()
    data: list[JSON] = []
    shapes: list[JSON] = []
    scales: dict[str, JSON] = {}
    for number, panel in enumerate(figure.panels):
        parts = (
            part
            for mark in panel.marks
            for part in parts_of(mark, panel, number, len(figure.panels))
        )
        has_map = any(isinstance(mark, Cells) for mark in panel.marks)
        for mark, axis in parts:
            if isinstance(mark, Level):
                shapes.append(_in_panel(level_shape(mark), mark.vertical, axis, number))
                continue
            drawings = traces(mark, panel)
            scale = colour_axis(mark, titled=has_bar_title(mark, panel))
            colours = axis_name("coloraxis", 0 if figure.shares_scale else number)
            for trace in drawings:
                trace |= {"xaxis": axis_name("x", axis), "yaxis": axis_name("y", number)}
                trace["meta"] = {"panel": number, "mark": type(mark).__name__.lower()}
                if isinstance(mark, Line) and mark.cased:
                    trace["meta"]["edges"] = CASING
                if isinstance(mark, Line | Points) and mark.group:
                    trace["meta"]["group"] = mark.group
                if isinstance(mark, Points) and mark.key is not None:
                    trace["meta"]["key"] = colour(mark.key)
                if has_map and not isinstance(mark, Cells):
                    # The pointer is on the cell below.
                    trace["hoverinfo"] = "skip"
            if scale:
                # The first trace of a map is its values; others are cells without a value.
                drawings[0]["coloraxis"] = colours
                scales.setdefault(colours, scale)
            data += drawings
    for entry in (*data, *shapes):
        # The edges of a cased curve are hidden with it, and have no name of their own.
        label = entry.get("legendgroup", "") if entry.get("name") else ""
        label = entry.get("meta", {}).get("group", label)
        entry["showlegend"] = bool(label) and label not in in_legend
        in_legend.add(label)
    layouts = {
        name: _layout(figure, grid, shapes, scales)
        for name, grid in (
            ("layout", PanelGrid(figure, min(figure.columns, len(figure.panels)), WIDE)),
            ("narrow", PanelGrid(figure, 2 if figure.small else 1, NARROW)),
        )
    }
    return {"data": data, **layouts, **page_data(figure)}


def _in_panel(shape: JSON, vertical: bool, axis: int, number: int) -> JSON:
    """Return a line that spans its panel, or a part of it, along the other axis."""
    x, y = axis_name("x", axis), axis_name("y", number)
    if vertical:
        return shape | {"xref": x, "yref": f"{y} domain"}
    return shape | {"xref": f"{x} domain", "yref": y}


def _layout(figure: Figure, grid: PanelGrid, shapes: list[JSON], scales: dict[str, JSON]) -> JSON:
    unified = figure.shares_time and all(len(panel.marks) <= MAX_UNIFIED for panel in figure.panels)
    layout: JSON = {
        **panel_layout(grid),
        "shapes": shapes,
        "annotations": [
            *(_title(panel, number) for number, panel in enumerate(figure.panels) if panel.title),
            *grid.common_titles(),
        ],
        "hovermode": "x unified" if unified else "closest",
        "showlegend": False,
        "legend": {"groupclick": "togglegroup"},
        "meta": {"axes": axis_keys(len(figure.panels)), "time": figure.shares_time},
    }
    for name, scale in scales.items():
        layout[name] = scale
        if "colorbar" in scale:
            bar = scale["colorbar"] | grid.colorbar(name)
            if grid.bar_is_above:
                bar["title"] = bar["title"] | {"side": "top"}
            layout[name] = scale | {"colorbar": bar}
    return split_axes(layout, figure, grid)


def _title(panel: Panel, number: int) -> JSON:
    return {
        "text": escaped(panel.title),
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
