"""What a report says, without a word on its format: headings, sentences, tables, figures, motions.

All texts are plain; whatever writes a format escapes them in its own way.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Figure


class Head(NamedTuple):
    """The head of a column: its words, its unit ("" for none), whether it holds numbers."""

    label: str
    unit: str = ""
    numbers: bool = False

    @property
    def text(self) -> str:
        """The words with the unit."""
        return f"{self.label} [{self.unit}]" if self.unit not in ("", "1") else self.label


class Cell(NamedTuple):
    """An entry of a table.

    text is what is shown; value is by what rows are sorted and what machines are given (None: the
    text itself); tone is "good", "bad", "odd" or "" and never the only carrier of a meaning; target
    is the anchor of a section of the report that it leads to.
    """

    text: str
    value: float | None = None
    tone: str = ""
    target: str = ""


@dataclass(frozen=True)
class Table:
    """A table.

    Args:
        name: Short, in lower case and hyphens, and its own in a report.
        title: What it lists.
        heads: Its columns; the first one names the row.
        rows: As many cells each as there are columns.
        note: What a reader has to know; "" for nothing.
    """

    name: str
    title: str
    heads: tuple[Head, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""


@dataclass(frozen=True, eq=False)
class Solid:
    """A rigid shape in body coordinates, drawn as triangles.

    Args:
        vertices: Shape (n, 3), m, from the centre of gravity.
        triangles: Shape (k, 3), whole numbers: the corners of each.
    """

    vertices: Array
    triangles: Array


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion of a body in space, for a view that moves.

    Args:
        name: Short, its own in a report: the run's.
        title: Of the run.
        times: Shape (n,), s.
        positions: X, inertial, shape (n, 3), m.
        rotations: A as unit quaternions (w, x, y, z), body to inertial, shape (n, 4).
        solid: The body.
        contact_point: R, body coordinates, shape (3,), m.
        anchor: Where the contact point is tied, inertial, shape (3,), m; None for a free body.
    """

    name: str
    title: str
    times: Array
    positions: Array
    rotations: Array
    solid: Solid
    contact_point: Array
    anchor: Array | None


Block = str | Table | Figure | Motion
"""A paragraph, a table, a figure or a view of a motion."""


@dataclass(frozen=True)
class Section:
    """A part of a report.

    Args:
        name: Short, in lower case and hyphens, and its own in a report: its anchor.
        title: Its heading.
        blocks: What is in it, in order.
    """

    name: str
    title: str
    blocks: tuple[Block, ...]


class Unread(NamedTuple):
    """A result that could not be read, and why."""

    path: str
    reason: str


@dataclass(frozen=True)
class Report:
    """A report.

    Args:
        title: Its heading.
        created: When it was made, ISO 8601.
        command: The command that makes it again.
        sections: Its parts, in order.
        unread: What could not be read.
    """

    title: str
    created: str
    command: str
    sections: tuple[Section, ...]
    unread: tuple[Unread, ...] = field(default=())
