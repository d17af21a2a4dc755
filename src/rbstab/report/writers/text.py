"""A report as text for a terminal: sentences, tables, and the titles of figures."""

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.measure import Measurement
from rich.padding import Padding
from rich.table import Table as RichTable
from rich.text import Text

from rbstab.files.text import printable
from rbstab.report.model.document import Animation, Block, Cards, Report, Table
from rbstab.report.model.figure import Figure

STYLES = {"good": "green", "bad": "red", "warning": "yellow", "": ""}
"""Styles of the library rich for the tones of cells."""

MIN_WRAP_WIDTH = 24
"""Minimum width of a column of long texts, in characters; the texts wrap."""


UNLIMITED = 100_000
"""A width that no table has, in characters."""


def print_report(report: Report, console: Console) -> None:
    """Print a report as wide as the console."""
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
        _print_table(block, console)
    elif isinstance(block, Cards):
        _print_cards(block, console)
    elif isinstance(block, Figure):
        console.print(_indented(_text(f"Figure: {block.title}")))
    elif isinstance(block, Animation):
        console.print(_indented(_text(f"Motion: {block.title}")))
    else:
        console.print(_text(block))


def _print_cards(cards: Cards, console: Console) -> None:
    for card in cards.cards:
        console.print()
        console.print(_text(card.title, "bold"))
        if card.alarm:
            console.print(_indented(_text(card.marked_alarm, STYLES["bad"])))
        for statement in card.statements:
            line = _text(f"{statement.question} ").append(
                printable(statement.word), STYLES[statement.tone]
            )
            console.print(_indented(line.append(printable(f". {statement.sentence}."))))
        for name, value in card.facts:
            console.print(_indented(_text(f"{name}: {value}")))
    if cards.words:
        console.print()
    for word, meaning in cards.words:
        console.print(_text(f"{word}: {meaning}", "dim"))


def _print_table(table: Table, console: Console) -> None:
    """Print a table; if it is too wide, its rows as paragraphs with the heads in them."""
    console.print()
    console.print(_text(table.title, "italic"))
    rich_table = RichTable(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False)
    for k, head in enumerate(table.heads):
        longest = max((cell_len(printable(row[k].text)) for row in table.rows), default=0)
        # Numbers never wrap, long texts do.
        rich_table.add_column(
            _text(head.text),
            justify="right" if head.numbers else "left",
            overflow="fold",
            no_wrap=head.numbers,
            min_width=min(longest, MIN_WRAP_WIDTH),
        )
    for row in table.rows:
        rich_table.add_row(*(_text(cell.text, STYLES[cell.tone]) for cell in row))
    # Within the options of the console, no measure is wider than the console.
    needed = Measurement.get(console, console.options.update(width=UNLIMITED), rich_table)
    if needed.minimum <= console.width:
        console.print(rich_table)
    else:
        for row in table.rows:
            line = _text(row[0].text, "bold")
            for head, cell in zip(table.heads[1:], row[1:], strict=True):
                line.append(printable(f"; {head.text}: "))
                line.append(printable(cell.text), STYLES[cell.tone])
            console.print(_indented(line))
    if table.note:
        console.print(_text(table.note, "dim"))


def _indented(text: Text) -> Padding:
    return Padding(text, (0, 0, 0, 2))


def _text(text: str, style: str = "") -> Text:
    """Return text that rich prints literally, without interpreting markup."""
    return Text(printable(text), style=style)
