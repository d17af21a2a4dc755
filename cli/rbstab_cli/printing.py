"""What commands print: lines on stderr, tables, facts, numbers and JSON on stdout."""

import math
import sys
import unicodedata
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import click

from rbstab.files.text import printable
from rbstab_cli.streams import is_utf8

if TYPE_CHECKING:
    from rich.console import JustifyMethod
    from rich.table import Table as RichTable

FOLDED_WIDTH = 12
"""Least width of a column that folds, in characters; narrower texts cannot be read."""


def say(text: str) -> None:
    """Print a line for people: on stderr, beside the data on stdout."""
    click.echo(text, err=True)


QUIET = "rbstab.quiet"
"""The key of the option --quiet in the `Context.meta` of a command that has it."""


def is_quiet() -> bool:
    """Return whether the command was called with --quiet: then it prints no progress, no hints."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(QUIET))


def hint(text: str) -> None:
    """Print a line that --quiet leaves out, on stderr."""
    if not is_quiet():
        say(text)


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
            from rbstab_cli.console import OutputConsole

            console = OutputConsole(highlight=False)
            for part in [self] if fits(self, console.width) else records(self):
                console.print(rich_table(part))
        else:
            for line in plain_lines(self):
                click.echo(line)
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
    tables = []
    for cells, style in table.rows:
        record = Table(table.columns[0], cells[0], words=table.columns[:1])
        for name, cell in zip(table.columns[1:], cells[1:], strict=True):
            record.add(name, cell, style=style)
        tables.append(record)
    return tables


def plain_lines(table: Table) -> list[str]:
    """Return the lines for a file or a pipe: nothing is cut or folded."""
    rows = [table.columns, *(cells for cells, _ in table.rows)]
    widths = [max(map(width_of, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        line = ""
        for name, cell, width in zip(table.columns, row, widths, strict=True):
            space = " " * (width - width_of(cell))
            line += f" {space}{cell} " if name in table.numbers else f" {cell}{space} "
        lines.append(line.rstrip())
    return lines


def width_of(text: str) -> int:
    """Return the columns of a printable text: characters may be two wide, marks have none."""
    if text.isascii():
        return len(text)
    wide = sum(unicodedata.east_asian_width(character) in "WF" for character in text)
    marks = sum(unicodedata.category(character)[0] == "M" for character in text)
    return len(text) + wide - marks


def rich_table(table: Table) -> "RichTable":
    """Return a table for a terminal, which is narrow: units go below names, long texts fold."""
    # Imported late: only a terminal needs it.
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    made = RichTable(box=box.SIMPLE_HEAD, header_style="bold")
    for column in table.columns:
        right = column in table.numbers
        whole = right or column in table.words
        justify: JustifyMethod = "right" if right else "left"
        header = Text(column.replace(" [", "\n["))
        made.add_column(header, justify=justify, no_wrap=whole, overflow="fold")
    for cells, style in table.rows:
        made.add_row(*(Text(cell) for cell in cells), style=style)
    return made


def print_json(data: Any) -> None:
    """Print data as JSON; only ASCII characters, with JSON's escapes, if stdout is not UTF-8."""
    click.echo(as_json_text(data, ensure_ascii=not is_utf8(sys.stdout)))


def as_json_text(data: Any, *, ensure_ascii: bool = False) -> str:
    """Return data as JSON; NaN and infinite numbers, which JSON does not have, become null."""
    # Few commands print JSON, and it is a tenth of the time of those that print help.
    import json

    return json.dumps(_finite(data), indent=2, ensure_ascii=ensure_ascii, allow_nan=False)


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return data
