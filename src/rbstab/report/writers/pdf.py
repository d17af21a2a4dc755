"""A report as PDF: A4, with an outline, tables over several pages, and figures in the text."""

from io import BytesIO
from itertools import count
from pathlib import Path

from PIL import Image

from rbstab.report.model.document import Animation, Block, Cards, Report, Section, Table
from rbstab.report.model.figure import Figure
from rbstab.report.writers.matplotlib_figures.renderer import WIDTH, png
from rbstab.report.writers.pdf_pages import GREY, SMALL, Picture, ReportPdf
from rbstab.report.writers.pdf_tables import needs_landscape, write_table
from rbstab.store.disk.atomic import write_atomically

MILLIMETRES_PER_INCH = 25.4


def write_pdf(report: Report, path: Path) -> None:
    """Write a report as PDF, atomically: an error leaves an older file as it was.

    Args:
        report: The report. The PDF has a sentence in place of each animation.
        path: The file; its folder must exist.

    Raises:
        OSError: The disk is full, the folder cannot be written, or a similar error.
    """
    write_atomically(path, pdf_of(report), replace=True)


def pdf_of(report: Report) -> bytes:
    """Render a report as PDF."""
    pdf = ReportPdf(report.title, [section.name for section in report.sections])
    try:
        return _render(pdf, report)
    finally:
        pdf.close_fonts()


def _render(pdf: ReportPdf, report: Report) -> bytes:
    pdf.add_page()
    pdf.paragraph(report.title, style="B", size=18)
    pdf.paragraph(f"Made {report.created} by", size=SMALL, colour=GREY)
    pdf.paragraph(report.command, size=SMALL, colour=GREY)
    numbers = count(1)
    for section in report.sections:
        _write_section(pdf, section, numbers)
    if report.unread:
        pdf.heading("Results that could not be read")
        for path, reason in report.unread:
            pdf.paragraph(f"{path}: {reason}")
    return pdf.to_bytes()


def _write_section(pdf: ReportPdf, section: Section, numbers: "count[int]") -> None:
    """Write a section, with its heading on the same page as its first block."""
    first, *others = section.blocks or ("",)
    if isinstance(first, Figure):
        picture = _picture_of(first, next(numbers))
        pdf.heading(section.title, anchor=section.name, height=pdf.height_of(picture))
        pdf.add_picture(picture)
    else:
        landscape = isinstance(first, Table) and needs_landscape(pdf, first)
        pdf.heading(section.title, anchor=section.name, landscape=landscape)
        _write(pdf, first, numbers)
    for block in others:
        _write(pdf, block, numbers)


def _write(pdf: ReportPdf, block: Block, numbers: "count[int]") -> None:
    match block:
        case str():
            pdf.ensure_orientation()
            pdf.paragraph(block)
        case Table():
            write_table(pdf, block)
        case Figure():
            pdf.add_picture(_picture_of(block, next(numbers)))
        case Cards():
            _write_cards(pdf, block)
        case Animation():
            pdf.ensure_orientation()
            pdf.paragraph(f"The HTML report animates the motion of {block.title}.", style="I")


def _write_cards(pdf: ReportPdf, cards: Cards) -> None:
    pdf.ensure_orientation()
    for card in cards.cards:
        pdf.paragraph(card.title, style="B")
        for statement in card.statements:
            pdf.paragraph(f"{statement.question} {statement.word}. {statement.sentence}.")
        if card.facts:
            facts = "; ".join(f"{name}: {value}" for name, value in card.facts)
            pdf.paragraph(f"{facts}.", size=SMALL, colour=GREY)
    if cards.note:
        pdf.paragraph(cards.note, size=SMALL, colour=GREY)


def _picture_of(figure: Figure, number: int) -> Picture:
    image = Image.open(BytesIO(png(figure))).convert("RGB")
    source = f" ({figure.source})" if figure.source else ""
    caption = f"Figure {number}. {figure.title}{source}. {figure.caption}".strip()
    return Picture(image, WIDTH * MILLIMETRES_PER_INCH, caption, figure.title)
