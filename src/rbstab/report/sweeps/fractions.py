"""How many members end in which way, and what that says of all that could have been drawn."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.model.figure import Axis, Figure, Intervals, Panel
from rbstab.report.sweeps.members import ENDS, SETTLED, Members
from rbstab.report.sweeps.table_entries import number, whole
from rbstab.sweep.members.convergence import NO_PROOF, PROVED
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.plan.designs import RandomDesign

CONFIDENCE = 0.95

OF_A_GRID = (
    "These are fractions of the grid, whose points are chosen and not drawn: they have no "
    "confidence intervals, and are probabilities of nothing."
)
OF_EACH = (
    "These are fractions of members of different circumstances taken together, which were not "
    "drawn; fractions of each, with their intervals, stand with the comparison."
)
OF_DRAWS = "The intervals are those of Wilson, of {confidence:.0%} confidence (scipy)."
OF_EVEN_DRAWS = (
    " They are those of independent points; the points of this design are more even, and the "
    "fractions usually nearer to the truth than they say."
)


class Fraction(NamedTuple):
    """How many of some members fulfil something, with the interval of the probability."""

    label: str
    members: int
    of: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """The fraction itself."""
        return self.members / self.of


def fraction(label: str, yes: Array) -> Fraction:
    """The fraction of members that fulfil something, with Wilson's interval.

    Args:
        label: What they fulfil.
        yes: Whether each does, shape (n,), n > 0.
    """
    # Imported late: SciPy's statistics take longer to load than all else of a report.
    from scipy.stats import binomtest

    count, of = int(np.count_nonzero(yes)), len(yes)
    interval = binomtest(count, of).proportion_ci(CONFIDENCE, method="wilson")
    return Fraction(label, count, of, float(interval.low), float(interval.high))


def fractions_of(members: Members) -> list[Fraction]:
    """The fractions of a sweep: of each end that occurs, and of what is known beside."""
    status, ends = members.column("status"), members.ends
    found = [fraction("completed", members.completed)]
    found += [
        fraction(f"completed, {ENDS[code]}", ends == code)
        for code in (0, 1)
        if members.counts[code] or ENDS[code] == SETTLED
    ]
    found += [
        fraction(str(STATUSES[code]), status == code)
        for code in range(1, len(STATUSES))
        if members.counts[code + 1]
    ]
    near = members.completed & np.isfinite(members.column("displacement_settling_time"))
    found.append(fraction("completed, |E| < 1 mm for good", near))
    if (members.convergence != NO_PROOF).any():
        found.append(fraction("proved to converge", members.convergence == PROVED))
    return found


def is_drawn(members: Members) -> bool:
    """Whether members are draws, so that fractions of them estimate probabilities."""
    plan = members.plan
    return plan is not None and plan.design is not None and list(plan.dimensions) == ["point"]


def how_drawn(members: Members, drawn: bool) -> str:
    """What intervals mean for this design, in words."""
    plan = members.plan
    if plan is None or plan.design is None:
        return OF_A_GRID
    if not drawn:
        return OF_EACH
    said = OF_DRAWS.format(confidence=CONFIDENCE)
    return said if isinstance(plan.design, RandomDesign) else said + OF_EVEN_DRAWS


def fraction_blocks(name: str, members: Members) -> list[Block]:
    """The table of fractions, and a figure of them where they have intervals."""
    found, drawn = fractions_of(members), is_drawn(members)
    heads = [Head("outcome"), Head("members", numbers=True), Head("fraction", numbers=True)]
    if drawn:
        heads += [Head(f"{end}, {CONFIDENCE:.0%}", numbers=True) for end in ("from", "to")]
    rows = tuple(_row(part, drawn=drawn) for part in found)
    note = how_drawn(members, drawn)
    blocks: list[Block] = [
        Table(f"{name}-fractions", "How members ended", tuple(heads), rows, note)
    ]
    if drawn:
        blocks.append(_figure(name, found, note))
    return blocks


def intervals(found: list[Fraction], label: str = "", colour: int = 0) -> Intervals:
    """Fractions side by side, at 0, 1, 2, ..."""
    y, low, high = (np.array([getattr(f, k) for f in found]) for k in ("value", "low", "high"))
    return Intervals(np.arange(float(len(found))), y, low, high, label, colour)


def _row(part: Fraction, *, drawn: bool) -> tuple[Cell, ...]:
    row = (Cell(part.label), whole(part.members), number(part.value))
    return (*row, number(part.low), number(part.high)) if drawn else row


def _figure(name: str, found: list[Fraction], note: str) -> Figure:
    x = Axis("outcome", words=tuple(part.label for part in found))
    panel = Panel(x, Axis("fraction of the members"), (intervals(found),))
    return Figure(f"{name}-outcomes", "How members ended", (panel,), caption=note)
