"""Render figures with matplotlib, with the legend above.

They are as wide as the text of an A4 page, or as one column of a paper.
"""

import math
import textwrap
import warnings
from contextlib import AbstractContextManager
from dataclasses import replace
from io import BytesIO

import matplotlib as mpl
import matplotlib.style
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Drawing

from rbstab.report.model.figure import Cells, Figure, Level, Line, Panel, Points, Shares
from rbstab.report.writers.decimate import decimate
from rbstab.report.writers.matplotlib_figures.marks import draw, draw_colour_bar
from rbstab.report.writers.matplotlib_figures.scales import CHARACTER_WIDTH, escape_math, set_scales

WIDTH = 6.7
"""Width of the text of an A4 page, in."""

COLUMN_WIDTH = 80 / 25.4
"""Width of a column of a paper, 80 mm, in."""

COLUMN_STYLE = {
    "axes.titlesize": 8.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.handlelength": 1.5,
    "legend.handletextpad": 0.5,
    "legend.columnspacing": 0.8,
}
"""The style of a figure as wide as a column: all texts have 8 points, and legends are narrow."""

COLUMN_PANEL = 1.5
"""Height of a panel of such a figure that has several, in."""

MAX_HEIGHT = 9.0
"""Maximum height of a figure, in; leaves space for a caption on the page."""

STYLE = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "axes.titlesize": 8.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "legend.handletextpad": 0.8,
    "legend.columnspacing": 1.5,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e2e2e2",
    "grid.linewidth": 0.6,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "axes.formatter.useoffset": False,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-3, 4),
    "lines.linewidth": 1.2,
    "figure.facecolor": "white",
    "figure.constrained_layout.use": True,
    # Texts stay texts, and the same figure has the same bytes.
    "svg.fonttype": "none",
    "svg.hashsalt": "rbstab",
    "pdf.fonttype": 42,
}

SMALL_TICKS = 6.5
"""Font size of the tick labels of small panels, points."""


def draw_figure(figure: Figure, *, column: bool = False) -> Drawing:
    """Draw a figure.

    Args:
        figure: The figure. Its title and caption are not drawn; the writer sets them as text.
        column: Whether it is as wide as one column of a paper, with its panels below each other.
    """
    with style(column=column):
        if column:
            return _draw(replace(figure, columns=1), COLUMN_WIDTH)
        return _draw(figure)


def png(figure: Figure, *, dpi: float = 200.0, column: bool = False) -> bytes:
    """Render a figure as PNG.

    Args:
        figure: The figure.
        dpi: Dots per inch; the figure is 170 mm wide.
        column: Whether it is 80 mm wide.
    """
    drawn = prepared(figure, column=column)
    return png_of(drawn, drawn.get_figheight(), dpi=dpi, column=column)


def prepared(figure: Figure, *, column: bool = False) -> Drawing:
    """Draw a figure without invisible points, in its natural height."""
    return draw_figure(decimate(figure), column=column)


def png_of(drawn: Drawing, height: float, *, dpi: float = 200.0, column: bool = False) -> bytes:
    """Render a prepared figure as PNG in a height, in."""
    buffer = BytesIO()
    drawn.set_figheight(height)
    with style(column=column), warnings.catch_warnings():
        # A character that the font lacks is drawn as a box; no warning is needed.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        drawn.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def drawing(figure: Figure, form: str, *, column: bool = False) -> bytes:
    """Render a figure as a drawing of lines, without a date: the same figure has the same bytes.

    Args:
        figure: The figure, 170 mm wide.
        form: "svg" or "pdf". Texts stay texts.
        column: Whether it is 80 mm wide.
    """
    date = {"svg": "Date", "pdf": "CreationDate"}[form]
    buffer = BytesIO()
    with style(column=column), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        prepared(figure, column=column).savefig(buffer, format=form, metadata={date: None})
    return buffer.getvalue()


def style(*, column: bool = False) -> AbstractContextManager[None]:
    """Return the style of all figures; it ignores the matplotlib settings of the user."""
    return mpl.style.context(["default", STYLE | COLUMN_STYLE if column else STYLE])


def _draw(figure: Figure, width: float = WIDTH) -> Drawing:
    """Draw a figure in a width, in."""
    columns = max(1, min(figure.columns, len(figure.panels)))
    rows = max(1, math.ceil(len(figure.panels) / columns))
    height = _panel_height(figure, rows, columns, narrow=width < WIDTH)
    drawing = Drawing()
    FigureCanvasAgg(drawing)
    handles: dict[str, Artist] = {}
    every: list[Axes] = []
    for number, panel in enumerate(figure.panels):
        first = every[0] if every else None
        axes = drawing.add_subplot(
            rows,
            columns,
            number + 1,
            sharex=first if figure.shares_time or "x" in figure.shared else None,
            sharey=first if "y" in figure.shared else None,
        )
        every.append(axes)
        # The label of y must not be longer than the panel is high, without the labels of x.
        outer = figure.shares_time or "x" in figure.shared
        label_length = 0.92 * height - (0.0 if outer else 0.25)
        size = (width / columns, label_length)
        handles = handles | _draw_panel(axes, panel, size) | handles
        if figure.small:
            axes.tick_params(labelsize=SMALL_TICKS)
        if figure.shares_time and number + columns < len(figure.panels):
            axes.set_xlabel("")
            axes.tick_params(labelbottom=False)
    _share_titles(drawing, figure, every, columns)
    if figure.small:
        _one_title_a_row(every, columns)
    _draw_colour_bars(figure, every)
    drawing.align_ylabels()
    levels = {
        mark.label for panel in figure.panels for mark in panel.marks if isinstance(mark, Level)
    }
    groups = {
        mark.group
        for panel in figure.panels
        for mark in panel.marks
        if isinstance(mark, Line | Points)
    }
    entries = sorted(handles.items(), key=lambda entry: (entry[0] in levels, entry[0] in groups))
    drawing.set_size_inches(width, rows * height + _add_legend(drawing, entries, width))
    return drawing


def _share_titles(drawing: Drawing, figure: Figure, every: list[Axes], columns: int) -> None:
    """Give the axes that all panels have in common one title, or titles at the edges of a grid.

    In a grid with an empty cell one title would be beside some of the panels.
    """
    if len(every) < 2:
        return
    has_gap = len(every) % columns > 0
    for number, axes in enumerate(every):
        lowest, first = number + columns >= len(every), number % columns == 0
        if "x" in figure.shared:
            axes.set_xlabel(axes.get_xlabel() if has_gap and lowest else "")
            axes.tick_params(labelbottom=lowest)
        if "y" in figure.shared:
            # Each row has its title.
            axes.set_ylabel(axes.get_ylabel() if first else "")
            axes.tick_params(labelleft=first)
    if "x" in figure.shared and not has_gap:
        size = mpl.rcParams["axes.labelsize"]
        drawing.supxlabel(escape_math(figure.panels[0].x.text), fontsize=size)


def _one_title_a_row(every: list[Axes], columns: int) -> None:
    """Keep only the title in the middle of a row of small panels with one horizontal axis."""
    for begin in range(0, len(every), columns):
        row = every[begin : begin + columns]
        if len({axes.get_xlabel() for axes in row}) == 1:
            # A long title has room below its neighbours.
            title = row[0].get_xlabel().replace("\n", " ")
            for number, axes in enumerate(row):
                axes.set_xlabel(title if number == len(row) // 2 else "")


def _draw_colour_bars(figure: Figure, every: list[Axes]) -> None:
    """Draw the colour bars of maps of numbers: one for each, or one for all."""
    for number, panel in enumerate(figure.panels):
        for mark in panel.marks:
            if not isinstance(mark, Cells) or mark.scale.categories:
                continue
            if not figure.shares_scale:
                titled = mark.scale.text != panel.title
                draw_colour_bar(mark, [every[number]], titled=titled)
            elif number == 0:
                draw_colour_bar(mark, every, titled=True)


def _panel_height(figure: Figure, rows: int, columns: int, *, narrow: bool) -> float:
    bars = [len(m.counts) for p in figure.panels for m in p.marks if isinstance(m, Shares)]
    if bars:
        return min(0.28 * max(bars) + 0.6, MAX_HEIGHT / rows)
    has_maps = any(isinstance(mark, Cells) for panel in figure.panels for mark in panel.marks)
    has_categories = any(panel.x.categories for panel in figure.panels)
    # Low panels let two figures with many rows fit on a page. Maps and slanted labels need more.
    natural = 2.0 if rows < 3 or has_maps or has_categories else 1.3
    if any(panel.square for panel in figure.panels):
        natural = 2.5
    if figure.small:
        natural = 1.7
    if rows == columns == 1:
        natural = 2.3 if narrow else 2.8
    elif narrow and not (has_maps or has_categories):
        natural = COLUMN_PANEL
    return min(natural, MAX_HEIGHT / rows)


def _draw_panel(axes: Axes, panel: Panel, size: tuple[float, float]) -> dict[str, Artist]:
    """Draw a panel; size is its width, and the greatest length of its label of y, in."""
    width, label_length = size
    set_scales(axes, panel, 0.8 * width)
    handles = {
        label: handle
        for mark in panel.marks
        for label, handle in draw(mark, axes, panel).items()
        if label
    }
    axes.set_xlabel(_wrap(panel.x.text, min(2.6, 0.8 * width)))
    axes.set_ylabel(_wrap(panel.y.text, label_length))
    if panel.title:
        axes.set_title(escape_math(panel.title))
    if panel.square:
        axes.set_box_aspect(1.0)
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
    if panel.x.split is None:
        # Points at the ends must not be cut in half.
        axes.margins(x=0.05 if any(isinstance(mark, Points) for mark in panel.marks) else 0.02)
    return handles


def _add_legend(drawing: Drawing, entries: list[tuple[str, Artist]], width: float) -> float:
    """Add the legend of a figure of a width above its panels; return its height, in."""
    if not entries:
        return 0.0
    size = float(mpl.rcParams["legend.fontsize"])
    style_of = mpl.rcParams
    beside = float(
        style_of["legend.handlelength"]
        + style_of["legend.handletextpad"]
        + style_of["legend.columnspacing"]
    )
    room = int((width * 72 / size - beside) / CHARACTER_WIDTH)
    labels = [textwrap.fill(label, room) if len(label) > room else label for label, _ in entries]
    longest = max(len(line) for label in labels for line in label.splitlines() or [""])
    entry_width = (longest * CHARACTER_WIDTH + beside) * size / 72
    columns = max(1, min(len(entries), int(width / entry_width)))
    legend = drawing.legend(
        [handle for _, handle in entries],
        ["entry"] * len(entries),
        loc="outside upper center",
        ncols=columns,
        borderaxespad=0.2,
    )
    # Labels are set afterwards: some versions of matplotlib hide a label that starts with _.
    for text, label in zip(legend.get_texts(), labels, strict=True):
        text.set_text(escape_math(label))
    rows = math.ceil(len(entries) / columns) + sum(label.count("\n") for label in labels) / columns
    return rows * 1.4 * size / 72 + 0.1


def _wrap(text: str, length: float) -> str:
    characters = int(length * 72 / (CHARACTER_WIDTH * mpl.rcParams["axes.labelsize"]))
    room = max(characters, 12)
    # Avoid a line break between a symbol and its unit, but not at the cost of one in the symbol.
    together = text.replace(" [", "\N{NO-BREAK SPACE}[")
    fits = max(map(len, together.split(" "))) <= room
    lines = textwrap.wrap(together if fits else text, room)
    return escape_math("\n".join(lines))
