"""The axes of the panels of a figure, in plotly's layout."""

from collections.abc import Sequence

from rbstab.report.model.figure import Panel, Shares
from rbstab.report.writers.plotly_figures.axes import (
    TITLE_FONT,
    axis_settings,
    few_ticks,
    only_powers,
)
from rbstab.report.writers.plotly_figures.panel_grid import (
    JSON,
    LEFT,
    RIGHT,
    PanelGrid,
    axis_name,
)
from rbstab.report.writers.plotly_figures.text import escaped


def panel_layout(grid: PanelGrid) -> JSON:
    """Return the part of plotly's layout with the margins and the axes of all panels."""
    layout: JSON = {
        "height": grid.height,
        "margin": {"l": LEFT, "r": RIGHT, "t": grid.top, "b": grid.below, "pad": 0},
        "font": {"size": 12},
    }
    if any(isinstance(mark, Shares) for panel in grid.figure.panels for mark in panel.marks):
        # A count that is wider than its part of a bar is not shown.
        layout |= {"barmode": "stack", "uniformtext": {"minsize": 11, "mode": "hide"}}
    for number, panel in enumerate(grid.figure.panels):
        for letter in "xy":
            key = f"{letter}axis{number + 1 if number else ''}"
            shown = grid.figure.panels if letter in grid.figure.shared else (panel,)
            layout[key] = axis_settings(panel, letter, shown)
            layout[key] |= _position(grid, panel, number, letter)
            if letter == "x":
                layout[key] |= only_powers(panel, layout[key], grid.panel_width(number))
        words = grid.words(number)
        if words:
            key = f"xaxis{number + 1 if number else ''}"
            layout[key] |= {"ticktext": list(words.texts), "tickangle": words.angle}
    return layout


def _position(grid: PanelGrid, panel: Panel, number: int, letter: str) -> JSON:
    x, y = axis_name("x", number), axis_name("y", number)
    if letter == "y":
        position: JSON = {
            "anchor": x,
            "domain": grid.y_domain(number),
            "title": {"standoff": 8} | TITLE_FONT,
        }
        position["title"] |= {"text": _lines(grid.own_title(number, "y"))}
        # At the left edge, plotly may widen the margin: long tick labels would overlap the label.
        position["automargin"] = "left" if number % grid.columns == 0 else False
        if panel.equal:
            position |= {"scaleanchor": x, "scaleratio": 1}
        if "y" in grid.figure.shared and number:
            position["matches"] = "y"
        if "y" in grid.titles:
            first = number % grid.columns == 0
            position["showticklabels"] = first
            # Each row has its title, which moves aside for wide tick labels.
            if not first:
                position["title"] = {"text": ""}
        return position
    position = {"anchor": y, "domain": grid.x_domain(number)}
    if grid.figure.small:
        own = _lines(grid.own_title(number, "x"))
        position |= {"title": {"text": own, "standoff": 6} | TITLE_FONT} | few_ticks(panel)
    if panel.equal:
        position["constrain"] = "domain"
    if "x" in grid.figure.shared and number:
        position["matches"] = "x"
    if "x" in grid.titles:
        lowest = grid.is_lowest(number)
        own = _lines(grid.own_title(number, "x")) if grid.has_gap and lowest else ""
        position |= {
            "title": {"text": own, "standoff": 6} | TITLE_FONT,
            "showticklabels": grid.columns == 1 or lowest,
        }
    if grid.figure.shares_time:
        if number:
            position["matches"] = "x"
        if not grid.is_lowest(number):
            position["title"] = {"text": ""}
    return position


def _lines(lines: Sequence[str]) -> str:
    """Return the lines of a title as plotly's text."""
    return "<br>".join(map(escaped, lines))
