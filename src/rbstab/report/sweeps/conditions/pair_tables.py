"""Tables of paired differences: from the best condition, and between all pairs of conditions."""

import math
from dataclasses import replace
from itertools import combinations

from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.model.words import NO_VALUE, listed, number
from rbstab.report.sweeps.conditions.paired_conditions import PairedConditions
from rbstab.report.sweeps.conditions.paired_difference import (
    MATTERS,
    PairedDifference,
    paired_values,
)
from rbstab.report.sweeps.conditions.ranking import (
    LARGER_IS_BETTER,
    always_zero,
    best_of,
    comparable,
    is_alike,
)
from rbstab.report.sweeps.distributions import quantiles_of
from rbstab.report.sweeps.fractions import CONFIDENCE
from rbstab.report.sweeps.quantities import MemberQuantity
from rbstab.report.sweeps.table_entries import whole

INTERVAL = f"{CONFIDENCE:.0%} interval of the median"
"""The header of the column of intervals of a median."""

INTERVAL_NOTE = (
    f"The interval contains the median of all possible pairs with {CONFIDENCE:.0%} confidence (by "
    "order statistics of the differences, which assume nothing but independent pairs)."
)

SPREAD_NOTE = (
    "The columns 'of the pairs below' say how much single pairs differ; they are no interval of "
    "confidence."
)

PAIR_NOTE = (
    "The two members of a pair differ only in their condition. Pairs with equal values are "
    "counted, and have no part in the other columns."
)


MIN_MATRIX, MAX_MATRIX = 3, 8
"""The numbers of conditions of a matrix: of two, one line says all; of more, it does not fit."""

MATRIX_NOTE = (
    "Median of the paired differences, the condition with the smallest median first. The mark says "
    "that the difference matters, as in the table below, which has each pair with its interval."
)


def difference_table(
    name: str, groups: PairedConditions, quantities: list[MemberQuantity], *, sampled: bool
) -> Table:
    """Return how much each condition differs from the best one, for each quantity.

    Args:
        name: The anchor of the sweep.
        groups: The conditions.
        quantities: The quantities.
        sampled: Whether the members are a sample; otherwise the medians have no intervals.
    """
    heads = (
        Head("quantity"),
        Head("difference"),
        Head("median", numbers=True),
        *([Head(INTERVAL, numbers=True)] if sampled else []),
        *(Head(f"{share} of the pairs below", numbers=True) for share in ("5%", "95%")),
        Head("share of the pairs above 0", numbers=True),
        Head("pairs", numbers=True),
        Head("equal pairs", numbers=True),
    )
    rows: list[tuple[Cell, ...]] = []
    notes: list[str] = []
    for quantity in quantities:
        reference, why = _reference(groups, quantity, sampled=sampled)
        notes += [why, _zero_note(groups, quantity)]
        zero = always_zero(groups, quantity)
        for k, label in enumerate(groups.labels):
            if k == reference or k in zero:
                continue
            subtraction = f"{label} minus {groups.labels[reference]}"
            found = _between(groups, quantity, k, reference)
            entries = _entries(found, sampled=sampled)
            rows.append((Cell(quantity.axis.text), Cell(subtraction), *entries))
    notes += [PAIR_NOTE, SPREAD_NOTE, INTERVAL_NOTE if sampled else ""]
    note = " ".join(filter(None, notes))
    title = "Paired differences from the best condition"
    return Table(f"{name}-pairs", title, heads, tuple(rows), note)


def pairs_tables(
    name: str, groups: PairedConditions, quantities: list[MemberQuantity], *, sampled: bool
) -> list[Table]:
    """Return which of each two conditions has the smaller values: a matrix, and each pair once.

    Args:
        name: The anchor of the sweep.
        groups: The conditions.
        quantities: The quantities, each of which is better if it is smaller. There is no table of
            one in which there are no two conditions to compare.
        sampled: As of `difference_table`.
    """
    shown = [quantity for quantity in quantities if len(comparable(groups, quantity)) > 1]
    tables = [_pairs_table(name, groups, quantity, sampled=sampled) for quantity in shown]
    # The note of the first one holds for all.
    note = _naming_note(sampled=sampled)
    tables = [
        replace(table, note=f"{table.note if k else f'{table.note} {note}'}".strip())
        for k, table in enumerate(tables)
    ]
    matrices = [_matrix(name, groups, quantity, sampled=sampled) for quantity in shown]
    pairs = zip(matrices, tables, strict=True)
    return [table for both in pairs for table in both if table is not None]


def _naming_note(*, sampled: bool) -> str:
    """Return when a condition is named in a table of pairs."""
    sure = "the interval of the median excludes zero, " if sampled else ""
    return (
        f"The condition with the smaller values is first. It is named if {sure}the median is at "
        f"least {MATTERS:.0%} of the values, and no more pairs are equal than differ. Each pair of "
        "conditions is judged by itself."
    )


def _pairs_table(
    name: str, groups: PairedConditions, quantity: MemberQuantity, *, sampled: bool
) -> Table:
    order = comparable(groups, quantity)
    unit = quantity.axis.unit
    heads = (
        Head("pair"),
        Head("smaller with"),
        Head("median", unit, numbers=True),
        *([Head(INTERVAL, unit, numbers=True)] if sampled else []),
        Head("smaller in this share of the pairs", numbers=True),
        Head("pairs", numbers=True),
        Head("equal pairs", numbers=True),
    )
    rows = [_row(groups, quantity, pair, sampled=sampled) for pair in combinations(order, 2)]
    title = f"{quantity.axis.label}: all pairs of conditions"
    note = _zero_note(groups, quantity)
    return Table(f"{name}-all-pairs-{quantity.name}", title, heads, tuple(rows), note)


def _matrix(
    name: str, groups: PairedConditions, quantity: MemberQuantity, *, sampled: bool
) -> Table | None:
    """Return the median differences of all pairs at one glance; None for few or many conditions."""
    values = paired_values(groups, quantity).values
    medians = [quantiles_of(values[:, k], (0.5,))[0] for k in range(len(groups.labels))]
    order = sorted(comparable(groups, quantity), key=lambda k: medians[k])
    if not MIN_MATRIX <= len(order) <= MAX_MATRIX:
        return None
    rows = []
    for place, row in enumerate(order[:-1]):
        cells = [Cell("")] * place
        for column in order[place + 1 :]:
            found = _between(groups, quantity, row, column)
            tone = "good" if found.median < 0 else "bad"
            alike = is_alike(found, sampled=sampled)
            cells.append(_difference(found.median)._replace(tone="" if alike else tone))
        rows.append((Cell(groups.labels[row]), *cells))
    heads = (
        Head("row minus column", quantity.axis.unit),
        *(Head(groups.labels[k], numbers=True) for k in order[1:]),
    )
    title = f"{quantity.axis.label}: matrix of all pairs"
    return Table(f"{name}-matrix-{quantity.name}", title, heads, tuple(rows), MATRIX_NOTE)


def _zero_note(groups: PairedConditions, quantity: MemberQuantity) -> str:
    """Return which conditions are left out, as they hold the contact point; "" for none."""
    zero = listed(groups.labels[k] for k in always_zero(groups, quantity))
    return f"Always 0 with {zero}, by construction: {quantity.axis.label}." if zero else ""


def _reference(
    groups: PairedConditions, quantity: MemberQuantity, *, sampled: bool
) -> tuple[int, str]:
    """Return the condition from which differences are taken, and a sentence on it."""
    label = quantity.axis.label
    best = best_of(groups, quantity, sampled=sampled)
    if best is not None:
        larger = " (larger is better)" if quantity.name in LARGER_IS_BETTER else ""
        return best, f"Best in {label}{larger}: {groups.labels[best]}, as none is better."
    zero = always_zero(groups, quantity)
    first = next(k for k in range(len(groups.labels)) if k not in zero)
    of_first = f"the differences are from the first, {groups.labels[first]}"
    return first, f"None is the best in {label}: {of_first}."


def _between(
    groups: PairedConditions, quantity: MemberQuantity, first: int, second: int
) -> PairedDifference:
    """Return the differences between two conditions."""
    return paired_values(groups, quantity).difference(first, second)


def _entries(found: PairedDifference, *, sampled: bool) -> tuple[Cell, ...]:
    """Return the entries on a difference from the best condition."""
    above = 1.0 - found.negative
    return (
        _difference(found.median),
        *([_interval(found.low, found.high)] if sampled else []),
        *map(_difference, found.ends),
        Cell(number(above), above),
        whole(found.pairs),
        whole(found.equal),
    )


def _row(
    groups: PairedConditions, quantity: MemberQuantity, pair: tuple[int, int], *, sampled: bool
) -> tuple[Cell, ...]:
    """Return the row of a pair of conditions, that with the smaller values first."""
    smaller, larger = pair
    found = _between(groups, quantity, larger, smaller)
    if found.median < 0:
        smaller, larger = larger, smaller
        found = _between(groups, quantity, larger, smaller)
    labels = groups.labels
    share = 1.0 - found.negative
    return (
        Cell(f"{labels[smaller]}, {labels[larger]}"),
        _smaller(found, labels[smaller], sampled=sampled),
        _difference(found.median),
        *([_interval(found.low, found.high)] if sampled else []),
        Cell(number(share), share),
        whole(found.pairs),
        whole(found.equal),
    )


def _smaller(found: PairedDifference, label: str, *, sampled: bool) -> Cell:
    """Return which condition has the smaller values, or why none is named."""
    if not found.pairs and not found.equal:
        return Cell("no common case")
    if not is_alike(found, sampled=sampled):
        return Cell(label, tone="good")
    if found.equal > found.pairs:
        return Cell("equal in most pairs" if found.pairs else "equal in all pairs")
    if sampled and not found.is_sure:
        return Cell("no sure difference")
    return Cell(f"none: less than {MATTERS:.0%}")


def _difference(value: float) -> Cell:
    """Return a difference; an infinite one is that from a value after the end of a run."""
    if math.isinf(value):
        return Cell("later" if value > 0 else "earlier")
    return Cell(number(value), value)


def _interval(low: float, high: float) -> Cell:
    """Return the interval of a median; one without ends is that of few pairs."""
    if math.isinf(low) and math.isinf(high) and low < high:
        return Cell(NO_VALUE)
    return Cell(f"{_difference(low).text} to {_difference(high).text}")
