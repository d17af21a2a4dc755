"""The table of paired differences between conditions: variants, and parameters marked `each`."""

import math

from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.model.words import NO_VALUE, listed
from rbstab.report.sweeps.conditions.paired_difference import MATTERS, PairedDifference
from rbstab.report.sweeps.conditions.ranking import REGULARITY, rankings_of
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.outcomes import CONFIDENCE
from rbstab.report.sweeps.table_entries import number, whole

V_NOTE = (
    "v(0) is not compared: each condition has its own Lyapunov function, so that a smaller value "
    "means nothing."
)

PAIR_NOTE = (
    "The two members of a pair differ only in their condition. Pairs with equal values are "
    "counted, and have no part in the other columns. A difference is named if {sure}the median is "
    f"at least {MATTERS:.0%} of the values, and no more pairs are equal than differ. The columns "
    "'of the pairs below' say how much single pairs differ; they are no interval of confidence."
)

INTERVAL_NOTE = (
    f" The interval contains the median of all possible pairs with {CONFIDENCE:.0%} confidence (by "
    "order statistics of the differences, which assume nothing but independent pairs)."
)


def difference_table(name: str, members: Members) -> list[Table]:
    """Return how much each condition differs from the best one; [] without pairs of members."""
    rankings = rankings_of(members)
    if not rankings:
        return []
    sampled = rankings[0].sampled
    interval = [Head(f"{CONFIDENCE:.0%} interval of the median", numbers=True)] if sampled else []
    heads = (
        Head("quantity"),
        Head("difference"),
        Head("smaller with"),
        Head("median", numbers=True),
        *interval,
        *(Head(f"{share} of the pairs below", numbers=True) for share in ("5%", "95%")),
        Head("share of the pairs above 0", numbers=True),
        Head("pairs", numbers=True),
        Head("equal pairs", numbers=True),
    )
    rows, notes = [], [V_NOTE] if rankings[0].groups.has_own_v else []
    for ranking in rankings:
        labels, label = ranking.groups.labels, ranking.quantity.axis.label
        others = [k for k in range(len(labels)) if k not in ranking.zero]
        reference = others[0] if ranking.best is None else ranking.best
        if ranking.best is None:
            notes.append(f"None is the best in {label}: compared with {labels[reference]}.")
        else:
            larger = " (larger is better)" if ranking.quantity.name == REGULARITY else ""
            notes.append(f"Best in {label}{larger}: {labels[reference]}, as none is better.")
        if ranking.zero:
            zero = listed(labels[k] for k in ranking.zero)
            notes.append(f"Always 0 with {zero}, by construction: {label}.")
        for k in others:
            if k != reference:
                found = ranking.difference(k, reference)
                smaller = _smaller(found, labels[k], labels[reference], sampled=sampled)
                entries = smaller, *_entries(found, sampled=sampled)
                subtraction = f"{labels[k]} minus {labels[reference]}"
                rows.append((Cell(ranking.quantity.axis.text), Cell(subtraction), *entries))
    sure = "the interval of the median excludes zero, " if sampled else ""
    note = " ".join([*notes, PAIR_NOTE.format(sure=sure) + (INTERVAL_NOTE if sampled else "")])
    title = "Paired differences from the best condition"
    return [Table(f"{name}-pairs", title, heads, tuple(rows), note)]


def _smaller(found: PairedDifference, first: str, second: str, *, sampled: bool) -> Cell:
    """Return which of two conditions has the smaller values, or why none is named."""
    if not found.pairs and not found.equal:
        return Cell("no common case")
    if not found.is_alike(sampled=sampled):
        return Cell(first if found.median < 0 else second)
    if found.equal > found.pairs:
        return Cell("equal in most pairs" if found.pairs else "equal in all pairs")
    if sampled and not found.is_sure:
        return Cell("no sure difference")
    return Cell(f"none: less than {MATTERS:.0%}")


def _entries(found: PairedDifference, *, sampled: bool) -> tuple[Cell, ...]:
    """Return the numbers of a difference."""
    ends = [number(end) for end in (found.low, found.high)]
    # An interval without ends is that of few pairs.
    is_open = (found.low, found.high) == (-math.inf, math.inf)
    interval = Cell(NO_VALUE) if is_open else Cell(" to ".join(end.text for end in ends))
    return (
        number(found.median),
        *([interval] if sampled else []),
        *map(number, found.ends),
        number(1.0 - found.negative),
        whole(found.pairs),
        whole(found.equal),
    )
