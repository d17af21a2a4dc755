"""Tables and numbers for people."""

import sys
from io import StringIO
from typing import TYPE_CHECKING

import click

from rbstab.config.errors import printable

if TYPE_CHECKING:
    from rich.console import JustifyMethod
    from rich.table import Table

WIDE = 1000
"""Columns, where output goes to a file: nothing is to be cut there."""


def table(*columns: str, words: tuple[str, ...] = (), numbers: tuple[str, ...] = ()) -> "Table":
    """An empty table; the columns `words` and `numbers` never fold; numbers stand at the right."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    on_terminal = sys.stdout.isatty()
    made = Table(box=box.SIMPLE_HEAD if on_terminal else None, header_style="bold")
    for column in columns:
        # A terminal is narrow: the unit goes below the name, and long texts fold.
        header = Text(column.replace(" [", "\n[") if on_terminal else column)
        right = column in numbers
        whole = right or column in words
        justify: JustifyMethod = "right" if right else "left"
        made.add_column(header, justify=justify, no_wrap=whole, overflow="fold")
    return made


def row(made: "Table", *cells: str, style: str | None = None) -> None:
    """Adds a row; what a cell holds is text, never markup."""
    from rich.text import Text

    made.add_row(*(Text(printable(cell)) for cell in cells), style=style)


def show(made: "Table") -> None:
    """Prints a table to stdout, in colour on a terminal unless NO_COLOR is set."""
    from rich.console import Console

    if sys.stdout.isatty():
        Console(highlight=False).print(made)
        return
    text = StringIO()
    console = Console(file=text, width=WIDE, highlight=False)
    console.print(made)
    for line in text.getvalue().splitlines():
        click.echo(line.rstrip())
    click.echo()


def number(value: float, digits: int = 4) -> str:
    """A number with so many significant digits."""
    return f"{value:.{digits}g}"
