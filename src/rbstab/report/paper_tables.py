"""Tables of a PDF: their heads stand again on each page, and no column is wider than the page."""

from collections.abc import Sequence

from fpdf import FontFace
from fpdf.enums import Align, TableBordersLayout, TableHeadingsDisplay

from rbstab.report.document import Cell, Table
from rbstab.report.paper import BLACK, FAMILY, GREY, LEADING, SMALL, Paper

SIZES = (8.0, 7.0, 6.0)
"""Of the type, points, tried in turn."""

PADDING = 1.2
"""mm on each side of a text."""

WIDEST = 70.0
"""mm: texts of more than that are broken."""

LONGEST = 400
"""Letters of a cell; a row has to fit on a page."""

TONES = {"good": (0, 105, 75), "bad": (175, 55, 0), "odd": (140, 100, 0)}

RULES = (190, 190, 190)


def write_table(paper: Paper, table: Table) -> None:
    """Writes a table: upright in the largest type that fits, or else on pages that lie.

    What is too wide even so is written in several parts, each with the first column.
    """
    paper.paragraph(table.title, style="B", size=SMALL + 1)
    upright, lying = paper.epw, paper.eph
    for room, lies in ((upright, False), (lying, True)):
        for size in SIZES:
            widths = _widths(paper, table, size)
            if sum(widths) <= room:
                _write_parts(paper, table, [range(len(widths))], widths, size, lies=lies)
                return
    widths = _widths(paper, table, SIZES[-1])
    _write_parts(paper, table, _parts(widths, lying), widths, SIZES[-1], lies=True)


def _write_parts(
    paper: Paper,
    table: Table,
    parts: Sequence[Sequence[int]],
    widths: list[float],
    size: float,
    *,
    lies: bool,
) -> None:
    if lies:
        paper.add_page(orientation="landscape")
    for part in parts:
        _write_part(paper, table, part, widths, size)
    if table.note:
        paper.paragraph(table.note, size=SMALL, colour=GREY)
    paper.ln(2)
    if lies:
        paper.add_page(orientation="portrait")


def _write_part(
    paper: Paper, table: Table, columns: Sequence[int], widths: list[float], size: float
) -> None:
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
        wrapmode="CHAR",
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
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


def _widths(paper: Paper, table: Table, size: float) -> list[float]:
    """How wide each column is, mm."""
    widths = []
    for number, head in enumerate(table.heads):
        paper.set_font(FAMILY, "B", size)
        widest = paper.get_string_width(paper.plain(head.text))
        paper.set_font(FAMILY, size=size)
        for row in table.rows:
            widest = max(widest, paper.get_string_width(_text(paper, row[number])))
        widths.append(min(widest + 0.3, WIDEST) + 2 * PADDING)
    return widths


def _parts(widths: list[float], room: float) -> list[list[int]]:
    """The columns of each part, the first one in all of them."""
    parts = [[0]]
    for column in range(1, len(widths)):
        if sum(widths[c] for c in parts[-1]) + widths[column] > room and len(parts[-1]) > 1:
            parts.append([0])
        parts[-1].append(column)
    return parts
