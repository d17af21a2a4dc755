"""Groups of members side by side: variants, or whatever is taken with every point of a design."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.model.figure import Axis, Figure, Intervals, Panel
from rbstab.report.sweeps.distributions import quantiles_of
from rbstab.report.sweeps.fractions import CONFIDENCE, Fraction, fraction, how_drawn, intervals
from rbstab.report.sweeps.members import ENDS, SETTLED, Members
from rbstab.report.sweeps.paired_conditions import PairedConditions, paired_conditions_of
from rbstab.report.sweeps.quantities import (
    Quantity,
    peak_displacement,
    regularity,
    settling_time,
    start_energy,
)
from rbstab.report.sweeps.table_entries import number, whole

SPREAD = (0.05, 0.5, 0.95)
"""Quantiles that are set side by side."""


def comparison_blocks(name: str, members: Members) -> list[Block]:
    """The groups of a sweep side by side; nothing where there is only one."""
    groups = paired_conditions_of(members)
    if groups is None:
        return []
    settled = _settled(members, groups)
    plan = members.plan
    drawn = plan is not None and plan.design is not None
    blocks: list[Block] = [_ends(name, members, groups, settled, drawn=drawn)]
    found = _quantities(members)
    blocks.append(_figure(name, groups, settled, found, drawn=drawn))
    if found:
        blocks.append(_quantiles(name, groups, found))
    if found and groups.pairs is not None:
        blocks.append(_pairs(name, groups, found))
    return blocks


def _quantities(members: Members) -> list[Quantity]:
    found = (q(members) for q in (settling_time, peak_displacement, regularity, start_energy))
    return [quantity for quantity in found if np.isfinite(quantity.values).any()]


def _settled(members: Members, groups: PairedConditions) -> list[Fraction]:
    yes = members.ends == ENDS.index(SETTLED)
    return [fraction(label, yes[groups.codes == k]) for k, label in enumerate(groups.labels)]


def _ends(
    name: str,
    members: Members,
    groups: PairedConditions,
    settled: list[Fraction],
    *,
    drawn: bool,
) -> Table:
    occurring = np.flatnonzero(members.counts).tolist()
    heads = [Head("members"), Head("count", numbers=True)]
    heads += [Head(ENDS[code], numbers=True) for code in occurring]
    heads += [Head("share settled", numbers=True)]
    if drawn:
        heads += [Head(f"{end}, {CONFIDENCE:.0%}", numbers=True) for end in ("from", "to")]
    rows = []
    for k, (label, part) in enumerate(zip(groups.labels, settled, strict=True)):
        counts = np.bincount(members.ends[groups.codes == k], minlength=len(ENDS))
        row = [Cell(label), whole(part.of), *(whole(int(counts[code])) for code in occurring)]
        row += [number(part.value)]
        rows.append((*row, *((number(part.low), number(part.high)) if drawn else ())))
    note = how_drawn(members, drawn)
    return Table(f"{name}-compared", "How members ended", tuple(heads), tuple(rows), note)


def _quantiles(name: str, groups: PairedConditions, found: list[Quantity]) -> Table:
    heads = (
        Head("quantity"),
        Head("members"),
        Head("count", numbers=True),
        *(Head("median" if q == 0.5 else f"{q:.0%}", numbers=True) for q in SPREAD),
    )
    rows = []
    for quantity in found:
        for k, label in enumerate(groups.labels):
            own = quantity.values[groups.codes == k]
            spread = (number(value) for value in quantiles_of(own, SPREAD))
            counted = whole(int(np.isfinite(own).sum()))
            rows.append((Cell(quantity.axis.text), Cell(label), counted, *spread))
    return Table(f"{name}-compared-quantiles", "Quantiles side by side", heads, tuple(rows))


def _figure(
    name: str,
    groups: PairedConditions,
    settled: list[Fraction],
    found: list[Quantity],
    *,
    drawn: bool,
) -> Figure:
    x = Axis("", words=groups.labels)
    if not drawn:
        settled = [part._replace(low=part.value, high=part.value) for part in settled]
    panels = [Panel(x, Axis("share settled"), (intervals(settled),))]
    panels += [Panel(x, quantity.axis, (_spread(groups, quantity),)) for quantity in found]
    what = "Medians, with the range from 5 % to 95 % of the members"
    first = f"of the share, Wilson's interval of {CONFIDENCE:.0%} confidence" if drawn else ""
    caption = f"{what}; {first}." if first else f"{what}."
    return Figure(f"{name}-side-by-side", "Side by side", tuple(panels), 2, caption=caption)


def _spread(groups: PairedConditions, quantity: Quantity) -> Intervals:
    rows = [
        quantiles_of(quantity.values[groups.codes == k], SPREAD) for k in range(len(groups.labels))
    ]
    low, middle, high = np.array(rows).T
    return Intervals(np.arange(float(len(rows))), middle, low, high)


def _pairs(name: str, groups: PairedConditions, found: list[Quantity]) -> Table:
    """Differences between members that differ in their group alone, to the first group."""
    assert groups.pairs is not None
    heads = (
        Head("quantity"),
        Head("members"),
        Head("pairs", numbers=True),
        Head("smaller in", numbers=True),
        *(Head("median" if q == 0.5 else f"{q:.0%}", numbers=True) for q in SPREAD),
    )
    first, rows = groups.labels[0], []
    for quantity in found:
        values = quantity.values[groups.pairs]
        for k, label in enumerate(groups.labels[1:], start=1):
            difference = values[:, k] - values[:, 0]
            difference = difference[np.isfinite(difference)]
            smaller = _share(difference < 0)
            spread = (number(value) for value in quantiles_of(difference, SPREAD))
            name_of = Cell(f"{label} less {first}")
            counted = whole(len(difference))
            rows.append((Cell(quantity.axis.text), name_of, counted, number(smaller), *spread))
    note = (
        "Of members with the same number of the point, or the same place in the grid, that both "
        "have the quantity; the column 'smaller in' is the share of the pairs in which the "
        "difference is negative."
    )
    return Table(f"{name}-pairs", f"Differences to {first}, pair by pair", heads, tuple(rows), note)


def _share(yes: Array) -> float:
    return float(yes.mean()) if len(yes) else float("nan")
