"""A report on paper: A4, with an outline, tables that break over pages, and figures in the flow."""

from io import BytesIO
from itertools import count
from pathlib import Path

from PIL import Image

from rbstab.report.model.document import Block, Motion, Report, Section, Table
from rbstab.report.model.figure import Figure
from rbstab.report.writers.matplotlib_figures.renderer import WIDTH, png
from rbstab.report.writers.pdf_pages import GREY, SMALL, Paper, Picture
from rbstab.report.writers.pdf_tables import lies, write_table
from rbstab.store.atomic import write_atomically

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
    write_atomically(path, pdf_of(report), replace=True)


def pdf_of(report: Report) -> bytes:
    """A report as the bytes of a PDF."""
    paper = Paper(report.title, [section.name for section in report.sections])
    try:
        return _written(paper, report)
    finally:
        paper.close_fonts()


def _written(paper: Paper, report: Report) -> bytes:
    paper.add_page()
    paper.paragraph(report.title, style="B", size=18)
    paper.paragraph(f"Made {report.created} by", size=SMALL, colour=GREY)
    paper.paragraph(report.command, size=SMALL, colour=GREY)
    numbers = count(1)
    for section in report.sections:
        _write_section(paper, section, numbers)
    if report.unread:
        paper.heading("What could not be read")
        for path, reason in report.unread:
            paper.paragraph(f"{path}: {reason}")
    return paper.whole()


def _write_section(paper: Paper, section: Section, numbers: "count[int]") -> None:
    """Writes a section; its heading stands on the page of what comes first."""
    first, *others = section.blocks or ("",)
    if isinstance(first, Figure):
        picture = _picture_of(first, next(numbers))
        paper.heading(section.title, anchor=section.name, room=paper.height_of(picture))
        paper.place(picture)
    else:
        lying = isinstance(first, Table) and lies(paper, first)
        paper.heading(section.title, anchor=section.name, lying=lying)
        _write(paper, first, numbers)
    for block in others:
        _write(paper, block, numbers)


def _write(paper: Paper, block: Block, numbers: "count[int]") -> None:
    match block:
        case str():
            paper.turn()
            paper.paragraph(block)
        case Table():
            write_table(paper, block)
        case Figure():
            paper.place(_picture_of(block, next(numbers)))
        case Motion():
            paper.turn()
            paper.paragraph(
                f"The motion of {block.title} can be watched on the page of this report.",
                style="I",
            )


def _picture_of(figure: Figure, number: int) -> Picture:
    image = Image.open(BytesIO(png(figure))).convert("RGB")
    source = f" ({figure.source})" if figure.source else ""
    caption = f"Figure {number}. {figure.title}{source}. {figure.caption}".strip()
    return Picture(image, WIDTH * MILLIMETRES, caption, figure.title)
