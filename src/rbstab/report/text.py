"""A report as text for a terminal: its sentences and tables; of figures the titles."""

from collections.abc import Iterator, Sequence

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.padding import Padding
from rich.table import Table as RichTable
from rich.text import Text

from rbstab.config.errors import printable
from rbstab.report.document import Block, Cell, Head, Motion, Report, Table
from rbstab.report.figure import Figure

STYLES = {"good": "green", "bad": "red", "odd": "yellow", "": ""}
"""Of the tones of cells."""

LONGEST_NAME = 28
"""Columns of the first column of a table that is cut into pieces, for it stands in each of them."""

APART = 2
"""Columns between two columns of a table."""


def print_report(report: Report, console: Console) -> None:
    """Prints a report, in as many columns as the console has.

    A table that is too wide is cut into pieces, each with the first column.
    """
    console.print(_text(report.title, "bold"))
    console.print(_text(f"{report.created}"))
    for section in report.sections:
        console.print()
        console.print(_text(section.title, "bold underline"))
        for block in section.blocks:
            _print_block(block, console)
    if report.unread:
        console.print()
        console.print(_text("Not read", "bold underline"))
        for unread in report.unread:
            console.print(_text(f"{unread.path}: {unread.reason}", STYLES["bad"]))
    console.print()
    console.print(_text("Figures and motions are in the formats html, md and pdf."))


def _print_block(block: Block, console: Console) -> None:
    if isinstance(block, Table):
        console.print()
        for piece in pieces(block, console.width):
            console.print(_drawn(piece))
        if block.note:
            console.print(_text(block.note, "dim"))
    elif isinstance(block, Figure):
        console.print(Padding(_text(f"Figure: {block.title}"), (0, 0, 0, 2)))
    elif isinstance(block, Motion):
        console.print(Padding(_text(f"Motion: {block.title}"), (0, 0, 0, 2)))
    else:
        console.print(_text(block))


def pieces(table: Table, width: int) -> Iterator[Table]:
    """A table as tables that are no wider than so many columns, where words are not that long."""
    widths = [_width(head, k, table.rows) for k, head in enumerate(table.heads)]
    first = min(widths[0], LONGEST_NAME)
    if sum(widths) + APART * len(widths) <= width or len(widths) < 3:
        yield table
        return
    taken: list[int] = []
    used = first + APART
    for k, needed in enumerate(widths[1:], start=1):
        if taken and used + needed + APART > width:
            yield _columns(table, taken)
            taken, used = [], first + APART
        taken.append(k)
        used += needed + APART
    yield _columns(table, taken)


def _width(head: Head, column: int, rows: Sequence[tuple[Cell, ...]]) -> int:
    """The columns that a column of a table takes where nothing of it is folded."""
    heads = (cell_len(line) for line in _head(head).plain.split("\n"))
    return max([*heads, *(cell_len(printable(row[column].text)) for row in rows)])


def _columns(table: Table, which: Sequence[int]) -> Table:
    chosen = (0, *which)
    rows = tuple(tuple(row[k] for k in chosen) for row in table.rows)
    return Table(table.name, table.title, tuple(table.heads[k] for k in chosen), rows)


def _drawn(table: Table) -> RichTable:
    made = RichTable(
        box=box.SIMPLE_HEAD,
        title=_text(table.title, "italic"),
        title_justify="left",
        header_style="bold",
        pad_edge=False,
    )
    for head in table.heads:
        justify = "right" if head.numbers else "left"
        made.add_column(_head(head), justify=justify, overflow="fold")  # type: ignore[arg-type]
    for row in table.rows:
        made.add_row(*(_text(cell.text, STYLES[cell.tone]) for cell in row))
    return made


def _head(head: Head) -> Text:
    """The words of a head, the unit below them."""
    return Text("\n".join(map(printable, head.text.rsplit(" [", 1))).replace("\n", "\n["))


def _text(words: str, style: str = "") -> Text:
    """Words as they are: what looks like markup is none."""
    return Text(printable(words), style=style)
