"""Tables of a PDF: each page repeats the headers, and no table is wider than its page."""

from collections.abc import Sequence
from typing import NamedTuple

from fpdf import FontFace
from fpdf.enums import Align, TableBordersLayout, TableHeadingsDisplay

from rbstab.report.model.document import Cell, Table
from rbstab.report.writers.pdf_pages import BLACK, FAMILY, GREY, LEADING, MARGIN, SMALL, ReportPdf

PORTRAIT, LANDSCAPE = 210.0 - 2 * MARGIN, 297.0 - 2 * MARGIN
"""Maximum width of a table on portrait and landscape pages, mm."""

MIN_HEIGHT = 30.0
"""Minimum height left on a page where a table begins: its title, headers and some rows, mm."""

SETTINGS = (
    *((size, longest) for longest in (50.0, 36.0, 28.0) for size in (8.0, 7.0)),
    *((6.0, longest) for longest in (50.0, 36.0, 28.0)),
)
"""Font sizes, points, and maximum widths of a text, mm, tried in this order; longer texts wrap."""

MAX_WORD_WIDTH = 50.0
"""A column is at least as wide as its longest word, but not wider than this, mm."""

SPLIT_SETTING = SETTINGS[1]
"""Font size and maximum width of a text of a table that is split by columns."""

SHORT_TABLE = 24
"""A table with at most this many rows never gets a landscape page of its own."""

PADDING = 1.2
"""Space to the left and right of a text, mm."""

MAX_LENGTH = 400
"""Maximum number of characters of a cell; a row must fit on a page."""

TONE_COLOURS = {"good": (0, 105, 75), "bad": (175, 55, 0), "warning": (140, 100, 0)}

LINE_COLOUR = (190, 190, 190)


class Fit(NamedTuple):
    """Page orientation, font size (points) and column widths (mm) with which a table fits."""

    landscape: bool
    size: float
    widths: list[float]


def write_table(pdf: ReportPdf, table: Table) -> None:
    """Write a table on portrait pages in the largest font that fits.

    A table that is too wide is split by columns, and each part has the first column. A long one is
    first tried on landscape pages.
    """
    fit = _fit(pdf, table)
    pdf.ensure_orientation(landscape=fit.landscape)
    if pdf.will_page_break(MIN_HEIGHT):
        pdf.add_page(same=True)
    pdf.paragraph(table.title, style="B", size=SMALL + 1)
    if table.note:
        pdf.paragraph(table.note, size=SMALL, colour=GREY)
    for columns in _split_columns(fit.widths, LANDSCAPE if fit.landscape else PORTRAIT):
        _write_part(pdf, table, columns, fit)
    pdf.ln(2)


def needs_landscape(pdf: ReportPdf, table: Table) -> bool:
    """Return whether a table needs landscape pages."""
    return _fit(pdf, table).landscape


def _fit(pdf: ReportPdf, table: Table) -> Fit:
    """Return how a table fits.

    A short table that is too wide for a portrait page is split by columns there: it does not
    interrupt the portrait pages, which would leave two of them half empty.
    """
    is_long = len(table.rows) > SHORT_TABLE
    for landscape, max_width in ((False, PORTRAIT), (True, LANDSCAPE))[: 1 + is_long]:
        for size, longest in SETTINGS:
            fit = Fit(landscape, size, _widths(pdf, table, size, longest))
            if sum(fit.widths) <= max_width:
                return fit._replace(widths=_widened(pdf, table, fit, max_width))
    size, longest = SPLIT_SETTING
    return Fit(is_long, size, _widths(pdf, table, size, longest))


def _widened(pdf: ReportPdf, table: Table, fit: Fit, max_width: float) -> list[float]:
    """Return the widths with the space that is left for the columns whose texts wrap."""
    natural = _widths(pdf, table, fit.size, max_width)
    wanted = [max(n - w, 0.0) for n, w in zip(natural, fit.widths, strict=True)]
    # Round-off must not make the table wider than its page.
    share = min((max_width - 1e-6 - sum(fit.widths)) / (sum(wanted) or 1.0), 1.0)
    return [width + share * more for width, more in zip(fit.widths, wanted, strict=True)]


def _write_part(pdf: ReportPdf, table: Table, columns: Sequence[int], fit: Fit) -> None:
    _, size, widths = fit
    pdf.set_font(FAMILY, size=size)
    pdf.set_text_color(*BLACK)
    pdf.set_draw_color(*LINE_COLOUR)
    with pdf.table(
        width=sum(widths[c] for c in columns),
        col_widths=tuple(widths[c] for c in columns),
        text_align=tuple(Align.R if table.heads[c].numbers else Align.L for c in columns),
        align=Align.L,
        line_height=LEADING * size,
        padding=(0.6, PADDING),
        borders_layout=TableBordersLayout.HORIZONTAL_LINES,
        headings_style=FontFace(emphasis="BOLD"),
        repeat_headings=TableHeadingsDisplay.ON_TOP_OF_EVERY_PAGE,
    ) as pdf_table:
        pdf_table.row([pdf.plain(table.heads[c].text) for c in columns])
        for cells in table.rows:
            row = pdf_table.row()
            for c in columns:
                cell = cells[c]
                colour = TONE_COLOURS.get(cell.tone)
                row.cell(
                    _text(pdf, cell),
                    style=FontFace(color=colour) if colour else None,
                    link=f"#{cell.target}" if cell.target in pdf.anchors else None,
                )
    pdf.ln(2)


def _text(pdf: ReportPdf, cell: Cell) -> str:
    text = pdf.plain(cell.text)
    return text if len(text) <= MAX_LENGTH else f"{text[: MAX_LENGTH - 1]}…"


def _widths(pdf: ReportPdf, table: Table, size: float, longest: float) -> list[float]:
    """Return the widths of the columns, mm; longer texts wrap."""
    widths = []
    for number, head in enumerate(table.heads):
        pdf.set_font(FAMILY, "B", size)
        # A header may wrap between words, but not within a word.
        word = widest = _longest_word(pdf, pdf.plain(head.text))
        pdf.set_font(FAMILY, size=size)
        for text in (_text(pdf, row[number]) for row in table.rows):
            widest = max(widest, pdf.get_string_width(text))
            word = max(word, _longest_word(pdf, text))
        # A long word, such as a path or a digest, is broken nevertheless.
        widest = min(widest, max(longest, min(word, MAX_WORD_WIDTH)))
        widths.append(widest + 0.3 + 2 * PADDING)
    return widths


def _longest_word(pdf: ReportPdf, text: str) -> float:
    """Return the width of the longest word of a text in the current font, mm."""
    return max((pdf.get_string_width(word) for word in text.split()), default=0.0)


def _split_columns(widths: list[float], max_width: float) -> list[list[int]]:
    """Split columns into parts that fit on a page; each part has the first column."""
    parts = [[0]]
    for column in range(1, len(widths)):
        if sum(widths[c] for c in parts[-1]) + widths[column] > max_width and len(parts[-1]) > 1:
            parts.append([0])
        parts[-1].append(column)
    return parts
