"""Figures of a PDF: as many on a page as fit, and as high as the page allows."""

from io import BytesIO
from itertools import count
from typing import NamedTuple

from matplotlib.figure import Figure as Drawing
from PIL import Image

from rbstab.report.model.figure import Figure
from rbstab.report.writers.matplotlib_figures.renderer import WIDTH, png_of, prepared
from rbstab.report.writers.pdf_pages import Picture, ReportPdf

MILLIMETRES_PER_INCH = 25.4

MIN_STRETCH, MAX_STRETCH = 0.88, 1.5
"""Smallest and largest factor on the heights of figures, so that they fill a page. Lower figures
have no room for their labels; higher ones look empty."""


class Heading(NamedTuple):
    """The heading of a section: its text, and its anchor."""

    text: str
    anchor: str


class Waiting(NamedTuple):
    """A figure that waits for its page.

    Attributes:
        drawing: The figure.
        caption: Its caption, with its number.
        title: Its title.
        heading: The heading above it; None for none.
    """

    drawing: Drawing
    caption: str
    title: str
    heading: Heading | None

    @property
    def height(self) -> float:
        """The natural height of the figure, mm."""
        return float(self.drawing.get_figheight()) * MILLIMETRES_PER_INCH


class FigureQueue:
    """The figures that wait until it is known how many of them fit on the page.

    Args:
        pdf: The document.
    """

    def __init__(self, pdf: ReportPdf) -> None:
        self.pdf = pdf
        self._waiting: list[Waiting] = []
        self._numbers = count(1)

    def add(self, figure: Figure, heading: Heading | None = None) -> None:
        """Add a figure, with a heading above it.

        If it does not fit on the page any more, the waiting figures are written: so high that they
        fill the page.
        """
        source = f" ({figure.source})" if figure.source else ""
        caption = f"Figure {next(self._numbers)}. {figure.title}{source}. {figure.caption}".strip()
        new = Waiting(prepared(figure), caption, figure.title, heading)
        self.pdf.ensure_orientation()
        if self._fits([*self._waiting, new]):
            self._waiting.append(new)
            return
        if self._waiting:
            self._write(MAX_STRETCH)
        if not self.pdf.is_at_top:
            self.pdf.add_page()
        self._waiting = [new]

    def flush(self) -> None:
        """Write the waiting figures, in their natural height if they fit."""
        if self._waiting:
            self._write(1.0)

    def _fits(self, figures: list[Waiting]) -> bool:
        return self._fixed(figures) + MIN_STRETCH * _natural(figures) <= self.pdf.room

    def _fixed(self, figures: list[Waiting]) -> float:
        """Return the height of captions and headings, mm."""
        captions = sum(self.pdf.caption_height(figure.caption) for figure in figures)
        return captions + sum(
            self.pdf.heading_height(figure.heading.text) for figure in figures if figure.heading
        )

    def _write(self, largest: float) -> None:
        """Write all waiting figures, at most so many times as high as they are naturally."""
        figures, self._waiting = self._waiting, []
        # Half a millimetre less, so that round-off does not start a new page.
        room = self.pdf.room - self._fixed(figures) - 0.5
        stretch = min(max(room / _natural(figures), MIN_STRETCH), largest)
        for figure in figures:
            if figure.heading:
                self.pdf.heading(figure.heading.text, anchor=figure.heading.anchor, height=0.0)
            height = figure.height * stretch / MILLIMETRES_PER_INCH
            image = Image.open(BytesIO(png_of(figure.drawing, height))).convert("RGB")
            width = WIDTH * MILLIMETRES_PER_INCH
            self.pdf.add_picture(Picture(image, width, figure.caption, figure.title))


def _natural(figures: list[Waiting]) -> float:
    return sum(figure.height for figure in figures)
