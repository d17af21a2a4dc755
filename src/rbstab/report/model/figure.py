"""What a figure shows, without a word on how it is drawn.

A figure is described once, in terms of its panels and their marks, and drawn by any renderer:
`plotly_renderer` for pages, `matplotlib_renderer` for paper. Data stand here as they are; a
renderer may leave out points that nobody could see (`decimate`), and nothing else.
"""

from dataclasses import dataclass

from rbstab.mechanics.numbers import Array


@dataclass(frozen=True)
class Axis:
    """An axis of a panel.

    Args:
        label: What is along it, with its symbol: "contact displacement E".
        unit: SI, as in results; "" or "1": a pure number.
        log: Whether it is logarithmic; what is not positive is then left out.
        words: Where positions 0, 1, 2, ... stand for words, these.
    """

    label: str
    unit: str = ""
    log: bool = False
    words: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The label with its unit, as it stands at the axis."""
        return f"{self.label} [{self.unit}]" if self.unit not in ("", "1") else self.label


@dataclass(frozen=True, eq=False)
class Line:
    """A curve.

    Args:
        x: Shape (n,).
        y: Shape (n,); where it is NaN the curve has a gap.
        label: Its name in the legend; curves of a figure with the same name are shown and hidden
            together, and stand there once.
        colour: Number of its colour in the palette.
        dash: Number of its dash pattern: 0 solid, then dashed, dotted, dash-dotted.
        step: Whether the value stays from one point to the next.
    """

    x: Array
    y: Array
    label: str = ""
    colour: int = 0
    dash: int = 0
    step: bool = False


@dataclass(frozen=True, eq=False)
class Points:
    """Points, each by itself.

    Args:
        x: Shape (n,).
        y: Shape (n,).
        label: Their name in the legend.
        colour: Number of their colour in the palette.
        symbol: Number of their symbol: 0 disc, then cross, open square, open diamond.
        texts: What is said of each point where a page can show it; () for none.
    """

    x: Array
    y: Array
    label: str = ""
    colour: int = 0
    symbol: int = 0
    texts: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Stack:
    """Quantities that add up, one upon the other.

    Args:
        x: Shape (n,).
        parts: Shape (n, k); what is negative is stacked downwards.
        labels: The k names in the legend.
    """

    x: Array
    parts: Array
    labels: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Bars:
    """A histogram.

    Args:
        edges: Shape (n + 1,).
        heights: Shape (n,).
        label: Its name in the legend.
        colour: Number of its colour in the palette.
    """

    edges: Array
    heights: Array
    label: str = ""
    colour: int = 0


@dataclass(frozen=True, eq=False)
class Intervals:
    """Values with intervals around them, drawn as points with error bars.

    Args:
        x: Shape (n,).
        y: Shape (n,).
        low: Lower ends, shape (n,).
        high: Upper ends, shape (n,).
        label: Their name in the legend.
        colour: Number of their colour in the palette.
    """

    x: Array
    y: Array
    low: Array
    high: Array
    label: str = ""
    colour: int = 0


@dataclass(frozen=True, eq=False)
class Cells:
    """A map over two quantities.

    Args:
        x: Middles of the columns, shape (n,), ascending.
        y: Middles of the rows, shape (m,), ascending.
        values: Shape (m, n); NaN leaves a cell empty.
        scale: What the colours mean; with `words`, values are whole numbers that stand for these.
        span: The values at both ends of the colours; None: the least and the greatest of these.
    """

    x: Array
    y: Array
    values: Array
    scale: Axis
    span: tuple[float, float] | None = None


@dataclass(frozen=True)
class Level:
    """A straight line through a whole panel.

    Args:
        value: Where.
        label: What it is, in the legend; "" for none.
        upright: Whether it stands at an x, rather than lies at a y.
    """

    value: float
    label: str = ""
    upright: bool = False


Mark = Line | Points | Stack | Bars | Intervals | Cells | Level


@dataclass(frozen=True)
class Panel:
    """One pair of axes and what is drawn there.

    Args:
        x: The horizontal axis.
        y: The vertical axis.
        marks: What is drawn, the first one at the back.
        title: Over it; "" for none.
        equal: Whether a unit is as long on both axes.
    """

    x: Axis
    y: Axis
    marks: tuple[Mark, ...]
    title: str = ""
    equal: bool = False


@dataclass(frozen=True)
class Figure:
    """A figure.

    Args:
        name: Short, in lower case and hyphens, and its own in a report: names files and anchors.
        title: What it shows.
        panels: Its panels, row by row; those of a column share nothing but `shares_time`.
        columns: How many panels stand side by side where there is room.
        source: Which figure or equation of the paper it corresponds to; "" for none.
        caption: What a reader has to know; "" for nothing.
        shares_time: Whether x is the time of a run in all panels: they zoom together, and a page's
            cursor moves over them.
    """

    name: str
    title: str
    panels: tuple[Panel, ...]
    columns: int = 1
    source: str = ""
    caption: str = ""
    shares_time: bool = False
