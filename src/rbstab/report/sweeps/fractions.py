"""Fractions of members by outcome, with confidence intervals where members are sampled."""

from typing import NamedTuple

import numpy as np

from rbstab.files.counts import grouped
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.model.figure import Axis, Figure, Intervals, Panel, Shares
from rbstab.report.sweeps.conditions.paired_conditions import paired_conditions_of
from rbstab.report.sweeps.members import FAILED, OUTCOME_COLOURS, OUTCOMES, RETURNS, Members
from rbstab.report.sweeps.table_entries import number, whole
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.proofs.columns import NO_PROOF, PROVED

CONFIDENCE = 0.95

GRID_NOTE = (
    "These are fractions of the grid points. Grid points are chosen, not sampled. So the fractions "
    "do not estimate probabilities, and they have no confidence intervals."
)
NO_PLAN_NOTE = (
    "The plan cannot be read. It is not known whether the members are sampled, so there are no "
    "confidence intervals."
)
POOLED_NOTE = (
    "These fractions pool all conditions. The conditions are chosen, not sampled. See the "
    "comparison for each condition with its confidence interval."
)
WILSON_NOTE = (
    "The limits are those of the share among all possible members, of which these are a sample, "
    "with {confidence:.0%} confidence (Wilson interval)."
)
EVEN_DESIGN_NOTE = (
    " They assume independent points. The points of this design are spread more evenly "
    "than that, so the shares are usually more accurate than the limits suggest."
)


class Fraction(NamedTuple):
    """A fraction of members with some property, and its confidence interval from low to high.

    members is the number of members with the property, total the number of all members.
    """

    label: str
    members: int
    total: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """The fraction itself."""
        return self.members / self.total


def fraction(label: str, fulfilled: Array) -> Fraction:
    """Return the fraction of members with some property, with Wilson's interval.

    Args:
        label: The property.
        fulfilled: Whether each member has it, shape (n,), n > 0.
    """
    # Imported late: SciPy's statistics take longer to load than the rest of a report.
    from scipy.stats import binomtest

    count, total = int(np.count_nonzero(fulfilled)), len(fulfilled)
    interval = binomtest(count, total).proportion_ci(CONFIDENCE, method="wilson")
    return Fraction(label, count, total, float(interval.low), float(interval.high))


def fractions_of(members: Members) -> list[Fraction]:
    """Return the fractions of each outcome, of small final |E|, and of proved convergence."""
    status, outcomes = members.column("status"), members.outcomes
    fractions = [
        fraction(word, outcomes == code)
        for code, word in enumerate(OUTCOMES)
        if members.outcome_counts[code] or code == RETURNS
    ]
    fractions += [
        fraction(f"{OUTCOMES[FAILED]}: {STATUSES[code]}", failed)
        for code in range(1, len(STATUSES))
        if (failed := (status == code) & (outcomes == FAILED)).any()
    ]
    fractions.append(fraction("completed", members.completed))
    near = members.completed & np.isfinite(members.column("displacement_settling_time"))
    fractions.append(fraction("completed, |E| below 1 mm from some time on", near))
    # Proofs may reach only the first members: then this is no fraction of all of them.
    if (members.convergence != NO_PROOF).all():
        fractions.append(fraction("proved to converge", members.convergence == PROVED))
    return fractions


def is_sampled(members: Members) -> bool:
    """Return whether the members are a sample, so that their fractions estimate probabilities."""
    plan = members.plan
    return plan is not None and plan.design is not None and list(plan.dimensions) == ["point"]


def interval_note(members: Members, has_intervals: bool) -> str:
    """Return a note on the meaning of the intervals, or on why there are none."""
    plan = members.plan
    if plan is None:
        return NO_PLAN_NOTE
    if plan.design is None:
        return GRID_NOTE
    if not has_intervals:
        return POOLED_NOTE
    note = WILSON_NOTE.format(confidence=CONFIDENCE)
    return note if plan.design.independent else note + EVEN_DESIGN_NOTE


def fraction_blocks(name: str, members: Members) -> list[Block]:
    """Return a figure of how the members ended, and a table of the fractions."""
    fractions, sampled = fractions_of(members), is_sampled(members)
    heads = [Head("outcome"), Head("members", numbers=True), Head("fraction", numbers=True)]
    if sampled:
        heads += limit_heads()
    rows = tuple(_row(part, sampled=sampled) for part in fractions)
    note = interval_note(members, sampled)
    title = "Outcomes of the members"
    return [
        *_bars(name, members),
        Table(f"{name}-fractions", title, tuple(heads), rows, note),
    ]


def limit_heads() -> list[Head]:
    """Return the headers of the columns with the limits of the intervals."""
    return [Head(f"{end} {CONFIDENCE:.0%} limit", numbers=True) for end in ("lower", "upper")]


def intervals(fractions: list[Fraction], label: str = "", colour: int = 0) -> Intervals:
    """Return fractions with their intervals as marks at the positions 0, 1, 2, ..."""
    y, low, high = (np.array([getattr(f, k) for f in fractions]) for k in ("value", "low", "high"))
    return Intervals(np.arange(float(len(fractions))), y, low, high, label, colour)


def _row(part: Fraction, *, sampled: bool) -> tuple[Cell, ...]:
    row = (Cell(part.label), whole(part.members), number(part.value))
    return (*row, number(part.low), number(part.high)) if sampled else row


def _bars(name: str, members: Members) -> list[Block]:
    """Return how the members ended as bars, one for each condition; [] if all ended alike."""
    counts = members.outcome_counts
    if np.count_nonzero(counts) < 2:
        return []
    groups = paired_conditions_of(members)
    labels = [f"{grouped(len(members))} members"] if groups is None else list(groups.labels)
    codes = np.zeros(len(members), dtype=int) if groups is None else groups.codes
    table = np.zeros((len(labels), len(OUTCOMES)), dtype=int)
    np.add.at(table, (codes, members.outcomes), 1)
    codes_of_parts = np.flatnonzero(counts).tolist()
    words = [OUTCOMES[code] for code in codes_of_parts]
    if groups is None:
        words = [f"{OUTCOMES[code]}: {grouped(counts[code])}" for code in codes_of_parts]
    colours = tuple(OUTCOME_COLOURS[code] for code in codes_of_parts)
    # The first one is the highest.
    y = Axis("", categories=tuple(labels[::-1]))
    panel = Panel(
        Axis("share of the members", ends=(0.0, 1.0)),
        y,
        (Shares(table[::-1, codes_of_parts], tuple(words), colours),),
    )
    caption = "The numbers in the bars count members."
    return [Figure(f"{name}-outcomes", "How the members ended", (panel,), caption=caption)]
