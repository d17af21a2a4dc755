"""A report as PDF: A4, with an outline, tables over several pages, and figures in the text."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

from PIL import Image

from rbstab.report.model.document import Animation, Block, Cards, Report, Section, Table
from rbstab.report.model.figure import Figure
from rbstab.report.writers.matplotlib_figures.renderer import WIDTH
from rbstab.report.writers.matplotlib_figures.stills import stills_png
from rbstab.report.writers.motion_caption import stills_caption
from rbstab.report.writers.pdf_cards import write_cards
from rbstab.report.writers.pdf_figures import MILLIMETRES_PER_INCH, FigureQueue, Heading
from rbstab.report.writers.pdf_pages import GREY, HEADING, SMALL, Picture, ReportPdf
from rbstab.report.writers.pdf_tables import MIN_HEIGHT, height_needed, needs_landscape, write_table
from rbstab.store.disk.atomic import write_atomically


def write_pdf(report: Report, path: Path) -> None:
    """Write a report as PDF, atomically: an error leaves an older file as it was.

    Args:
        report: The report. The PDF has stills in place of each animation.
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
    figures = FigureQueue(pdf)
    for section in report.sections:
        _write_section(pdf, section, figures)
    figures.flush()
    if report.unread:
        pdf.heading("Results that could not be read")
        for path, reason in report.unread:
            pdf.paragraph(f"{path}: {reason}")
    pdf.ensure_orientation()
    pdf.ln(3)
    pdf.paragraph(f"Made {report.made} by", size=SMALL, colour=GREY)
    pdf.paragraph(report.command, size=SMALL, colour=GREY)
    return pdf.to_bytes()


def _write_section(pdf: ReportPdf, section: Section, figures: FigureQueue) -> None:
    """Write a section, with its heading on the same page as its first block."""
    first, *others = section.blocks or ("",)
    if isinstance(first, Figure):
        figures.add(first, Heading(section.title, section.name))
    else:
        figures.flush()
        landscape = isinstance(first, Table) and needs_landscape(pdf, first)
        height = _height_of_start(pdf, section.blocks)
        pdf.heading(section.title, anchor=section.name, landscape=landscape, height=height)
        _write(pdf, first, figures)
    for block in others:
        _write(pdf, block, figures)


def _height_of_start(pdf: ReportPdf, blocks: Sequence[Block]) -> float:
    """Return the height of the texts at the start of a section and the table below them, mm."""
    height = 0.0
    for block in blocks:
        if isinstance(block, str):
            height += pdf.text_height(block)
            continue
        if isinstance(block, Table):
            height += height_needed(pdf, block)
        elif isinstance(block, Animation) and (picture := _stills(block)) is not None:
            height += pdf.height_of(picture)
        break
    # A section as high as a page begins where there is room for some lines.
    return max(height, MIN_HEIGHT) if height <= pdf.eph - HEADING else MIN_HEIGHT


def _write(pdf: ReportPdf, block: Block, figures: FigureQueue) -> None:
    if isinstance(block, Figure):
        figures.add(block)
        return
    figures.flush()
    match block:
        case str():
            pdf.ensure_orientation()
            pdf.paragraph(block)
        case Table():
            write_table(pdf, block)
        case Cards():
            write_cards(pdf, block)
        case Animation():
            _write_stills(pdf, block)


def _write_stills(pdf: ReportPdf, animation: Animation) -> None:
    """Write the stills of an animation; a sentence if it has none."""
    pdf.ensure_orientation()
    picture = _stills(animation)
    if picture is None:
        pdf.paragraph(f"The HTML report animates the motion of {animation.title}.", style="I")
    else:
        pdf.add_picture(picture)


def _stills(animation: Animation) -> Picture | None:
    if not animation.stills:
        return None
    image = Image.open(BytesIO(stills_png(animation))).convert("RGB")
    width = WIDTH * MILLIMETRES_PER_INCH
    return Picture(image, width, stills_caption(animation), f"Motion of {animation.title}")
