"""Make cells of tables from numbers and texts."""

import math
from dataclasses import replace

from rbstab.files.counts import grouped
from rbstab.report.model import words
from rbstab.report.model.document import Cell, Table


def number(value: float, digits: int = 4) -> Cell:
    """Return a cell with a number, shown with `digits` significant digits; NaN is shown as "-".

    An infinite one is that of members that are not at rest by the end, or a difference from it: it
    is shown as "later" or "earlier".
    """
    if math.isinf(value):
        return Cell("later" if value > 0 else "earlier")
    return Cell(words.number(value, digits), float(value))


def whole(value: int) -> Cell:
    """Return a cell with a count."""
    return Cell(grouped(value), float(value))


def by_condition(table: Table) -> Table:
    """Return a table without its second column, that of conditions, if there are none."""
    if any(row[1].text for row in table.rows):
        return table
    rows = tuple((row[0], *row[2:]) for row in table.rows)
    return replace(table, heads=(table.heads[0], *table.heads[2:]), rows=rows)
