"""The content of a report in any format: headings, sentences, tables, figures, animations.

All texts are plain text. Each writer escapes them for its own format.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import NamedTuple, Self

from rbstab.experiment.answers.facts import Shown
from rbstab.experiment.answers.rounded import number
from rbstab.files.text import grouped
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Figure
from rbstab.report.model.words import with_unit


class Head(NamedTuple):
    """The header of a column.

    label is its text, and unit its unit ("" for none). numbers is True for a column of numbers.
    """

    label: str
    unit: str = ""
    numbers: bool = False

    @property
    def text(self) -> str:
        """The label with the unit."""
        return with_unit(self.label, self.unit)


MARKS = {"good": "✓", "bad": "✗", "warning": "!"}
"""The marks of entries and answers by their tones: colour alone must not carry a meaning."""


class Cell(NamedTuple):
    """An entry of a table.

    text is shown. value is the number for sorting and for JSON; if it is None, they use the text.
    tone is "good", "bad", "warning" or ""; a reader who does not see it still has the text. target
    is the anchor of the section to which the cell links. command is one that a page offers to copy.
    """

    text: str
    value: float | None = None
    tone: str = ""
    target: str = ""
    command: str = ""

    @classmethod
    def of(cls, entry: "Entry") -> "Cell":
        """Return a cell of a text, a count, or a number with four significant digits."""
        if isinstance(entry, Cell):
            return entry
        if isinstance(entry, Shown):
            return cls(*entry)
        if isinstance(entry, int):
            return cls(grouped(entry), float(entry))
        return cls(entry) if isinstance(entry, str) else cls.number(entry)

    @classmethod
    def number(cls, value: float, digits: int = 4) -> Self:
        """Return a cell with a number; NaN is shown as "-".

        An infinite one is that of members that are not at rest by the end, or a difference from it:
        it is shown as "later" or "earlier".
        """
        if math.isinf(value):
            return cls("later" if value > 0 else "earlier")
        return cls(number(value, digits), float(value))


Entry = Cell | Shown | str | float
"""What becomes an entry of a table."""


@dataclass(frozen=True)
class Table:
    """A table.

    Args:
        name: Short, in lower case and hyphens, unique in a report.
        title: Its title.
        heads: The headers of its columns; the first column names the row.
        rows: Its rows; each has one cell for each column.
        note: Shown below the table; "" for none.
    """

    name: str
    title: str
    heads: tuple[Head, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""

    @classmethod
    def of(
        cls,
        name: str,
        title: str,
        heads: Iterable[Head | str],
        rows: Iterable[Iterable[Entry]],
        note: str = "",
    ) -> Self:
        """Return a table of plain entries, without the columns that have no text.

        A column with a number is one of numbers.

        Args:
            name: Short, in lower case and hyphens, unique in a report.
            title: Its title.
            heads: The headers of its columns, or their words alone.
            rows: Its rows, with an entry for each column.
            note: Shown below the table.
        """
        columns = zip(*(tuple(map(Cell.of, row)) for row in rows), strict=True)
        shown = [
            (Head(head) if isinstance(head, str) else head, column)
            for head, column in zip(heads, columns, strict=True)
            if any(cell.text for cell in column)
        ]
        typed = tuple(
            head._replace(numbers=head.numbers or any(cell.value is not None for cell in column))
            for head, column in shown
        )
        return cls(name, title, typed, (*zip(*(cells for _, cells in shown), strict=True),), note)


@dataclass(frozen=True, eq=False)
class Solid:
    """A rigid shape in body coordinates, drawn as triangles.

    Args:
        vertices: Shape (n, 3), m, from the centre of gravity.
        triangles: The indices of the three vertices of each triangle, integers, shape (k, 3).
        is_real: Whether a real body can have the moments; the shape is then the box that has them.
    """

    vertices: Array
    triangles: Array
    is_real: bool = True

    @property
    def words(self) -> str:
        """What the shape is."""
        if self.is_real:
            return "body, as the box of its mass and moments"
        return "body: no real body has these moments, the shape shows their proportions"


@dataclass(frozen=True, eq=False)
class Tie:
    """A line of an animation, from a point of the body to a point of space.

    Args:
        name: The name of its element.
        point: The point of the body, body coordinates, shape (3,), m.
        anchor: The point of space, inertial, shape (3,), m.
        loads: The force of the element at each time, shape (n,), N: positive if it pulls the body
            toward the anchor, negative if it pushes.
    """

    name: str
    point: Array
    anchor: Array
    loads: Array


@dataclass(frozen=True, eq=False)
class Animation:
    """An animation of the trajectory of a body.

    Args:
        name: Short, unique in a report: the name of the run.
        title: The label of the run.
        times: Shape (n,), s.
        positions: X, inertial, shape (n, 3), m.
        rotations: A as unit quaternions (w, x, y, z), body to inertial, shape (n, 4).
        solid: The shape of the body.
        contact_point: R, body coordinates, shape (3,), m.
        anchor: The point to which the contact point is tied, inertial, shape (3,), m; None for a
            free body.
        ties: The elements that act between a point of the body and a point of space.
    """

    name: str
    title: str
    times: Array
    positions: Array
    rotations: Array
    solid: Solid
    contact_point: Array
    anchor: Array | None
    ties: tuple[Tie, ...] = ()


class Statement(NamedTuple):
    """An answer on a card.

    Attributes:
        question: What is asked, in a few words.
        word: How sure the answer is: proved, seen, false or not decided.
        sentence: The answer.
        tone: As of a `Cell`.
    """

    question: str
    word: str
    sentence: str
    tone: str = ""


@dataclass(frozen=True, eq=False)
class Sketch:
    """A small picture on a card: curves in a frame, with words at the ends of its axes.

    Args:
        caption: What is drawn.
        curves: Each a label ("" for a single curve) and its points in the unit square, of shape
            (n, 2); a point that is not finite is a gap.
        marks: Points that stand out, in the unit square, shape (k, 2).
        x_ends: What is at the left and at the right end of the frame, with units; "" for nothing.
        y_ends: What is at its lower and at its upper end.
    """

    caption: str
    curves: tuple[tuple[str, Array], ...]
    marks: Array | None = None
    x_ends: tuple[str, str] = ("", "")
    y_ends: tuple[str, str] = ("", "")

    @property
    def words(self) -> str:
        """What it shows, for those who do not see it."""
        up, across = (" to ".join(filter(None, ends)) for ends in (self.y_ends, self.x_ends))
        return f"{self.caption} From {up}, over {across}." if up and across else self.caption


class Card(NamedTuple):
    """What a reader wants to know first of a run or a sweep.

    Attributes:
        title: The label of the run or the sweep.
        statements: The answers, the most important one first.
        facts: A few numbers, each with its name.
        target: The anchor of the section with the details; "" for none.
        sketch: A small picture; None for none.
        alarm: What went wrong, shown beside the title in the colour of what is bad; "" for nothing.
    """

    title: str
    statements: tuple[Statement, ...]
    facts: tuple[tuple[str, str], ...] = ()
    target: str = ""
    sketch: Sketch | None = None
    alarm: str = ""

    @property
    def marked_alarm(self) -> str:
        """The alarm with the mark of what is bad."""
        return f"{MARKS['bad']} {self.alarm}" if self.alarm else ""


@dataclass(frozen=True)
class Cards:
    """Cards side by side.

    Args:
        name: Short, in lower case and hyphens, unique in a report.
        cards: The cards.
        words: The words and symbols on the cards, each with its meaning; shown below them.
    """

    name: str
    cards: tuple[Card, ...]
    words: tuple[tuple[str, str], ...] = ()

    @property
    def note(self) -> str:
        """The meanings as one paragraph; "" for none."""
        text = "; ".join(f"{word}: {meaning}" for word, meaning in self.words)
        return f"{text[:1].upper()}{text[1:]}." if text else ""


Block = str | Table | Figure | Animation | Cards
"""A paragraph, a table, a figure, an animation, or cards."""


@dataclass(frozen=True)
class Section:
    """A section of a report.

    Args:
        name: Short, in lower case and hyphens, unique in a report: its anchor.
        title: Its heading.
        blocks: Its content, in order.
        folded: Whether a page shows only the heading until the reader opens the section.
    """

    name: str
    title: str
    blocks: tuple[Block, ...]
    folded: bool = False


class Unread(NamedTuple):
    """A result that could not be read, and the reason."""

    path: str
    reason: str


@dataclass(frozen=True)
class Report:
    """A report.

    Args:
        title: Its heading.
        created: Date and time of its creation, ISO 8601.
        command: The command that repeats it.
        sections: Its sections, in order.
        unread: The results that could not be read.
    """

    title: str
    created: str
    command: str
    sections: tuple[Section, ...]
    unread: tuple[Unread, ...] = field(default=())

    @property
    def made(self) -> str:
        """When it was created, for people: date, hours and minutes; as it is if it is no date."""
        try:
            moment = datetime.fromisoformat(self.created)
        except ValueError:
            return self.created
        return f"{moment:%Y-%m-%d %H:%M}{' UTC' if moment.tzinfo is UTC else ''}"
