"""A report as PDF: A4, with an outline, tables over several pages, and figures in the text."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

from PIL import Image

from rbstab.report.model import document
from rbstab.report.model.document import Animation, Cards, Report, Section, Table
from rbstab.report.model.figure import Figure
from rbstab.report.writers.matplotlib_figures.renderer import WIDTH
from rbstab.report.writers.matplotlib_figures.stills import stills_png
from rbstab.report.writers.motion_caption import stills_caption
from rbstab.report.writers.pdf_cards import write_cards
from rbstab.report.writers.pdf_layout import (
    MILLIMETRES_PER_INCH,
    Block,
    PageQueue,
    figure_block,
)
from rbstab.report.writers.pdf_pages import GREY, MOST_EMPTY, SMALL, Picture, ReportPdf
from rbstab.report.writers.pdf_tables import MIN_HEIGHT, size_of, write_table
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
    queue, figures = PageQueue(pdf), 0
    blocks = [block for section in report.sections for block in section.blocks]
    motions = [block for block in blocks if isinstance(block, Animation)]
    for section in report.sections:
        for group in _groups(pdf, section):
            figures += isinstance(group.block, Figure)
            queue.add(_below(pdf, group, _block(pdf, group.block, figures, motions)))
    if report.unread:
        texts = tuple(f"{path}: {reason}" for path, reason in report.unread)
        for group in _groups(pdf, Section("", "Results that could not be read", texts)):
            queue.add(_below(pdf, group, _block(pdf, group.block, figures, motions)))
    queue.flush()
    pdf.ensure_orientation()
    pdf.ln(3)
    pdf.paragraph(f"Made {report.made} by", size=SMALL, colour=GREY)
    pdf.paragraph(report.command, size=SMALL, colour=GREY)
    return pdf.to_bytes()


@dataclass(frozen=True)
class Group:
    """What stays together on a page: a heading, the texts below it, and the begin of a block.

    Args:
        block: The last one.
        texts: The texts above it.
        section: The section, if the group begins with its heading.
    """

    block: document.Block
    texts: tuple[str, ...] = ()
    section: Section | None = None


def _groups(pdf: ReportPdf, section: Section) -> Iterator[Group]:
    """Yield the blocks of a section, the first ones together with its heading."""
    blocks = list(section.blocks) or [""]
    count = next((k for k, block in enumerate(blocks) if not isinstance(block, str)), 0)
    texts = tuple(block for block in blocks[:count] if isinstance(block, str))
    if sum(map(pdf.text_height, texts)) > MIN_HEIGHT:
        # So many texts need not stay with what is below them.
        texts, count = (), 0
    yield Group(blocks[count], texts, section)
    yield from (Group(block) for block in blocks[count + 1 :])


def _below(pdf: ReportPdf, group: Group, block: Block) -> Block:
    """Return a block with the heading and the texts of its group above it."""
    section, texts = group.section, group.texts
    if section is None:
        return block

    def write(stretch: float) -> None:
        pdf.heading(section.title, anchor=section.name, height=0.0, landscape=block.landscape)
        for text in texts:
            pdf.paragraph(text)
        block.write(stretch)

    above = pdf.heading_height(section.title) + sum(map(pdf.text_height, texts))
    return replace(block, fixed=block.fixed + above, write=write)


def _block(
    pdf: ReportPdf, block: document.Block, number: int, motions: Sequence[Animation]
) -> Block:
    """Return what is written of a block.

    Args:
        pdf: The document.
        block: The block.
        number: The number of the last figure: this one, if it is a figure.
        motions: All animations of the report.
    """
    match block:
        case Figure():
            return figure_block(pdf, block, number)
        case Table():
            return _table(pdf, block)
        case Cards():
            return Block(MIN_HEIGHT, lambda _: write_cards(pdf, block), is_long=True)
        case Animation():
            return _stills(pdf, block, motions)
        case str():
            return _text(pdf, block)


def _text(pdf: ReportPdf, text: str, style: str = "") -> Block:
    """Return a paragraph; a high one may begin where there is room for some lines."""
    if not text:
        return Block(0.0, lambda _: None)
    height = pdf.text_height(text, style)
    return Block(
        min(height, MIN_HEIGHT),
        lambda _: pdf.paragraph(text, style=style),
        is_long=height > MIN_HEIGHT,
    )


def _table(pdf: ReportPdf, table: Table) -> Block:
    size = size_of(pdf, table)
    is_whole = size.height <= MOST_EMPTY * pdf.eph
    return Block(
        size.height if is_whole else size.begin,
        lambda _: write_table(pdf, table, is_whole=is_whole),
        is_long=not is_whole,
        landscape=size.landscape,
        extra=0.0 if is_whole or size.landscape else size.unbroken - size.begin,
    )


def _stills(pdf: ReportPdf, animation: Animation, motions: Sequence[Animation]) -> Block:
    """Return the stills of an animation; a sentence if it has none."""
    if not animation.stills:
        return _text(pdf, f"The HTML report animates the motion of {animation.title}.", "I")
    image = Image.open(BytesIO(stills_png(animation, motions))).convert("RGB")
    width = WIDTH * MILLIMETRES_PER_INCH
    picture = Picture(image, width, stills_caption(animation), f"Motion of {animation.title}")
    return Block(pdf.height_of(picture), lambda _: pdf.add_picture(picture))
