"""Make tables from numbers and texts."""

import math
from collections.abc import Iterable, Sequence

from rbstab.files.counts import grouped
from rbstab.report.model import words
from rbstab.report.model.document import Cell, Head, Table

Entry = str | int | float | Cell
"""A text, a count, a number with four digits, or a cell."""


def table_of(
    name: str, title: str, heads: Iterable[str | Head], rows: Iterable[Sequence[Entry]], note: str
) -> Table:
    """Return a table without the columns that have no text, such as that of no conditions.

    Args:
        name: As of a `Table`.
        title: Likewise.
        heads: Likewise; of a text it is found whether the column has numbers.
        rows: Likewise.
        note: Likewise.
    """
    cells = [tuple(map(cell_of, row)) for row in rows]
    columns = [
        (head, column)
        for head, column in zip(heads, zip(*cells, strict=True), strict=True)
        if any(cell.text for cell in column)
    ]
    found = (
        Head(head, numbers=any(cell.value is not None for cell in column))
        if isinstance(head, str)
        else head
        for head, column in columns
    )
    return Table(name, title, (*found,), (*zip(*(own for _, own in columns), strict=True),), note)


def cell_of(entry: Entry) -> Cell:
    """Return an entry as a cell."""
    if isinstance(entry, str):
        return Cell(entry)
    if isinstance(entry, int):
        return Cell(grouped(entry), float(entry))
    return number(entry) if isinstance(entry, float) else entry


def number(value: float, digits: int = 4) -> Cell:
    """Return a cell with a number, shown with `digits` significant digits; NaN is shown as "-".

    An infinite one is that of members that are not at rest by the end, or a difference from it: it
    is shown as "later" or "earlier".
    """
    if math.isinf(value):
        return Cell("later" if value > 0 else "earlier")
    return Cell(words.number(value, digits), float(value))
