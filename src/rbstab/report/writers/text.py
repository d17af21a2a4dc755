"""A report as text for a terminal: sentences, tables, and the titles of figures."""

from collections.abc import Iterator, Sequence

from rich import box
from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.padding import Padding
from rich.table import Table as RichTable
from rich.text import Text

from rbstab.config.errors import printable
from rbstab.report.model.document import Animation, Block, Cards, Report, Table
from rbstab.report.model.figure import Figure

STYLES = {"good": "green", "bad": "red", "warning": "yellow", "": ""}
"""Styles of the library rich for the tones of cells."""

MIN_WRAP_WIDTH = 24
"""Minimum width of a column of long texts, in characters; the texts wrap."""

COLUMN_GAP = 3
"""Padding of each column of a table, in characters."""

TABLE_EDGE = 1
"""Padding at the edge of a table, in characters."""


def print_report(report: Report, console: Console) -> None:
    """Print a report as wide as the console.

    A table that is too wide is split into several tables. Each has the columns that identify its
    rows.
    """
    console.print(_text(report.title, "bold"))
    console.print(_text(f"{report.made}, made by"))
    console.print(_text(report.command))
    for section in report.sections:
        console.print()
        console.print(_text(section.title, "bold underline"))
        for block in section.blocks:
            _print_block(block, console)
    if report.unread:
        console.print()
        console.print(_text("Results that could not be read", "bold underline"))
        for unread in report.unread:
            console.print(_text(f"{unread.path}: {unread.reason}", STYLES["bad"]))
    console.print()
    console.print(
        _text("The formats html, md and pdf show the figures; html also animates the motions.")
    )


def _print_block(block: Block, console: Console) -> None:
    if isinstance(block, Table):
        console.print()
        console.print(_text(block.title, "italic"))
        for piece in split_table(block, console.width):
            # A table that is still too wide is wrapped by the terminal, never cut off.
            console.print(_rich_table(piece, console.width), crop=False)
        if block.note:
            console.print(_text(block.note, "dim"))
    elif isinstance(block, Cards):
        _print_cards(block, console)
    elif isinstance(block, Figure):
        console.print(Padding(_text(f"Figure: {block.title}"), (0, 0, 0, 2)))
    elif isinstance(block, Animation):
        console.print(Padding(_text(f"Motion: {block.title}"), (0, 0, 0, 2)))
    else:
        console.print(_text(block))


def _print_cards(cards: Cards, console: Console) -> None:
    for card in cards.cards:
        console.print()
        console.print(_text(card.title, "bold"))
        if card.alarm:
            console.print(Padding(_text(card.marked_alarm, STYLES["bad"]), (0, 0, 0, 2)))
        for one in card.statements:
            line = _text(f"{one.question} ").append(printable(one.word), STYLES[one.tone])
            console.print(Padding(line.append(printable(f". {one.sentence}.")), (0, 0, 0, 2)))
        for name, value in card.facts:
            console.print(Padding(_text(f"{name}: {value}"), (0, 0, 0, 2)))
    if cards.words:
        console.print()
    for word, meaning in cards.words:
        console.print(_text(f"{word}: {meaning}", "dim"))


def split_table(table: Table, width: int) -> Iterator[Table]:
    """Split a table into tables of at most the given width, in characters.

    Each of them has the columns that identify its rows. A table is wider if its words do not fit.
    """
    needed = _min_widths(table)
    names = _key_columns(table)
    room = width - TABLE_EDGE - sum(needed[k] + COLUMN_GAP for k in names)
    selected: list[int] = []
    used = 0
    for k in range(len(names), len(needed)):
        if selected and used + needed[k] > room:
            yield _select_columns(table, [*names, *selected])
            selected, used = [], 0
        selected.append(k)
        used += needed[k] + COLUMN_GAP
    yield _select_columns(table, [*names, *selected])


def _key_columns(table: Table) -> range:
    """Return the columns that identify a row: the first, or the first two if it has duplicates."""
    firsts = {row[0].text for row in table.rows}
    return range(1 if len(firsts) == len(table.rows) or len(table.heads) < 3 else 2)


def _min_widths(table: Table) -> list[int]:
    """Return the minimum width of each column: numbers never wrap, long texts do."""
    natural = _cell_widths(table)
    words = [max(map(cell_len, printable(head.text).split(" "))) for head in table.heads]
    return [
        max(word, cells if head.numbers else min(cells, MIN_WRAP_WIDTH))
        for head, cells, word in zip(table.heads, natural, words, strict=True)
    ]


def _widths(table: Table, width: int) -> list[int]:
    """Distribute a width over the columns, first to those that need the least extra width."""
    found = _min_widths(table)
    extra = [
        max(0, cells - minimum) for cells, minimum in zip(_cell_widths(table), found, strict=True)
    ]
    room = max(0, width - TABLE_EDGE - sum(found) - COLUMN_GAP * len(found))
    by_extra = sorted(range(len(found)), key=lambda k: extra[k])
    for place, k in enumerate(by_extra):
        more = min(extra[k], room // (len(by_extra) - place))
        found[k] += more
        room -= more
    return found


def _cell_widths(table: Table) -> list[int]:
    columns = ([row[k].text for row in table.rows] for k in range(len(table.heads)))
    return [max((cell_len(printable(text)) for text in texts), default=0) for texts in columns]


def _select_columns(table: Table, which: Sequence[int]) -> Table:
    rows = tuple(tuple(row[k] for k in which) for row in table.rows)
    return Table(table.name, table.title, tuple(table.heads[k] for k in which), rows)


def _rich_table(table: Table, width: int) -> RichTable:
    rich_table = RichTable(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False)
    for head, columns in zip(table.heads, _widths(table, width), strict=True):
        justify: JustifyMethod = "right" if head.numbers else "left"
        rich_table.add_column(_text(head.text), justify=justify, overflow="fold", width=columns)
    for row in table.rows:
        rich_table.add_row(*(_text(cell.text, STYLES[cell.tone]) for cell in row))
    return rich_table


def _text(text: str, style: str = "") -> Text:
    """Return text that rich prints literally, without interpreting markup."""
    return Text(printable(text), style=style)
