"""Where the panels of a figure stand in plotly's drawing, and how their axes look."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from rbstab.report.model.figure import Axis, Cells, Figure, Panel
from rbstab.report.writers.plotly_figures.text import plain, tick

JSON = dict[str, Any]

LEFT, RIGHT, TOP = 72, 12, 10
"""Room beside the panels for the vertical axis, for the last tick, and above, px."""

TITLE, TICKS, LABEL, BAR = 24, 24, 22, 96
"""Room for a panel's title, for ticks, for the words at a horizontal axis, for a scale, px."""

HEIGHTS = {True: 320, False: 210}
"""Heights of a panel: by itself, and among others, px."""


def axis_name(letter: str, number: int) -> str:
    """The name by which plotly knows an axis of a panel: x, x2, x3, ..."""
    return letter if number == 0 else f"{letter}{number + 1}"


def axis_keys(count: int) -> list[str]:
    """The keys of all axes in a layout."""
    return [
        f"{letter}axis{number + 1 if number else ''}" for number in range(count) for letter in "xy"
    ]


@dataclass(frozen=True)
class Placing:
    """The panels of a figure on a sheet.

    Args:
        figure: The figure.
        columns: How many panels stand side by side.
        width: Of the sheet, px; on a wider one everything but the heights grows with it.
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
        """The height of the sheet, px."""
        return TOP + sum(sum(self._room(row)) for row in range(self.rows))

    def is_lowest(self, number: int) -> bool:
        """Whether no panel of the same column stands below."""
        return number + self.columns >= len(self.figure.panels)

    def across(self, number: int) -> list[float]:
        """From where to where a panel goes, as parts of what is between the margins."""
        inner = self.width - LEFT - RIGHT
        gap = LEFT + RIGHT
        pitch = (inner + gap) / self.columns
        begin = (number % self.columns) * pitch
        end = begin + pitch - gap - (BAR if self._has_bar(number) else 0)
        return [begin / inner, end / inner]

    def upwards(self, number: int) -> list[float]:
        """From where to where a panel goes, from below."""
        row = number // self.columns
        above = sum(sum(self._room(other)) for other in range(row)) + self._room(row)[0]
        inner = self.height - TOP - self.below
        begin = 1 - (above + self._room(row)[1]) / inner
        return [max(begin, 0.0), min(1 - above / inner, 1.0)]

    def bar(self, name: str) -> JSON:
        """Where the scale of a panel stands, given the name of its colour axis."""
        number = int(name.removeprefix("coloraxis") or 1) - 1
        low, high = self.upwards(number)
        place = {"x": self.across(number)[1], "xanchor": "left", "xpad": 8, "thickness": 14}
        return place | {"y": (low + high) / 2, "len": high - low, "lenmode": "fraction", "ypad": 0}

    def _panels(self, row: int) -> tuple[Panel, ...]:
        return self.figure.panels[row * self.columns : (row + 1) * self.columns]

    def _has_bar(self, number: int) -> bool:
        # All of a column, so that panels stand one under the other.
        column = self.figure.panels[number % self.columns :: self.columns]
        return any(isinstance(mark, Cells) for panel in column for mark in panel.marks)

    def _room(self, row: int) -> tuple[int, int, int]:
        """Above the panels of a row, they themselves, and below them, px."""
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
        """Room under the lowest row, px."""
        return self._room(self.rows - 1)[2]


def laid_out(placing: Placing) -> JSON:
    """The part of a layout that places the panels, with their axes."""
    layout: JSON = {
        "height": placing.height,
        "margin": {"l": LEFT, "r": RIGHT, "t": TOP, "b": placing.below, "pad": 0},
        "font": {"size": 12},
    }
    for number, panel in enumerate(placing.figure.panels):
        for letter, axis in (("x", panel.x), ("y", panel.y)):
            key = f"{letter}axis{number + 1 if number else ''}"
            layout[key] = _axis(axis) | _place(placing, panel, number, letter)
    return layout


def _place(placing: Placing, panel: Panel, number: int, letter: str) -> JSON:
    x, y = axis_name("x", number), axis_name("y", number)
    if letter == "y":
        place: JSON = {"anchor": x, "domain": placing.upwards(number), "title": {"standoff": 8}}
        place["title"] |= {"text": plain(panel.y.text)}
        # Long ticks would stand upon the words: at the edge of a sheet, those find no more room.
        place["automargin"] = "left" if number % placing.columns == 0 else False
        if panel.equal:
            place |= {"scaleanchor": x, "scaleratio": 1}
        return place
    place = {"anchor": y, "domain": placing.across(number)}
    if panel.equal:
        place["constrain"] = "domain"
    if placing.figure.shares_time:
        if number:
            place["matches"] = "x"
        if not placing.is_lowest(number):
            place["title"] = {"text": ""}
    return place


def _axis(axis: Axis) -> JSON:
    look: JSON = {
        "title": {"text": plain(axis.text), "standoff": 6},
        "type": "log" if axis.log else "linear",
        # Powers of ten are too wide for ticks but where they are the ticks.
        "exponentformat": "power" if axis.log else "SI",
        "zeroline": not axis.log,
        "showline": True,
        "ticks": "outside",
        "ticklen": 4,
    }
    if axis.words:
        look |= {
            "tickvals": list(range(len(axis.words))),
            "ticktext": [tick(word) for word in axis.words],
        }
    return look
