"""The table of paired differences between conditions: variants, and parameters marked `each`."""

import math

from rbstab.experiment.answers.rounded import NO_VALUE
from rbstab.report.model.document import Cell, Entry, Head, Table
from rbstab.report.model.words import listed
from rbstab.report.sweeps.conditions.paired_difference import MATTERS, PairedDifference
from rbstab.report.sweeps.conditions.ranking import REGULARITY, rankings_of
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.outcomes import CONFIDENCE

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
    heads: list[str | Head] = [
        *("quantity", "difference", "smaller with", "median"),
        Head(f"{CONFIDENCE:.0%} interval of the median", numbers=True),
        *(f"{share} of the pairs below" for share in ("5%", "95%")),
        *("share of the pairs above 0", "pairs", "equal pairs"),
    ]
    rows, notes = [], [V_NOTE] if rankings[0].groups.v_differs else []
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
                difference = ranking.difference(k, reference)
                smaller = _smaller(difference, labels[k], labels[reference], sampled=sampled)
                subtraction = f"{labels[k]} minus {labels[reference]}"
                numbers = _numbers(difference, sampled=sampled)
                rows.append((ranking.quantity.axis.text, subtraction, smaller, *numbers))
    sure = "the interval of the median excludes zero, " if sampled else ""
    note = " ".join([*notes, PAIR_NOTE.format(sure=sure) + (INTERVAL_NOTE if sampled else "")])
    title = "Paired differences from the best condition"
    return [Table.of(f"{name}-pairs", title, heads, rows, note)]


def _smaller(difference: PairedDifference, first: str, second: str, *, sampled: bool) -> str:
    """Return which of two conditions has the smaller values, or why none is named."""
    if not difference.pairs and not difference.equal:
        return "no common case"
    if not difference.is_alike(sampled=sampled):
        return first if difference.median < 0 else second
    if difference.equal > difference.pairs:
        return "equal in most pairs" if difference.pairs else "equal in all pairs"
    if sampled and not difference.is_sure:
        return "no sure difference"
    return f"none: less than {MATTERS:.0%}"


def _numbers(difference: PairedDifference, *, sampled: bool) -> tuple[Entry, ...]:
    """Return the numbers of a difference; without a sample it has no interval."""
    ends = difference.low, difference.high
    interval = " to ".join(Cell.number(end).text for end in ends) if sampled else ""
    # An interval without ends is that of few pairs.
    if sampled and ends == (-math.inf, math.inf):
        interval = NO_VALUE
    above = 1.0 - difference.negative
    return difference.median, interval, *difference.ends, above, difference.pairs, difference.equal
