"""Entries of tables from numbers and words."""

from rbstab.report.model import words
from rbstab.report.model.document import Cell, Head, Table


def number(value: float, digits: int = 4) -> Cell:
    """A number with so many significant digits; what is not a number is told as nothing."""
    return Cell(words.number(value, digits), float(value))


def whole(value: int) -> Cell:
    """A whole number."""
    return Cell(str(value), float(value))


def facts(name: str, title: str, rows: dict[str, str], note: str = "") -> Table:
    """A table of what is known, each with its name."""
    cells = tuple((Cell(key), Cell(text)) for key, text in rows.items())
    return Table(name, title, (Head("quantity"), Head("value")), cells, note)
