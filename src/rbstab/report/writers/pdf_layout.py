"""The layout of a PDF: blocks wait until their page is full, and figures then fill it.

Blocks stay in their order, so that figures are in the order of their numbers.
"""

from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from typing import NamedTuple

from PIL import Image

from rbstab.report.model.figure import Figure
from rbstab.report.writers.matplotlib_figures.renderer import WIDTH, png_of, prepared
from rbstab.report.writers.pdf_pages import MOST_EMPTY, Picture, ReportPdf

MILLIMETRES_PER_INCH = 25.4

MIN_STRETCH, MAX_STRETCH = 0.88, 1.5
"""Smallest and largest factor on the heights of figures, so that they fill a page. Lower figures
have no room for their labels; higher ones look empty."""

LEAST_STRETCH = 0.75
"""The smallest factor where more than `MOST_EMPTY` of a page would be empty otherwise."""


@dataclass(frozen=True)
class Block:
    """A block that waits for its page.

    Args:
        fixed: The height of its texts, mm; of a long block the height that it needs to begin.
        write: Writes it, with its figure so many times as high as it is naturally.
        natural: The natural height of its figure, mm; 0 for none.
        is_long: Whether it goes on on the next pages; what follows is below it.
        landscape: Whether it needs landscape pages.
        extra: The height beyond `fixed` that it should have where it begins, so that it is not
            broken there, if this does not leave too much of a page empty, mm.
    """

    fixed: float
    write: Callable[[float], None]
    natural: float = 0.0
    is_long: bool = False
    landscape: bool = False
    extra: float = 0.0


class Page(NamedTuple):
    """The heights of the blocks of a page, mm: of their texts, and of their figures naturally."""

    fixed: float
    natural: float

    def fits(self, room: float, least: float = MIN_STRETCH) -> bool:
        """Whether the blocks fit in a room, mm, if figures may shrink to a share."""
        return self.fixed + least * self.natural <= room

    def stretch(self, room: float, largest: float, least: float = MIN_STRETCH) -> float:
        """Return the factor on the heights of figures with which the blocks fill a room, mm."""
        if not self.natural:
            return 1.0
        # Half a millimetre less, so that round-off does not start a new page.
        return min(max((room - self.fixed - 0.5) / self.natural, least), largest)


class PageQueue:
    """The blocks that wait until it is known what fits on their page.

    Args:
        pdf: The document.
    """

    def __init__(self, pdf: ReportPdf) -> None:
        self.pdf = pdf
        self._waiting: list[Block] = []
        self._least = MIN_STRETCH

    def add(self, block: Block) -> None:
        """Add a block.

        If it does not fit on the page any more, the waiting blocks are written: with figures so
        high that they fill the page.
        """
        if block.landscape:
            self._write(MAX_STRETCH)
            self.pdf.ensure_orientation(landscape=True)
            if block.fixed > self.pdf.room:
                self.pdf.add_page(same=True)
            block.write(1.0)
            return
        if not self._waiting:
            self.pdf.ensure_orientation()
        if not self._fits(block):
            self._leave_page()
        self._waiting.append(block)
        if block.is_long:
            self._write(1.0, block.extra)

    def flush(self) -> None:
        """Write the waiting blocks, with figures in their natural height if they fit."""
        self._write(1.0)

    def _fits(self, block: Block) -> bool:
        room = self.pdf.room
        together = _page([*self._waiting, block])
        if together.fits(room - block.extra, self._least):
            return True
        # How high the figures become without the block, and what is then left of the page.
        page = _page(self._waiting)
        filled = page.fixed + page.stretch(room, MAX_STRETCH, self._least) * page.natural
        if room - filled <= MOST_EMPTY * self.pdf.eph:
            return False
        if not together.fits(room, self._least) and together.fits(room, LEAST_STRETCH):
            self._least = LEAST_STRETCH
        return together.fits(room, self._least)

    def _leave_page(self) -> None:
        """Write the waiting blocks so that they fill the page, and begin a new one."""
        self._write(MAX_STRETCH)
        if not self.pdf.is_at_top:
            self.pdf.add_page()

    def _write(self, largest: float, extra: float = 0.0) -> None:
        """Write all waiting blocks, with figures at most so many times as high as naturally.

        They are lower if the last block then has so much more room, mm.
        """
        blocks, self._waiting = self._waiting, []
        room = self.pdf.room
        kept = extra if _page(blocks).fits(room - extra, self._least) else 0.0
        stretch = _page(blocks).stretch(room - kept, largest, self._least)
        self._least = MIN_STRETCH
        for block in blocks:
            block.write(stretch)


def _page(blocks: list[Block]) -> Page:
    return Page(sum(block.fixed for block in blocks), sum(block.natural for block in blocks))


def figure_block(pdf: ReportPdf, figure: Figure, number: int) -> Block:
    """Return the block of a figure with its caption.

    Args:
        pdf: The document.
        figure: The figure.
        number: Its number.
    """
    source = f" ({figure.source})" if figure.source else ""
    caption = f"Figure {number}. {figure.title}{source}. {figure.caption}".strip()
    drawing = prepared(figure)
    natural = float(drawing.get_figheight())

    def write(stretch: float) -> None:
        png = png_of(drawing, natural * stretch)
        image = Image.open(BytesIO(png)).convert("RGB")
        width = WIDTH * MILLIMETRES_PER_INCH
        pdf.add_picture(Picture(image, width, caption, figure.title))

    return Block(pdf.caption_height(caption), write, natural * MILLIMETRES_PER_INCH)
