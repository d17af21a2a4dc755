"""Tables and numbers on stdout."""

import sys
from io import StringIO
from typing import TYPE_CHECKING

import click

from rbstab.config.errors import printable

if TYPE_CHECKING:
    from rich.console import JustifyMethod
    from rich.table import Table

FILE_WIDTH = 1000
"""Width in characters if stdout is not a terminal; wide enough that no cell is cut."""


def new_table(*columns: str, words: tuple[str, ...] = (), numbers: tuple[str, ...] = ()) -> "Table":
    """Make an empty table.

    Args:
        columns: The headers.
        words: Columns that never fold.
        numbers: Columns that never fold and are right-aligned.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    on_terminal = sys.stdout.isatty()
    table = Table(box=box.SIMPLE_HEAD if on_terminal else None, header_style="bold")
    for column in columns:
        # A terminal is narrow: the unit goes below the name, and long texts fold.
        header = Text(column.replace(" [", "\n[") if on_terminal else column)
        right = column in numbers
        whole = right or column in words
        justify: JustifyMethod = "right" if right else "left"
        table.add_column(header, justify=justify, no_wrap=whole, overflow="fold")
    return table


def add_row(table: "Table", *cells: str, style: str | None = None) -> None:
    """Add a row; cells are plain text, never markup."""
    from rich.text import Text

    table.add_row(*(Text(printable(cell)) for cell in cells), style=style)


def print_table(table: "Table") -> None:
    """Print a table to stdout, in colour on a terminal unless NO_COLOR is set."""
    from rbstab_cli.output.console import OutputConsole

    if sys.stdout.isatty():
        OutputConsole(highlight=False).print(table)
        return
    text = StringIO()
    OutputConsole(file=text, width=FILE_WIDTH, highlight=False).print(table)
    for line in text.getvalue().splitlines():
        click.echo(line.rstrip())
    click.echo()


def number(value: float, digits: int = 4) -> str:
    """Return a number with the given count of significant digits."""
    return f"{value:.{digits}g}"
