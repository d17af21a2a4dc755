"""Figures for paper, by matplotlib: as wide as the text of an A4 page, legends beside the data."""

import math
import textwrap
import warnings
from contextlib import AbstractContextManager
from io import BytesIO

import matplotlib as mpl
import matplotlib.style
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import MaxNLocator

from rbstab.report.model.figure import Axis, Cells, Figure, Level, Panel
from rbstab.report.writers.decimate import decimated
from rbstab.report.writers.matplotlib_figures.marks import draw

WIDTH = 6.7
"""in: the text of an A4 page."""

MAX_HEIGHT = 9.0
"""in: what a page can hold beside a caption."""

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
}

LETTERS = 0.57
"""The mean width of a letter, as a part of the size of its type."""


def drawn(figure: Figure) -> Drawing:
    """A figure, drawn.

    Args:
        figure: What it shows. Its title and caption are left to the text around it.
    """
    with _style():
        return _drawn(figure)


def png(figure: Figure, *, dpi: float = 200.0) -> bytes:
    """A figure as a PNG.

    Args:
        figure: What it shows.
        dpi: Dots to an inch; the figure is 170 mm wide.
    """
    buffer = BytesIO()
    with _style(), warnings.catch_warnings():
        # A letter that the type lacks is shown as a box: no reason to fail, or to tell a terminal.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        _drawn(decimated(figure)).savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def _style() -> AbstractContextManager[None]:
    """The look of all figures, whatever the settings of this machine or process are."""
    return mpl.style.context(["default", STYLE])


def _drawn(figure: Figure) -> Drawing:
    columns = max(1, min(figure.columns, len(figure.panels)))
    rows = max(1, math.ceil(len(figure.panels) / columns))
    height = _panel_height(figure, rows, columns)
    drawing = Drawing()
    FigureCanvasAgg(drawing)
    handles: dict[str, Artist] = {}
    first: Axes | None = None
    for number, panel in enumerate(figure.panels):
        axes = drawing.add_subplot(rows, columns, number + 1, sharex=first)
        first = (first or axes) if figure.shares_time else None
        handles = handles | _filled(axes, panel, (WIDTH / columns, height)) | handles
        if figure.shares_time and number + columns < len(figure.panels):
            axes.set_xlabel("")
            axes.tick_params(labelbottom=False)
    drawing.align_ylabels()
    levels = {
        mark.label for panel in figure.panels for mark in panel.marks if isinstance(mark, Level)
    }
    entries = sorted(handles.items(), key=lambda entry: entry[0] in levels)
    drawing.set_size_inches(WIDTH, rows * height + _legend(drawing, entries))
    return drawing


def _panel_height(figure: Figure, rows: int, columns: int) -> float:
    maps = any(isinstance(mark, Cells) for panel in figure.panels for mark in panel.marks)
    words = any(panel.x.words for panel in figure.panels)
    # Of figures with many rows two fit on a page; but maps are no bands, and words may slant.
    natural = 2.0 if rows < 3 or maps or words else 1.3
    if rows == columns == 1:
        natural = 2.8
    return min(natural, MAX_HEIGHT / rows)


def _filled(axes: Axes, panel: Panel, size: tuple[float, float]) -> dict[str, Artist]:
    width, height = size
    _scale(axes, panel, 0.8 * width)
    handles = {
        label: handle
        for mark in panel.marks
        for label, handle in draw(mark, axes, panel).items()
        if label
    }
    axes.set_xlabel(_wrapped(panel.x.text, 2.6))
    # Beside the data, not beside the gap between panels.
    axes.set_ylabel(_wrapped(panel.y.text, 0.92 * height))
    if panel.title:
        axes.set_title(literal(panel.title))
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
    axes.margins(x=0.02)
    return handles


def _scale(axes: Axes, panel: Panel, width: float) -> None:
    for axis, name in ((panel.x, "x"), (panel.y, "y")):
        ruler = getattr(axes, f"{name}axis")
        if axis.log:
            getattr(axes, f"set_{name}scale")("log")
        elif axis.words:
            _write(axes, name, axis, width)
        else:
            ruler.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 5, 10]))


def _write(axes: Axes, name: str, axis: Axis, width: float) -> None:
    """Words as ticks; slanting where they would run into each other, given the width, in."""
    ruler = getattr(axes, f"{name}axis")
    ruler.set_ticks(range(len(axis.words)), [literal(word) for word in axis.words])
    getattr(axes, f"set_{name}lim")(-0.5, len(axis.words) - 0.5)
    if name == "y":
        return
    longest = max(map(len, axis.words)) + 1
    if longest * len(axis.words) * LETTERS * mpl.rcParams["xtick.labelsize"] / 72 > width:
        for label in ruler.get_ticklabels():
            label.set(rotation=25, ha="right", rotation_mode="anchor")


def _legend(drawing: Drawing, entries: list[tuple[str, Artist]]) -> float:
    """Writes the legend of a figure over its panels, and says how much height it takes, in."""
    if not entries:
        return 0.0
    size = float(mpl.rcParams["legend.fontsize"])
    longest = max(len(label) for label, _ in entries)
    entry_width = (longest * LETTERS + 4.5) * size / 72
    columns = max(1, min(len(entries), int(WIDTH / entry_width)))
    legend = drawing.legend(
        [handle for _, handle in entries],
        ["entry"] * len(entries),
        loc="outside upper center",
        ncols=columns,
        columnspacing=1.5,
        borderaxespad=0.2,
    )
    # Afterwards: some versions of matplotlib hide a label that begins with _.
    for text, (label, _) in zip(legend.get_texts(), entries, strict=True):
        text.set_text(literal(label))
    return math.ceil(len(entries) / columns) * 1.5 * size / 72 + 0.1


def _wrapped(text: str, length: float) -> str:
    letters = int(length * 72 / (LETTERS * mpl.rcParams["axes.labelsize"]))
    # A unit stays beside its symbol.
    lines = textwrap.wrap(text.replace(" [", "\N{NO-BREAK SPACE}["), max(letters, 12))
    return literal("\n".join(lines))


def literal(text: str) -> str:
    """A text in which matplotlib finds no mathematics."""
    return text.replace("$", r"\$")
