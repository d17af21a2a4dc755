"""The grid of the panels of a figure on a page: their places, and the room of their words."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from rbstab.report.model.figure import Cells, Figure, Mark, Panel, Shares
from rbstab.report.writers.plotly_figures.axes import TICK_SIZE, TITLE_FONT
from rbstab.report.writers.plotly_figures.text import escaped
from rbstab.report.writers.plotly_figures.tick_words import (
    LETTER,
    LINE,
    TICKS,
    TickWords,
    tick_lines,
    tick_words,
)

JSON = dict[str, Any]

LEFT, RIGHT, TOP = 72, 12, 10
"""Margins, px: left for the labels of the vertical axis, right for the last tick label, top."""

TITLE, LABEL, COLORBAR = 24, 22, 96
"""Space for a panel title, for a horizontal axis label, for a colour bar, px."""

BAR_TITLE, BAR_ABOVE = 28, 70
"""Space for the title of a colour bar, and for a colour bar above the panels, px."""

CLOSE = 22
"""Space between panels that share their vertical axis, px."""

APART = 36
"""Space between small panels, px: the ticks at their ends have labels."""

HEIGHTS = {True: 320, False: 210}
"""Heights of a panel, px: in a figure with one row of panels (True), or with more (False)."""

SMALL_HEIGHT = 140
"""Height of a panel of a figure of small panels, px."""

MAX_SQUARE = 420
"""Largest height of a panel that is as high as it is wide, px."""

BAR, BETWEEN_BARS = 30, 12
"""Height of a bar of shares with the space below it, and more space for all of them, px."""

TITLE_LETTER, MAX_TITLE_LINES = 6.5, 3
"""Width of a letter of the title of an axis, px, and the largest number of its lines."""

NARROWEST = 0.75
"""The smallest width of a figure in which its layout is used, as a part of the layout's width."""

PHONE = 400
"""A layout of at most this width is not used for a narrower figure, px."""


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
        return self.top + sum(sum(self._row_heights(row)) for row in range(self.rows))

    @property
    def top(self) -> int:
        """Space above the first row, px."""
        return TOP + (BAR_ABOVE if self.bar_is_above else 0)

    @property
    def bar_is_above(self) -> bool:
        """Whether the panels' common colour bar is above them: on a phone, for want of width."""
        return self.has_common_bar and self.columns == 1

    @property
    def has_common_bar(self) -> bool:
        """Whether all panels share one colour bar; maps of words have a legend instead."""
        marks = (mark for panel in self.figure.panels for mark in panel.marks)
        return self.figure.shares_scale and not any(map(_is_of_words, marks))

    @property
    def titles(self) -> str:
        """The axes with one title for all panels; in one column each panel keeps its vertical."""
        if self.rows == self.columns == 1:
            return ""
        return "".join(axis for axis in self.figure.shared if axis == "x" or self.columns > 1)

    @property
    def has_gap(self) -> bool:
        """Whether a cell of the grid is empty. A title for all panels would then be beside some."""
        return len(self.figure.panels) % self.columns > 0

    def is_lowest(self, number: int) -> bool:
        """Return whether a panel is the lowest of its column."""
        return number + self.columns >= len(self.figure.panels)

    def x_domain(self, number: int) -> list[float]:
        """Return the horizontal domain of a panel, in fractions of the width inside the margins."""
        inner = self.width - LEFT - RIGHT
        gap = CLOSE if "y" in self.titles else LEFT + RIGHT
        if self.figure.small:
            gap = APART
        common = self.has_common_bar and not self.bar_is_above
        pitch = (inner + gap - (COLORBAR if common else 0)) / self.columns
        begin = (number % self.columns) * pitch
        end = begin + pitch - gap - (0 if self.figure.shares_scale else self._bar_width)
        return [begin / inner, end / inner]

    def words(self, number: int) -> TickWords | None:
        """Return the labels of the horizontal axis of a panel; None for an axis of numbers."""
        labels = self.figure.panels[number].x.categories
        if not labels:
            return None
        return tick_words(labels, int(self.panel_width(number) / len(labels) / LETTER))

    def panel_width(self, number: int) -> float:
        """Return the least width of a panel, px."""
        begin, end = self.x_domain(number)
        # The narrow layout is as wide as a small phone; a wide one may be scaled down.
        return (end - begin) * (self.width - LEFT - RIGHT) * self._narrowest

    def y_domain(self, number: int) -> list[float]:
        """Return the vertical domain of a panel, in fractions of the height inside the margins."""
        row = number // self.columns
        above = (
            sum(sum(self._row_heights(other)) for other in range(row)) + self._row_heights(row)[0]
        )
        inner = self.height - self.top - self.below
        begin = 1 - (above + self._row_heights(row)[1]) / inner
        return [max(begin, 0.0), min(1 - above / inner, 1.0)]

    def colorbar(self, name: str) -> JSON:
        """Return the position of the colour bar that belongs to a colour axis."""
        number = int(name.removeprefix("coloraxis") or 1) - 1
        size = {"thickness": 14, "lenmode": "fraction", "tickfont": {"size": TICK_SIZE}}
        if self.bar_is_above:
            place = {"orientation": "h", "x": 0.5, "xanchor": "center", "len": 1.0, "xpad": 0}
            inner = self.height - self.top - self.below
            return size | place | {"y": 1 + TITLE / inner, "yanchor": "bottom", "ypad": 0}
        low, high = self.y_domain(number)
        right = self.x_domain(number)[1]
        if self.figure.shares_scale:
            low, right = self.y_domain(len(self.figure.panels) - 1)[0], self._right
        place = {"x": right, "xanchor": "left", "xpad": 8, "ypad": 0}
        return size | place | {"y": (low + high) / 2, "len": high - low}

    @property
    def _right(self) -> float:
        """The right end of all panels, as a fraction of the width inside the margins."""
        return self.x_domain(self.columns - 1)[1]

    def own_title(self, number: int, letter: str) -> list[str]:
        """Return the lines of the title of an axis; beside those of neighbours it has less room."""
        text = getattr(self.figure.panels[number], letter).text
        panel = self.figure.panels[number]
        if letter == "x" and self._has_row_title(number // self.columns):
            return [""]
        low = self.figure.small or (letter == "y" and panel.square)
        beside = self.has_gap or (letter == "y" and self.rows > 1)
        if not low and not (beside and letter in self.titles):
            return [text]
        width = self.panel_width(number)
        # Above each panel, a title has the height of the panel's own title.
        height = self._square_height(number) if panel.square else self._natural_height
        room = width if letter == "x" else height + TITLE
        lines = MAX_TITLE_LINES + (1 if self.figure.small else 0)
        return tick_lines(text, int(room / TITLE_LETTER), lines)

    def common_titles(self) -> list[JSON]:
        """Return the titles of axes that all panels share, or those of a row, as annotations."""
        common: JSON = {"xref": "paper", "yref": "paper", "showarrow": False} | TITLE_FONT
        found = [
            common | self._row_title(row) for row in range(self.rows) if self._has_row_title(row)
        ]
        if self.has_gap:
            return found
        first = self.figure.panels[0]
        if "x" in self.titles:
            ticks = self._tick_height(self.rows - 1)
            place = {"x": self._right / 2, "xanchor": "center", "y": 0, "yanchor": "top"}
            found.append(common | place | {"text": escaped(first.x.text), "yshift": 2 - ticks})
        return found

    def _has_row_title(self, row: int) -> bool:
        """Whether the small panels of a row have one horizontal axis, and so one title."""
        panels = self._panels(row)
        return (
            self.figure.small and len(panels) > 1 and len({panel.x.text for panel in panels}) == 1
        )

    def _row_title(self, row: int) -> JSON:
        """Return the place and the text of the title below a row."""
        first = row * self.columns
        last = first + len(self._panels(row)) - 1
        middle = (self.x_domain(first)[0] + self.x_domain(last)[1]) / 2
        place = {"x": middle, "xanchor": "center", "y": self.y_domain(first)[0], "yanchor": "top"}
        text = escaped(self.figure.panels[first].x.text)
        return place | {"text": text, "yshift": 2 - self._tick_height(row)}

    def _panels(self, row: int) -> tuple[Panel, ...]:
        return self.figure.panels[row * self.columns : (row + 1) * self.columns]

    @cached_property
    def _bar_width(self) -> int:
        """The space for a colour bar beside each panel, px: all panels are equally wide."""
        marks = [(mark, panel) for panel in self.figure.panels for mark in panel.marks]
        maps = [one for one in marks if isinstance(one[0], Cells) and not _is_of_words(one[0])]
        if not maps:
            return 0
        titled = any(has_bar_title(*one) or _is_logarithmic(one[0]) for one in maps)
        return COLORBAR - (0 if titled else BAR_TITLE)

    def _row_heights(self, row: int) -> tuple[int, int, int]:
        """Return three heights of a row, px: above its panels, the panels, and below them."""
        panels = self._panels(row)
        above = TITLE if any(panel.title for panel in panels) else 8
        numbers = range(row * self.columns, row * self.columns + len(panels))
        outer = self.figure.shares_time or "x" in self.titles
        labelled = not outer or any(self.is_lowest(n) for n in numbers)
        height = self._natural_height
        if any(panel.equal for panel in panels):
            height = min(int(self.width / self.columns), 420)
        bars = [len(m.counts) for panel in panels for m in panel.marks if isinstance(m, Shares)]
        if bars:
            height = BAR * max(bars) + BETWEEN_BARS
        if any(panel.square for panel in panels):
            height = self._square_height(row * self.columns)
        lines = max(len(self.own_title(n, "x")) for n in numbers)
        label = LABEL + LINE * (lines - 1) if labelled else 0
        return above, height, self._tick_height(row) + label

    @property
    def _narrowest(self) -> float:
        """The smallest width in which the layout is used, as a part of its width."""
        return 1.0 if self.columns == 1 or self.width <= PHONE else NARROWEST

    @property
    def _natural_height(self) -> int:
        """The height of a panel that is not square, px."""
        return SMALL_HEIGHT if self.figure.small else HEIGHTS[self.rows == 1]

    def _square_height(self, number: int) -> int:
        """Return the height of a panel that is as high as it is wide, px."""
        begin, end = self.x_domain(number)
        return min(int((end - begin) * (self.width - LEFT - RIGHT)), MAX_SQUARE)

    def _tick_height(self, row: int) -> int:
        """Return the space for the tick labels below the panels of a row, px."""
        begin = row * self.columns
        found = (self.words(begin + n) for n in range(len(self._panels(row))))
        return max((words.height for words in found if words), default=TICKS)

    @property
    def below(self) -> int:
        """Space below the lowest row, px."""
        return self._row_heights(self.rows - 1)[2]


def _is_of_words(mark: Mark) -> bool:
    return isinstance(mark, Cells) and bool(mark.scale.categories)


def _is_logarithmic(mark: Mark) -> bool:
    return isinstance(mark, Cells) and mark.scale.log


def has_bar_title(mark: Mark, panel: Panel) -> bool:
    """Return whether the colour bar of a map needs a title: the panel does not have the same."""
    return isinstance(mark, Cells) and mark.scale.text != panel.title
