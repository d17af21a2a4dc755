"""A report as text for a terminal: its sentences and tables; of figures the titles."""

from collections.abc import Iterator, Sequence

from rich import box
from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.padding import Padding
from rich.table import Table as RichTable
from rich.text import Text

from rbstab.config.errors import printable
from rbstab.report.model.document import Block, Motion, Report, Table
from rbstab.report.model.figure import Figure

STYLES = {"good": "green", "bad": "red", "odd": "yellow", "": ""}
"""Of the tones of cells."""

FOLDED = 24
"""Columns that a column of words is given at least, where it has as many; longer ones fold."""

APART = 3
"""Columns that a column of a table takes beside its words."""

EDGE = 1
"""Columns that a table takes beside its columns."""


def print_report(report: Report, console: Console) -> None:
    """Prints a report, in as many columns as the console has.

    A table that is too wide is cut into pieces, each with the first column.
    """
    console.print(_text(report.title, "bold"))
    console.print(_text(f"{report.created}, made by"))
    console.print(_text(report.command))
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
        console.print(_text(block.title, "italic"))
        for piece in pieces(block, console.width):
            # What does not fit even so is left to the terminal, and never cut off.
            console.print(_drawn(piece, console.width), crop=False)
        if block.note:
            console.print(_text(block.note, "dim"))
    elif isinstance(block, Figure):
        console.print(Padding(_text(f"Figure: {block.title}"), (0, 0, 0, 2)))
    elif isinstance(block, Motion):
        console.print(Padding(_text(f"Motion: {block.title}"), (0, 0, 0, 2)))
    else:
        console.print(_text(block))


def pieces(table: Table, width: int) -> Iterator[Table]:
    """A table as tables that are no wider than so many columns, where words are not that long.

    Each has the columns that tell its rows apart.
    """
    needed = _least_widths(table)
    names = _naming(table)
    room = width - EDGE - sum(needed[k] + APART for k in names)
    taken: list[int] = []
    used = 0
    for k in range(len(names), len(needed)):
        if taken and used + needed[k] > room:
            yield _columns(table, [*names, *taken])
            taken, used = [], 0
        taken.append(k)
        used += needed[k] + APART
    yield _columns(table, [*names, *taken])


def _naming(table: Table) -> range:
    """The first column, or the first two where it takes them to tell rows apart."""
    firsts = {row[0].text for row in table.rows}
    return range(1 if len(firsts) == len(table.rows) or len(table.heads) < 3 else 2)


def _least_widths(table: Table) -> list[int]:
    """What each column takes at least: a number is never folded, words are if they are long."""
    natural = _cell_widths(table)
    words = [max(map(cell_len, printable(head.text).split(" "))) for head in table.heads]
    return [
        max(word, cells if head.numbers else min(cells, FOLDED))
        for head, cells, word in zip(table.heads, natural, words, strict=True)
    ]


def _widths(table: Table, width: int) -> list[int]:
    """What each column gets of so many: those that want the least more get it first."""
    found = _least_widths(table)
    wanted = [
        max(0, cells - least) for cells, least in zip(_cell_widths(table), found, strict=True)
    ]
    room = max(0, width - EDGE - sum(found) - APART * len(found))
    by_want = sorted(range(len(found)), key=lambda k: wanted[k])
    for place, k in enumerate(by_want):
        more = min(wanted[k], room // (len(by_want) - place))
        found[k] += more
        room -= more
    return found


def _cell_widths(table: Table) -> list[int]:
    columns = ([row[k].text for row in table.rows] for k in range(len(table.heads)))
    return [max((cell_len(printable(text)) for text in texts), default=0) for texts in columns]


def _columns(table: Table, which: Sequence[int]) -> Table:
    rows = tuple(tuple(row[k] for k in which) for row in table.rows)
    return Table(table.name, table.title, tuple(table.heads[k] for k in which), rows)


def _drawn(table: Table, width: int) -> RichTable:
    made = RichTable(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False)
    for head, columns in zip(table.heads, _widths(table, width), strict=True):
        justify: JustifyMethod = "right" if head.numbers else "left"
        made.add_column(_text(head.text), justify=justify, overflow="fold", width=columns)
    for row in table.rows:
        made.add_row(*(_text(cell.text, STYLES[cell.tone]) for cell in row))
    return made


def _text(words: str, style: str = "") -> Text:
    """Words as they are: what looks like markup is none."""
    return Text(printable(words), style=style)
