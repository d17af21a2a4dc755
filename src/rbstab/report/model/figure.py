"""The content of a figure, independent of the library that draws it.

A figure consists of panels, and a panel consists of marks. `writers.vega` makes one specification
of it, for pages and for files. A figure holds all data; a drawing leaves out only points that would
not be visible (`decimate`).
"""

from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.words import with_unit

MUTED = 6
"""Number of the colour of what stands back: grey, the last colour of the palette."""

SHARE_ENDS = (-0.03, 1.03)
"""The ends of an axis of fractions: all of it is shown, so that 0.9992 does not look like half."""


@dataclass(frozen=True)
class Axis:
    """An axis of a panel.

    Args:
        label: The quantity with its symbol: "contact displacement E".
        unit: SI, as in results; "" or "1" for a pure number.
        log: Whether it is logarithmic; values at or below zero are then not drawn.
        categories: Labels of the positions 0, 1, 2, ... on an axis of categories; () for numbers.
        ends: The ends of the axis; None for those of the data.
        colours: Numbers of the colours of the categories in the palette; (): 0, 1, 2, ...
        whole: Whether its values are whole numbers, such as counts; its ticks are then, too.
        middle: Of the axis of colours: the value that divides two kinds of values; None for none.
            If there are values of both kinds, its colours diverge from there.
    """

    label: str
    unit: str = ""
    log: bool = False
    categories: tuple[str, ...] = ()
    ends: tuple[float, float] | None = None
    colours: tuple[int, ...] = ()
    whole: bool = False
    middle: float | None = None

    @property
    def text(self) -> str:
        """The label with the unit, as shown at the axis."""
        return with_unit(self.label, self.unit)


@dataclass(frozen=True, eq=False)
class Line:
    """A curve.

    Args:
        x: Shape (n,).
        y: Shape (n,); NaN makes a gap in the curve.
        label: Its name in the legend. Curves of a figure with the same name share one legend
            entry, and are shown and hidden together.
        colour: Number of its colour in the palette.
        dash: Number of its dash pattern: 0 solid, then dashed, dotted, dash-dotted.
        step: Whether the value stays constant from one point to the next.
        cased: Whether it is drawn dark between light edges, so that it shows on areas of any colour
            and on any page. It then has no colour of its own.
        group: The entry of the legend that it shares with curves of other names; it is thin and
            pale, as one of many. "" if it has its own.
    """

    x: Array
    y: Array
    label: str = ""
    colour: int = 0
    dash: int = 0
    step: bool = False
    cased: bool = False
    group: str = ""


@dataclass(frozen=True, eq=False)
class Points:
    """Single points, not connected.

    Args:
        x: Shape (n,).
        y: Shape (n,).
        label: Their name in the legend.
        colour: Number of their colour in the palette.
        symbol: Number of their symbol: 0 disc, then cross, open square, open diamond, open
            triangle that points up, one that points down, plus sign.
        texts: Hover text of each point, shown by HTML pages only; () for none. Lines end with a
            line feed.
        members: Number of the member of a sweep that each point shows; () for none.
        key: Number of the colour of their legend entry, where points of one name have several
            colours; None: their own.
        group: As of a `Line`.
    """

    x: Array
    y: Array
    label: str = ""
    colour: int = 0
    symbol: int = 0
    texts: tuple[str, ...] = ()
    members: tuple[int, ...] = ()
    key: int | None = None
    group: str = ""


@dataclass(frozen=True, eq=False)
class Stack:
    """A stacked area plot of quantities that add up.

    Args:
        x: Shape (n,).
        parts: Shape (n, k); negative values are stacked downwards.
        labels: The k names in the legend.
    """

    x: Array
    parts: Array
    labels: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Band:
    """The area between two curves.

    Args:
        x: Shape (n,).
        low: The lower curve, shape (n,); NaN makes a gap.
        high: The upper curve, shape (n,).
        label: Its name in the legend.
        colour: Number of its colour in the palette.
    """

    x: Array
    low: Array
    high: Array
    label: str = ""
    colour: int = 0


@dataclass(frozen=True, eq=False)
class CellMembers:
    """The members of a sweep in the cells of a map.

    Args:
        counts: Number of members in each cell, integers, shape (m, n).
        shown: Number of the member that stands for the cell, shape (m, n); -1 without a member.
        role: What that member is in a cell of several: "nearest to the median".
        gaps: Why a cell has no value, as an index in `reasons`, shape (m, n); -1: it has a value.
        reasons: The reasons; not all of them need to occur.
    """

    counts: Array
    shown: Array
    role: str
    gaps: Array
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Cells:
    """A map (heat map) over two quantities.

    Args:
        x: Centres of the columns, shape (n,), ascending.
        y: Centres of the rows, shape (m,), ascending.
        values: Shape (m, n); NaN leaves a cell empty.
        scale: The axis of the colours; with `categories`, values are their integer positions.
        span: The values at both ends of the colour scale; None: the smallest and the largest value.
        members: The members in the cells; None if the map is not of a sweep.
    """

    x: Array
    y: Array
    values: Array
    scale: Axis
    span: tuple[float, float] | None = None
    members: CellMembers | None = None


@dataclass(frozen=True)
class Level:
    """A straight line through a whole panel.

    Args:
        value: Its position.
        label: Its name in the legend; "" for none.
        vertical: Whether it is vertical, at an x; otherwise it is horizontal, at a y.
    """

    value: float
    label: str = ""
    vertical: bool = False


@dataclass(frozen=True, eq=False)
class Shares:
    """Parts of a whole: a bar that lies at each category of the vertical axis, divided into parts.

    The horizontal axis is the share of each part; its count is written into it.

    Args:
        counts: Whole numbers, shape (bars, parts).
        labels: Names of the parts in the legend.
        colours: Numbers of their colours in the palette.
    """

    counts: Array
    labels: tuple[str, ...]
    colours: tuple[int, ...]

    @property
    def values(self) -> Array:
        """The share of each part, shape (bars, parts); 0 in a bar without any count."""
        total = self.counts.sum(axis=1, keepdims=True)
        shares: Array = self.counts / np.maximum(total, 1)
        return shares


Mark = Line | Points | Stack | Band | Cells | Level | Shares


@dataclass(frozen=True)
class Panel:
    """One pair of axes and its marks.

    Args:
        x: The horizontal axis.
        y: The vertical axis.
        marks: The marks, from back to front.
        title: Text above the panel; "" for none.
        square: Whether it is as high as it is wide, as a map over two parameters of one kind.
    """

    x: Axis
    y: Axis
    marks: tuple[Mark, ...]
    title: str = ""
    square: bool = False


@dataclass(frozen=True)
class Figure:
    """A figure.

    Args:
        name: Short, in lower case and hyphens, unique in a report: used for files and anchors.
        title: Its title.
        panels: Its panels, row by row; their axes are independent, except under `shares_time`.
        columns: Number of panels side by side, where there is enough room.
        caption: Explanation for the reader; "" for none.
        shares_time: Whether x is the time of a run in all panels. They then zoom together, and an
            HTML page moves its time cursor over them.
        shared: The axes that all panels have in common: "xy", "y" or "". These have the same ends
            and one title. Maps in such panels that have the same scale share one colour bar.
        command: The command that runs a member of the sweep; its number follows. "" for none.
    """

    name: str
    title: str
    panels: tuple[Panel, ...]
    columns: int = 1
    caption: str = ""
    shares_time: bool = False
    shared: str = ""
    command: str = ""

    @property
    def shares_scale(self) -> bool:
        """Whether the maps of all panels have one colour bar in common."""
        maps = [mark for panel in self.panels for mark in panel.marks if isinstance(mark, Cells)]
        scales = {(cells.scale, cells.span) for cells in maps}
        alike = len(scales) == 1 and (maps[0].span is not None or bool(maps[0].scale.categories))
        return bool(self.shared) and len(maps) == len(self.panels) > 1 and alike
