"""A report on paper: A4, with an outline, tables that break over pages, and figures in the flow."""

from io import BytesIO
from itertools import count
from pathlib import Path

from PIL import Image

from rbstab.report.document import Block, Motion, Report, Table
from rbstab.report.figure import Figure
from rbstab.report.matplotlib_renderer import WIDTH, png
from rbstab.report.paper import GREY, SMALL, Paper
from rbstab.report.paper_tables import write_table
from rbstab.store.atomic import write_whole

MILLIMETRES = 25.4
"""To an inch."""


def write_pdf(report: Report, path: Path) -> None:
    """Writes a report as a PDF; the file appears whole or not at all, in place of an older one.

    Args:
        report: The report. Its motions are left out; a sentence says so.
        path: The file; its folder must exist.

    Raises:
        OSError: The disk is full, the folder cannot be written, and the like.
    """
    write_whole(path, pdf_of(report), replace=True)


def pdf_of(report: Report) -> bytes:
    """A report as the bytes of a PDF."""
    paper = Paper(report.title, [section.name for section in report.sections])
    paper.add_page()
    paper.paragraph(report.title, style="B", size=18)
    paper.paragraph(f"Made {report.created} by", size=SMALL, colour=GREY)
    paper.paragraph(report.command, size=SMALL, colour=GREY)
    numbers = count(1)
    for section in report.sections:
        paper.heading(section.title, anchor=section.name)
        for block in section.blocks:
            _write(paper, block, numbers)
    if report.unread:
        paper.heading("What could not be read")
        for path, reason in report.unread:
            paper.paragraph(f"{path}: {reason}")
    return paper.whole()


def _write(paper: Paper, block: Block, numbers: "count[int]") -> None:
    match block:
        case str():
            paper.turn()
            paper.paragraph(block)
        case Table():
            write_table(paper, block)
        case Figure():
            _write_figure(paper, block, next(numbers))
        case Motion():
            paper.turn()
            paper.paragraph(
                f"The motion of {block.title} can be watched on the page of this report.",
                style="I",
            )


def _write_figure(paper: Paper, figure: Figure, number: int) -> None:
    image = Image.open(BytesIO(png(figure))).convert("RGB")
    source = f" ({figure.source})" if figure.source else ""
    caption = f"{figure.title}{source}. {figure.caption}".strip()
    width = min(WIDTH * MILLIMETRES, paper.epw)
    height = width * image.height / image.width
    paper.picture(image, width, height, f"Figure {number}. {caption}", figure.title)
