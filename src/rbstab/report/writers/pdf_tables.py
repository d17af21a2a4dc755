"""Tables of a PDF: each page repeats the headers, and no table is wider than its page."""

import math
from dataclasses import replace
from itertools import accumulate
from typing import NamedTuple

from fpdf import FontFace
from fpdf.enums import Align, MethodReturnValue, TableBordersLayout, TableHeadingsDisplay

from rbstab.report.model.document import MARKS, Cell, Table
from rbstab.report.writers.pdf_pages import (
    BLACK,
    FAMILY,
    GREY,
    LEADING,
    MARGIN,
    MOST_EMPTY,
    SMALL,
    ReportPdf,
)

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

WIDE_TEXT = 100.0
"""Width of a text of many lines in a table that is split by columns, mm."""

KEPT_HEIGHT = MOST_EMPTY * (297.0 - 2 * MARGIN)
"""A table of at most this height is not broken between two pages, mm; a higher one would leave too
much of a page empty. It is broken between rows, and each page has the headers."""

HALF_PAGE = 0.5 * (297.0 - 2 * MARGIN)
"""A higher table need not begin on a new page, mm."""

FEWEST_ROWS = 3
"""Of a table that is broken, each page has at least so many rows."""

MOST_KEPT = 40
"""So many rows are higher than `KEPT_HEIGHT`; more are not measured."""

MOST_LINES = 5
"""A short table is split by columns if a text would need more lines than this."""

PADDING = 1.2
"""Space to the left and right of a text, mm."""

ROW_PADDING = 0.6
"""Space above and below a text, mm."""

MAX_LENGTH = 400
"""Maximum number of characters of a cell; a row must fit on a page."""

TONE_COLOURS = {"good": (0, 105, 75), "bad": (175, 55, 0), "warning": (140, 100, 0)}

LINE_COLOUR = (190, 190, 190)


class Fit(NamedTuple):
    """Page orientation, font size (points) and column widths (mm) with which a table fits."""

    landscape: bool
    size: float
    widths: list[float]


class TableSize(NamedTuple):
    """The room that a table needs, mm.

    Attributes:
        height: Its whole height; infinite if it has so many rows that they are not measured.
        begin: The height that must be left on the page where it begins, if it is broken.
        unbroken: The height with which it is not broken where it begins, or only between its
            columns; that of its begin if it is high.
        landscape: Whether it needs landscape pages.
    """

    height: float
    begin: float
    unbroken: float
    landscape: bool


def write_table(pdf: ReportPdf, table: Table, *, is_whole: bool = False) -> None:
    """Write a table on portrait pages in the largest font that fits.

    A table that is too wide is split by columns, and each part has the first column. A long one is
    first tried on landscape pages.

    Args:
        pdf: The document.
        table: The table.
        is_whole: Whether there is room for all of it; otherwise it may be broken between rows.
    """
    fit = _fit(pdf, table)
    pdf.ensure_orientation(landscape=fit.landscape)
    size = _size(pdf, table, fit)
    if pdf.will_page_break(size.height if is_whole else size.begin):
        pdf.add_page(same=True)
    pdf.paragraph(table.title, style="B", size=SMALL + 1)
    if table.note:
        pdf.paragraph(table.note, size=SMALL, colour=GREY)
    for number, part in enumerate(_parts(pdf, table, fit)):
        _write_part(pdf, table, part, fit.size, below_title=number == 0)
    pdf.ln(2)


def size_of(pdf: ReportPdf, table: Table) -> TableSize:
    """Return how much room a table needs."""
    return _size(pdf, table, _fit(pdf, table))


def _size(pdf: ReportPdf, table: Table, fit: Fit) -> TableSize:
    titles = pdf.text_height(table.title, "B", SMALL + 1)
    if table.note:
        titles += pdf.text_height(table.note, "", SMALL)
    parts = _parts(pdf, table, fit)
    if len(table.rows) > MOST_KEPT:
        begin = replace(table, rows=table.rows[:FEWEST_ROWS])
        first = max(titles + sum(_row_heights(pdf, begin, parts[0], fit.size)), MIN_HEIGHT)
        return TableSize(math.inf, first, first, fit.landscape)
    heights = [_row_heights(pdf, table, part, fit.size) for part in parts]
    # Below each part is a space of 2 mm, and below the table one more.
    whole = titles + sum(sum(rows) + 2 for rows in heights) + 2
    first = max(titles + sum(heights[0][: 1 + FEWEST_ROWS]), MIN_HEIGHT)
    kept = [height for height in (whole, titles + sum(heights[0])) if height <= HALF_PAGE]
    return TableSize(whole, first, max([first, *kept[:1]]), fit.landscape)


def _row_heights(pdf: ReportPdf, table: Table, part: dict[int, float], size: float) -> list[float]:
    """Return the heights of the header and of the rows of a part, mm."""
    texts = [[_text(pdf, row[c]) for c in part] for row in table.rows]
    pdf.set_font(FAMILY, "B", size)
    lines = [max(_lines(pdf, pdf.plain(table.heads[c].text), part[c]) for c in part)]
    pdf.set_font(FAMILY, size=size)
    lines += [max(map(_lines, [pdf] * len(row), row, part.values())) for row in texts]
    return [count * LEADING * size + 2 * ROW_PADDING for count in lines]


def _lines(pdf: ReportPdf, text: str, width: float) -> int:
    """Return the number of lines of a text in a column, in the current font."""
    inner = width - 2 * PADDING
    if pdf.get_string_width(text) <= inner:
        return 1
    # fpdf2 leaves a margin of its own within the width, unlike the cells of a table.
    lines = pdf.multi_cell(
        inner + 2 * pdf.c_margin, text=text, dry_run=True, output=MethodReturnValue.LINES
    )
    assert isinstance(lines, list)
    return len(lines)


def _fit(pdf: ReportPdf, table: Table) -> Fit:
    """Return how a table fits.

    A short table that is too wide for a portrait page is split by columns there: it does not
    interrupt the portrait pages, which would leave two of them half empty.
    """
    is_long = len(table.rows) > SHORT_TABLE
    for landscape, max_width in ((False, PORTRAIT), (True, LANDSCAPE))[: 1 + is_long]:
        for size, longest in SETTINGS:
            fit = Fit(landscape, size, _widths(pdf, table, size, longest))
            if sum(fit.widths) > max_width:
                continue
            fit = fit._replace(widths=_widened(pdf, table, fit, max_width))
            if is_long or not _crowds(pdf, table, fit):
                return fit
    size, longest = SPLIT_SETTING
    fit = Fit(is_long, size, _widths(pdf, table, size, longest))
    if not _crowds(pdf, table, fit):
        return fit
    # A text of many lines gets most of the width of its part; each part has the first column.
    return fit._replace(widths=[fit.widths[0], *_widths(pdf, table, size, WIDE_TEXT)[1:]])


def _widened(pdf: ReportPdf, table: Table, fit: Fit, max_width: float) -> list[float]:
    """Return the widths with the space that is left for the columns whose texts wrap."""
    natural = _widths(pdf, table, fit.size, max_width)
    wanted = [max(n - w, 0.0) for n, w in zip(natural, fit.widths, strict=True)]
    # Round-off must not make the table wider than its page.
    share = min((max_width - 1e-6 - sum(fit.widths)) / (sum(wanted) or 1.0), 1.0)
    return [width + share * more for width, more in zip(fit.widths, wanted, strict=True)]


def _crowds(pdf: ReportPdf, table: Table, fit: Fit) -> bool:
    """Return whether a text of a table needs too many lines."""
    pdf.set_font(FAMILY, size=fit.size)
    return any(
        pdf.get_string_width(_text(pdf, cell)) > MOST_LINES * width
        for row in table.rows
        for cell, width in zip(row, fit.widths, strict=True)
    )


def _parts(pdf: ReportPdf, table: Table, fit: Fit) -> list[dict[int, float]]:
    """Return the parts of a table that fit on a page: the columns of each, with their widths."""
    max_width = LANDSCAPE if fit.landscape else PORTRAIT
    parts = _split_columns(fit.widths, max_width)
    if len(parts) == 1:
        return [dict(enumerate(fit.widths))]
    result = []
    for columns in parts:
        heads = tuple(table.heads[c] for c in columns)
        rows = tuple(tuple(row[c] for c in columns) for row in table.rows)
        own = fit._replace(widths=[fit.widths[c] for c in columns])
        widths = own.widths
        if sum(widths) < max_width:
            widths = _widened(pdf, replace(table, heads=heads, rows=rows), own, max_width)
        result.append(dict(zip(columns, widths, strict=True)))
    return result


def _write_part(
    pdf: ReportPdf, table: Table, part: dict[int, float], size: float, *, below_title: bool
) -> None:
    """Write a part: on one page if it is low, or else broken between rows.

    Args:
        pdf: The document.
        table: The table.
        part: The columns of the part, with their widths.
        size: The size of the font.
        below_title: Whether the title of the table is above: it has kept room for the first rows.
    """
    header, *heights = _row_heights(pdf, table, part, size)
    rows = list(table.rows)
    while True:
        count = _fitting(heights, pdf.room - header)
        is_low = header + sum(heights) <= KEPT_HEIGHT
        too_few = count < len(rows) and (is_low or count < FEWEST_ROWS)
        if too_few and not below_title and not pdf.is_at_top:
            pdf.add_page(same=True)
            continue
        left = len(rows) - count
        if 0 < left < FEWEST_ROWS and count + left >= 2 * FEWEST_ROWS:
            count -= FEWEST_ROWS - left
        # A row that is higher than a page is broken by fpdf2.
        count = max(count, 1)
        _write_rows(pdf, replace(table, rows=tuple(rows[:count])), part, size)
        rows, heights, below_title = rows[count:], heights[count:], False
        if not rows:
            break
        pdf.add_page(same=True)
    pdf.ln(2)


def _fitting(heights: list[float], room: float) -> int:
    """Return how many of the first rows fit, mm."""
    return sum(end <= room for end in accumulate(heights))


def _write_rows(pdf: ReportPdf, table: Table, part: dict[int, float], size: float) -> None:
    """Write the header and the rows of a part."""
    columns, widths = tuple(part), tuple(part.values())
    pdf.set_font(FAMILY, size=size)
    pdf.set_text_color(*BLACK)
    pdf.set_draw_color(*LINE_COLOUR)
    with pdf.table(
        width=sum(widths),
        col_widths=widths,
        text_align=tuple(Align.R if table.heads[c].numbers else Align.L for c in columns),
        align=Align.L,
        line_height=LEADING * size,
        padding=(ROW_PADDING, PADDING),
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


def _text(pdf: ReportPdf, cell: Cell) -> str:
    text = pdf.plain(f"{MARKS.get(cell.tone, '')} {cell.text}")
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
