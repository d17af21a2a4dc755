"""Tables of a PDF: their heads stand again on each page, and no column is wider than the page."""

from collections.abc import Sequence
from typing import NamedTuple

from fpdf import FontFace
from fpdf.enums import Align, TableBordersLayout, TableHeadingsDisplay

from rbstab.report.model.document import Cell, Table
from rbstab.report.writers.pdf_pages import BLACK, FAMILY, GREY, LEADING, MARGIN, SMALL, Paper

UPRIGHT, LYING = 210.0 - 2 * MARGIN, 297.0 - 2 * MARGIN
"""How wide a table may be on both kinds of pages, mm."""

TOGETHER = 30.0
"""mm: the title, the heads and some rows of a table, which are not torn apart."""

SIZES = (8.0, 7.0, 6.0)
"""Of the type, points, tried in turn."""

PADDING = 1.2
"""mm on each side of a text."""

MAX_WIDTH = 50.0
"""mm: texts of more than that are broken."""

MAX_LENGTH = 400
"""Letters of a cell; a row has to fit on a page."""

TONES = {"good": (0, 105, 75), "bad": (175, 55, 0), "odd": (140, 100, 0)}

RULES = (190, 190, 190)


class Fit(NamedTuple):
    """How a table fits on pages: whether they lie, the type, and the widths of all columns, mm."""

    lying: bool
    size: float
    widths: list[float]


def write_table(paper: Paper, table: Table) -> None:
    """Writes a table: upright in the largest type that fits, or else on pages that lie.

    What is too wide even so is written in several parts, each with the first column.
    """
    fit = _fit(paper, table)
    paper.turn(lying=fit.lying)
    if paper.will_page_break(TOGETHER):
        paper.add_page(same=True)
    paper.paragraph(table.title, style="B", size=SMALL + 1)
    if table.note:
        paper.paragraph(table.note, size=SMALL, colour=GREY)
    for columns in _parts(fit.widths, LYING if fit.lying else UPRIGHT):
        _write_part(paper, table, columns, fit)
    paper.ln(2)


def lies(paper: Paper, table: Table) -> bool:
    """Whether a table takes pages that lie."""
    return _fit(paper, table).lying


def _fit(paper: Paper, table: Table) -> Fit:
    for lying, room in ((False, UPRIGHT), (True, LYING)):
        for size in SIZES:
            fit = Fit(lying, size, _widths(paper, table, size))
            if sum(fit.widths) <= room:
                return fit
    return fit


def _write_part(paper: Paper, table: Table, columns: Sequence[int], fit: Fit) -> None:
    _, size, widths = fit
    paper.set_font(FAMILY, size=size)
    paper.set_text_color(*BLACK)
    paper.set_draw_color(*RULES)
    with paper.table(
        width=sum(widths[c] for c in columns),
        col_widths=tuple(widths[c] for c in columns),
        text_align=tuple(Align.R if table.heads[c].numbers else Align.L for c in columns),
        align=Align.L,
        line_height=LEADING * size,
        padding=(0.6, PADDING),
        borders_layout=TableBordersLayout.HORIZONTAL_LINES,
        headings_style=FontFace(emphasis="BOLD"),
        repeat_headings=TableHeadingsDisplay.ON_TOP_OF_EVERY_PAGE,
    ) as made:
        made.row([paper.plain(table.heads[c].text) for c in columns])
        for cells in table.rows:
            row = made.row()
            for c in columns:
                cell = cells[c]
                tone = TONES.get(cell.tone)
                row.cell(
                    _text(paper, cell),
                    style=FontFace(color=tone) if tone else None,
                    link=f"#{cell.target}" if cell.target in paper.anchors else None,
                )
    paper.ln(2)


def _text(paper: Paper, cell: Cell) -> str:
    text = paper.plain(cell.text)
    return text if len(text) <= MAX_LENGTH else f"{text[: MAX_LENGTH - 1]}…"


def _widths(paper: Paper, table: Table, size: float) -> list[float]:
    """How wide each column is, mm."""
    widths = []
    for number, head in enumerate(table.heads):
        paper.set_font(FAMILY, "B", size)
        # A head may go over several lines, a word may not.
        words = paper.plain(head.text).split() or [""]
        widest = max(paper.get_string_width(word) for word in words)
        paper.set_font(FAMILY, size=size)
        for row in table.rows:
            widest = max(widest, paper.get_string_width(_text(paper, row[number])))
        widths.append(min(widest + 0.3, MAX_WIDTH) + 2 * PADDING)
    return widths


def _parts(widths: list[float], room: float) -> list[list[int]]:
    """The columns of each part, the first one in all of them."""
    parts = [[0]]
    for column in range(1, len(widths)):
        if sum(widths[c] for c in parts[-1]) + widths[column] > room and len(parts[-1]) > 1:
            parts.append([0])
        parts[-1].append(column)
    return parts
