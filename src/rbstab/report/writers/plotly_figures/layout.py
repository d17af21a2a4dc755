"""Layout of a figure in plotly: the positions of its panels, and their axes."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from rbstab.report.model.figure import Axis, Cells, Figure, Panel
from rbstab.report.writers.plotly_figures.text import escaped, tick_label

JSON = dict[str, Any]

LEFT, RIGHT, TOP = 72, 12, 10
"""Margins, px: left for the labels of the vertical axis, right for the last tick label, top."""

TITLE, TICKS, LABEL, COLORBAR = 24, 24, 22, 96
"""Space for a panel title, for ticks, for a horizontal axis label, for a colour bar, px."""

HEIGHTS = {True: 320, False: 210}
"""Heights of a panel, px: in a figure with one row of panels (True), or with more (False)."""


def axis_name(letter: str, number: int) -> str:
    """Return the name that plotly gives to an axis of a panel: x, x2, x3, ..."""
    return letter if number == 0 else f"{letter}{number + 1}"


def axis_keys(count: int) -> list[str]:
    """Return the keys of all axes in a layout."""
    return [
        f"{letter}axis{number + 1 if number else ''}" for number in range(count) for letter in "xy"
    ]


@dataclass(frozen=True)
class PanelGrid:
    """The grid of the panels of a figure.

    Args:
        figure: The figure.
        columns: Number of panels side by side.
        width: Width of the whole figure, px. In a wider window plotly scales the widths only.
    """

    figure: Figure
    columns: int
    width: int

    @cached_property
    def rows(self) -> int:
        """The number of rows."""
        return -(-len(self.figure.panels) // self.columns)

    @cached_property
    def height(self) -> int:
        """The height of the whole figure, px."""
        return TOP + sum(sum(self._row_heights(row)) for row in range(self.rows))

    def is_lowest(self, number: int) -> bool:
        """Return whether a panel is the lowest of its column."""
        return number + self.columns >= len(self.figure.panels)

    def x_domain(self, number: int) -> list[float]:
        """Return the horizontal domain of a panel, in fractions of the width inside the margins."""
        inner = self.width - LEFT - RIGHT
        gap = LEFT + RIGHT
        pitch = (inner + gap) / self.columns
        begin = (number % self.columns) * pitch
        end = begin + pitch - gap - (COLORBAR if self._has_colorbar(number) else 0)
        return [begin / inner, end / inner]

    def y_domain(self, number: int) -> list[float]:
        """Return the vertical domain of a panel, in fractions of the height inside the margins."""
        row = number // self.columns
        above = (
            sum(sum(self._row_heights(other)) for other in range(row)) + self._row_heights(row)[0]
        )
        inner = self.height - TOP - self.below
        begin = 1 - (above + self._row_heights(row)[1]) / inner
        return [max(begin, 0.0), min(1 - above / inner, 1.0)]

    def colorbar(self, name: str) -> JSON:
        """Return the position of the colour bar that belongs to a colour axis."""
        number = int(name.removeprefix("coloraxis") or 1) - 1
        low, high = self.y_domain(number)
        position = {"x": self.x_domain(number)[1], "xanchor": "left", "xpad": 8, "thickness": 14}
        return position | {
            "y": (low + high) / 2,
            "len": high - low,
            "lenmode": "fraction",
            "ypad": 0,
        }

    def _panels(self, row: int) -> tuple[Panel, ...]:
        return self.figure.panels[row * self.columns : (row + 1) * self.columns]

    def _has_colorbar(self, number: int) -> bool:
        # All panels of a column leave space for a colour bar, so that they are aligned.
        column = self.figure.panels[number % self.columns :: self.columns]
        return any(isinstance(mark, Cells) for panel in column for mark in panel.marks)

    def _row_heights(self, row: int) -> tuple[int, int, int]:
        """Return three heights of a row, px: above its panels, the panels, and below them."""
        panels = self._panels(row)
        above = TITLE if any(panel.title for panel in panels) else 8
        numbers = range(row * self.columns, row * self.columns + len(panels))
        labelled = not self.figure.shares_time or any(self.is_lowest(n) for n in numbers)
        height = HEIGHTS[len(self.figure.panels) <= self.columns]
        if any(panel.equal for panel in panels):
            height = min(int(self.width / self.columns), 420)
        return above, height, TICKS + (LABEL if labelled else 0)

    @property
    def below(self) -> int:
        """Space below the lowest row, px."""
        return self._row_heights(self.rows - 1)[2]


def panel_layout(grid: PanelGrid) -> JSON:
    """Return the part of plotly's layout with the margins and the axes of all panels."""
    layout: JSON = {
        "height": grid.height,
        "margin": {"l": LEFT, "r": RIGHT, "t": TOP, "b": grid.below, "pad": 0},
        "font": {"size": 12},
    }
    for number, panel in enumerate(grid.figure.panels):
        for letter, axis in (("x", panel.x), ("y", panel.y)):
            key = f"{letter}axis{number + 1 if number else ''}"
            layout[key] = _axis(axis) | _position(grid, panel, number, letter)
    return layout


def _position(grid: PanelGrid, panel: Panel, number: int, letter: str) -> JSON:
    x, y = axis_name("x", number), axis_name("y", number)
    if letter == "y":
        position: JSON = {"anchor": x, "domain": grid.y_domain(number), "title": {"standoff": 8}}
        position["title"] |= {"text": escaped(panel.y.text)}
        # At the left edge, plotly may widen the margin: long tick labels would overlap the label.
        position["automargin"] = "left" if number % grid.columns == 0 else False
        if panel.equal:
            position |= {"scaleanchor": x, "scaleratio": 1}
        return position
    position = {"anchor": y, "domain": grid.x_domain(number)}
    if panel.equal:
        position["constrain"] = "domain"
    if grid.figure.shares_time:
        if number:
            position["matches"] = "x"
        if not grid.is_lowest(number):
            position["title"] = {"text": ""}
    return position


def _axis(axis: Axis) -> JSON:
    settings: JSON = {
        "title": {"text": escaped(axis.text), "standoff": 6},
        "type": "log" if axis.log else "linear",
        # Powers of ten are too wide for tick labels, except on logarithmic axes.
        "exponentformat": "power" if axis.log else "SI",
        "zeroline": not axis.log,
        "showline": True,
        "ticks": "outside",
        "ticklen": 4,
    }
    if axis.ends is not None:
        settings |= {"range": list(axis.ends)}
    if axis.categories:
        settings |= {
            "tickvals": list(range(len(axis.categories))),
            "ticktext": [tick_label(label) for label in axis.categories],
        }
    return settings
