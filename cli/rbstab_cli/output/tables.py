"""Tables and numbers on stdout."""

import sys
import unicodedata
from collections.abc import Iterable, Sequence
from io import StringIO
from typing import TYPE_CHECKING

import click

from rbstab.config.errors import printable

if TYPE_CHECKING:
    from rich.console import JustifyMethod
    from rich.table import Table as RichTable

FILE_WIDTH = 1000
"""Width in characters if stdout is not a terminal; wide enough that no cell is cut."""

FOLDED_WIDTH = 12
"""Least width of a column that folds, in characters; narrower texts cannot be read."""


class Table:
    """A table of texts on stdout.

    Args:
        columns: The headers.
        words: Columns that never fold.
        numbers: Columns that never fold and are right-aligned.
    """

    def __init__(
        self, *columns: str, words: Sequence[str] = (), numbers: Sequence[str] = ()
    ) -> None:
        self.columns, self.words, self.numbers = columns, words, numbers
        self.rows: list[tuple[tuple[str, ...], str | None]] = []

    def add(self, *cells: str, style: str | None = None) -> None:
        """Add a row; cells are plain text, never markup. The style is that on a terminal."""
        self.rows.append((tuple(printable(cell) for cell in cells), style))

    def print(self, note: str = "") -> None:
        """Print it, in colour on a terminal unless NO_COLOR is set; a note is a line below it."""
        on_terminal = sys.stdout.isatty()
        if on_terminal:
            from rbstab_cli.output.console import OutputConsole

            console = OutputConsole(highlight=False)
            for part in [self] if fits(self, console.width) else records(self):
                console.print(_rich_table(part, on_terminal=True))
        else:
            lines = _plain_lines(self)
            for line in _rich_lines(self) if lines is None else lines:
                click.echo(line.rstrip())
        if note:
            click.echo(f" {note}")
        if not on_terminal:
            click.echo()


def print_facts(rows: Iterable[tuple[str, str]], *columns: str) -> None:
    """Print rows of a name and a text; the headers are "quantity" and "value" if none are given."""
    table = Table(*(columns or ("quantity", "value")))
    for row in rows:
        table.add(*row)
    table.print()


def vector(values: Iterable[float], digits: int = 4) -> str:
    """Return numbers in parentheses."""
    return f"({', '.join(number(value, digits) for value in values)})"


def number(value: float, digits: int = 4) -> str:
    """Return a number with the given count of significant digits."""
    return f"{value:.{digits}g}"


def fits(table: Table, width: int) -> bool:
    """Return whether a terminal of this width shows a table without cutting its numbers."""
    whole = {*table.words, *table.numbers}
    needed = 1
    for index, name in enumerate(table.columns):
        cells = [cells[index] for cells, _ in table.rows]
        longest = max(map(len, [*name.split(" ["), *cells]))
        # Rich puts a space on both sides of a cell, and one between columns.
        needed += 3 + (longest if name in whole else min(longest, FOLDED_WIDTH))
    return needed <= width


def records(table: Table) -> list[Table]:
    """Return the rows of a table as tables of their own, with a line for each column."""
    found = []
    for cells, style in table.rows:
        record = Table(table.columns[0], cells[0], words=table.columns[:1])
        for name, cell in zip(table.columns[1:], cells[1:], strict=True):
            record.add(name, cell, style=style)
        found.append(record)
    return found


def _plain_lines(table: Table) -> list[str] | None:
    """Return the lines as rich makes them for a file, without importing it.

    Returns:
        The lines; None if rich would fold them, or if a character may not be one column
        wide.
    """
    rows = [table.columns, *(cells for cells, _ in table.rows)]
    if not all(_has_plain_width(cell) for row in rows for cell in row):
        return None
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    if sum(widths) + 2 * len(widths) > FILE_WIDTH:
        return None
    is_right = [name in table.numbers for name in table.columns]
    return [
        "".join(
            f" {cell.rstrip():>{width}} " if right else f" {cell:<{width}} "
            for cell, width, right in zip(row, widths, is_right, strict=True)
        )
        for row in rows
    ]


def _has_plain_width(text: str) -> bool:
    """Whether each character of a printable text is one column wide."""
    return text.isascii() or all(
        unicodedata.east_asian_width(c) not in "WF" and unicodedata.category(c)[0] != "M"
        for c in text
    )


def _rich_lines(table: Table) -> list[str]:
    from rbstab_cli.output.console import OutputConsole

    text = StringIO()
    console = OutputConsole(file=text, width=FILE_WIDTH, highlight=False)
    console.print(_rich_table(table, on_terminal=False))
    return text.getvalue().splitlines()


def _rich_table(table: Table, *, on_terminal: bool) -> "RichTable":
    # Imported late: only a terminal needs it.
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    made = RichTable(box=box.SIMPLE_HEAD if on_terminal else None, header_style="bold")
    for column in table.columns:
        # A terminal is narrow: the unit goes below the name, and long texts fold.
        header = Text(column.replace(" [", "\n[") if on_terminal else column)
        right = column in table.numbers
        whole = right or column in table.words
        justify: JustifyMethod = "right" if right else "left"
        made.add_column(header, justify=justify, no_wrap=whole, overflow="fold")
    for cells, style in table.rows:
        made.add_row(*(Text(cell) for cell in cells), style=style)
    return made
