"""Comparison of conditions: variants, and parameters marked `each` in the plan."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.model.figure import SHARE_ENDS, Axis, Figure, Intervals, Panel
from rbstab.report.sweeps.conditions.failures import failure_sentences
from rbstab.report.sweeps.conditions.pair_tables import difference_table, pairs_tables
from rbstab.report.sweeps.conditions.paired_conditions import PairedConditions, paired_conditions_of
from rbstab.report.sweeps.conditions.ranking import (
    PEAK,
    SETTLING,
    compared_sentence,
    ranking_sentences,
)
from rbstab.report.sweeps.distributions import quantiles_of
from rbstab.report.sweeps.fractions import (
    CONFIDENCE,
    Fraction,
    fraction,
    interval_note,
    intervals,
    limit_heads,
)
from rbstab.report.sweeps.members import LEFT_RANGE, OUTCOMES, RETURNS, Members
from rbstab.report.sweeps.quantities import (
    MemberQuantity,
    peak_displacement,
    regularity,
    settling_time,
)
from rbstab.report.sweeps.table_entries import number, whole

SPREAD = (0.5, 0.05, 0.95)
"""Orders of the quantiles in the comparison; the median comes first, as a narrow page shows it."""

SMALLER_IS_BETTER = (SETTLING, PEAK)
"""The names of the quantities by which a condition is better than another."""

V_NOTE = (
    "v(0) is not compared: each condition has its own Lyapunov function, so that a smaller value "
    "means nothing."
)


def comparison_blocks(name: str, members: Members) -> list[Block]:
    """Return the comparison of the conditions of a sweep; [] if there are none."""
    groups = paired_conditions_of(members)
    if groups is None:
        return []
    # Where inputs supply power, members need not come to rest.
    outcome = LEFT_RANGE if members.driven else RETURNS
    shares = _shares(members, groups, outcome)
    plan = members.plan
    sampled = plan is not None and plan.design is not None
    of_v = [V_NOTE] if groups.has_own_v else []
    blocks: list[Block] = [*of_v, _outcomes(name, members, groups, shares, sampled=sampled)]
    quantities = compared_quantities(members)
    blocks += _figure(name, groups, shares, quantities, sampled=sampled)
    if quantities:
        blocks.append(_quantiles(name, groups, quantities))
    if quantities and groups.pairs is not None:
        blocks.append(difference_table(name, groups, quantities, sampled=sampled))
        if len(groups.labels) > 2:
            better = [quantity for quantity in quantities if quantity.name in SMALLER_IS_BETTER]
            blocks += pairs_tables(name, groups, better, sampled=sampled)
    return blocks


def ranking(members: Members, quantities: list[MemberQuantity]) -> list[str]:
    """Return sentences that say which condition is better, and how surely.

    First how many runs of each ended early, then each quantity.
    """
    groups = paired_conditions_of(members)
    if groups is None:
        return []
    plan = members.plan
    sampled = plan is not None and plan.design is not None
    better = [quantity for quantity in quantities if quantity.name in SMALLER_IS_BETTER]
    sentences = failure_sentences(members, groups, sampled=sampled)
    sentences += ranking_sentences(groups, better, sampled=sampled)
    if not sentences:
        return []
    return sentences if groups.pairs is None else [compared_sentence(groups), *sentences]


def compared_quantities(members: Members) -> list[MemberQuantity]:
    """Return the quantities that conditions are compared by, if they have finite values."""
    quantities = (q(members) for q in (settling_time, peak_displacement, regularity))
    return [quantity for quantity in quantities if np.isfinite(quantity.values).any()]


class _Shares(NamedTuple):
    """The share of members with an outcome, by condition."""

    outcome: str
    by_condition: list[Fraction]


def _shares(members: Members, groups: PairedConditions, outcome: int) -> _Shares:
    has = members.outcomes == outcome
    found = [fraction(label, has[groups.codes == k]) for k, label in enumerate(groups.labels)]
    return _Shares(OUTCOMES[outcome], found)


def _outcomes(
    name: str,
    members: Members,
    groups: PairedConditions,
    shares: _Shares,
    *,
    sampled: bool,
) -> Table:
    occurring = np.flatnonzero(members.outcome_counts).tolist()
    # The columns that decide come first: a narrow page shows only these.
    heads = [Head("condition"), Head(f"share: {shares.outcome}", numbers=True)]
    if sampled:
        heads += limit_heads()
    heads += [Head(OUTCOMES[code], numbers=True) for code in occurring]
    heads += [Head("members", numbers=True)]
    rows = []
    for k, (label, share) in enumerate(zip(groups.labels, shares.by_condition, strict=True)):
        counts = np.bincount(members.outcomes[groups.codes == k], minlength=len(OUTCOMES))
        limits = (number(share.low), number(share.high)) if sampled else ()
        of_each = (whole(int(counts[code])) for code in occurring)
        rows.append((Cell(label), number(share.value), *limits, *of_each, whole(share.total)))
    note = interval_note(members, sampled)
    return Table(f"{name}-compared", "Outcomes by condition", tuple(heads), tuple(rows), note)


def _quantiles(name: str, groups: PairedConditions, quantities: list[MemberQuantity]) -> Table:
    """Return a row for each condition: of each quantity the median, and the span of most values."""
    heads = (
        Head("condition"),
        *(Head(q.axis.label, q.axis.unit, numbers=True) for q in quantities),
    )
    rows = [
        (Cell(label), *(_median_and_spread(q.ranked[groups.codes == k]) for q in quantities))
        for k, label in enumerate(groups.labels)
    ]
    shown = (
        "The median of the members that have a value, and in parentheses the 5% and the 95% "
        "quantile."
    )
    note = " ".join([shown, *(quantity.note for quantity in quantities if quantity.note)])
    return Table(f"{name}-compared-quantiles", "Quantiles by condition", heads, tuple(rows), note)


def _median_and_spread(values: Array) -> Cell:
    median, low, high = quantiles_of(values, SPREAD)
    cells = [number(value) for value in (median, low, high)]
    if np.isnan(median):
        return cells[0]
    middle, *ends = (cell.text for cell in cells)
    return Cell(f"{middle} ({' to '.join(ends)})", cells[0].value)


def _figure(
    name: str,
    groups: PairedConditions,
    shares: _Shares,
    quantities: list[MemberQuantity],
    *,
    sampled: bool,
) -> list[Figure]:
    """Return a panel for the share of the outcome, if it differs, and for each quantity."""
    x = Axis("", categories=groups.labels)
    drawn = shares.by_condition
    if not sampled:
        drawn = [share._replace(low=share.value, high=share.value) for share in drawn]
    panels, notes = [], []
    if len({share.value for share in drawn}) > 1:
        panels = [Panel(x, Axis(f"share: {shares.outcome}", ends=SHARE_ENDS), (intervals(drawn),))]
        if sampled:
            notes = [f"The bars of the share: {shares.outcome} are its {CONFIDENCE:.0%} interval."]
    panels += [Panel(x, quantity.axis, (_spread(groups, quantity),)) for quantity in quantities]
    if not panels:
        return []
    if quantities:
        notes.append("The bars of medians reach from the 5% to the 95% quantile of the members.")
    caption = " ".join([*notes, *(quantity.note for quantity in quantities if quantity.note)])
    title = "Comparison of conditions"
    return [Figure(f"{name}-side-by-side", title, tuple(panels), 2, caption=caption)]


def _spread(groups: PairedConditions, quantity: MemberQuantity) -> Intervals:
    rows = [
        quantiles_of(quantity.ranked[groups.codes == k], SPREAD) for k in range(len(groups.labels))
    ]
    middle, low, high = np.where(np.isinf(rows), quantity.end, rows).T
    return Intervals(np.arange(float(len(rows))), middle, low, high)
