"""Which of several conditions is better in a quantity, and how surely: paired differences."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.model.words import NO_VALUE, counted, listed, number
from rbstab.report.sweeps.conditions.paired_conditions import PairedConditions
from rbstab.report.sweeps.fractions import CONFIDENCE
from rbstab.report.sweeps.quantities import MemberQuantity

MATTERS = 0.01
"""A median difference matters if it is at least this fraction of the values.

Gains, inertia and initial states of a real body are not known better than to about 1 %.
"""

INTERVAL_NOTE = (
    f"The interval of a median is that of order statistics, with {CONFIDENCE:.0%} confidence: it "
    "assumes nothing but independent pairs."
)


PLAIN_NAMES = {
    "settling-time": "The time to come to rest ({})",
    "peak-displacement": "The largest displacement of the contact point ({})",
}
"""Names of quantities that need no explanation, by their short names; their labels follow."""


class PairedDifference(NamedTuple):
    """The differences of a quantity between members that differ only in their condition.

    Attributes:
        pairs: The number of pairs in which both members have a value.
        negative: The share of pairs with a negative difference.
        median: The median of the differences; NaN without pairs.
        low: The lower end of its confidence interval; -inf if there are too few pairs.
        high: The upper end; likewise.
        scale: The larger median of the magnitudes of both members; 0 without pairs.
    """

    pairs: int
    negative: float
    median: float
    low: float
    high: float
    scale: float = 0.0

    @property
    def is_sure(self) -> bool:
        """Whether the interval of the median excludes zero."""
        return self.low > 0 or self.high < 0

    @property
    def matters(self) -> bool:
        """Whether the median difference is large enough beside the values, see `MATTERS`."""
        return self.pairs > 0 and abs(self.median) >= MATTERS * self.scale


def paired_difference(first: Array, second: Array) -> PairedDifference:
    """Return the differences first - second.

    With ranks k and n + 1 - k of n sorted differences, the median lies between them unless fewer
    than k of the differences are on one side of it; that number is binomial with p = 1/2.

    Args:
        first: The quantity of the members of one condition, shape (n,).
        second: That of their partners.
    """
    has_both = np.isfinite(first - second)
    difference = np.sort((first - second)[has_both])
    count = len(difference)
    if not count:
        return PairedDifference(0, np.nan, np.nan, -np.inf, np.inf)
    # Imported late: SciPy's statistics take longer to load than the rest of a report.
    from scipy.stats import binom

    rank = int(binom.ppf(0.5 * (1.0 - CONFIDENCE), count, 0.5))
    low, high = (-np.inf, np.inf) if rank < 1 else difference[[rank - 1, count - rank]].tolist()
    negative = float((difference < 0).mean())
    scale = max(float(np.median(np.abs(side[has_both]))) for side in (first, second))
    return PairedDifference(count, negative, float(np.median(difference)), low, high, scale)


def ranking_sentences(
    groups: PairedConditions, quantities: list[MemberQuantity], *, sampled: bool
) -> list[str]:
    """Return what is compared, and a sentence on each quantity: the best condition, and how surely.

    Args:
        groups: The conditions.
        quantities: The quantities, each of which is better if it is smaller.
        sampled: Whether the members are a sample; otherwise nothing is said of other members.
    """
    if groups.pairs is None:
        return []
    found = (_sentence(groups, quantity, sampled=sampled) for quantity in quantities)
    sentences = [sentence for sentence in found if sentence]
    return [_compared(groups), *sentences] if sentences else []


def _compared(groups: PairedConditions) -> str:
    """Return a sentence that says what is compared, and in which cases."""
    assert groups.pairs is not None
    cases, count = groups.pairs.shape
    kind = "variants" if all(p.axis.categories for p in groups.parameters) else "conditions"
    where = f"the same {cases} cases" if cases > 1 else "the same case"
    return (
        f"This sweep compares {count} {kind}: {listed(groups.labels)}. Each of them ran in "
        f"{where}, that is, from the same start and with the same numbers otherwise."
    )


def _sentence(groups: PairedConditions, quantity: MemberQuantity, *, sampled: bool) -> str:
    """Return a sentence on the two best conditions; "" if there are no two to compare."""
    values = quantity.values[groups.pairs]
    # A condition without any value cannot be compared.
    columns = [_finite(column) for column in values.T]
    # Neither can one that holds the contact point: its displacement is 0 by construction.
    zero = [k for k, v in enumerate(columns) if len(v) and not v.any()]
    zero = zero if len(columns) - len(zero) > 1 else []
    medians = [
        np.inf if k in zero or not len(v) else float(np.median(v)) for k, v in enumerate(columns)
    ]
    best, second = np.argsort(medians, kind="stable").tolist()[:2]
    found = paired_difference(values[:, best], values[:, second])
    if not np.isfinite(medians[second]) or not found.pairs:
        return ""
    if found.median > 0:
        # The medians may be in the other order than most of the pairs, which are what is compared.
        best, second = second, best
        found = paired_difference(values[:, best], values[:, second])
    unit = quantity.axis.unit
    name = PLAIN_NAMES.get(quantity.name, "The {}").format(quantity.axis.label)
    first, other = groups.labels[best], groups.labels[second]
    few = len(groups.labels) - len(zero) == 2
    always = f"With {listed(groups.labels[k] for k in zero)}, it is always 0. " if zero else ""
    both = f"{first} and {other}" + ("" if few else ", which have the smallest values")
    cases = counted(found.pairs, "case")
    left_out = _left_out(len(values) - found.pairs, len(values))
    if found.median == 0 or (sampled and not found.is_sure):
        text = f"{name}: no sure difference between {both} (median of {cases}{left_out})."
        return f"{text} {always}".strip()
    by = f"{number(-found.median)} {unit}".rstrip()
    if not found.matters:
        text = (
            f"{name}: no difference that matters between {both}. It is {by} in the median of "
            f"{cases}, less than {MATTERS:.0%} of the values{left_out}."
        )
        return f"{text} {always}".strip()
    smaller = round(found.negative * found.pairs)
    often = f"all {cases}" if smaller == found.pairs > 1 else f"{smaller} of {cases}"
    ends = f"{number(-found.high)} and {number(-found.low)} {unit}".rstrip()
    interval = (
        f"; with {CONFIDENCE:.0%} confidence, this median is between {ends}" if sampled else ""
    )
    ranks = "smaller" if few else "smallest"
    begin = f"{name} is always 0 with {listed(groups.labels[k] for k in zero)}. Of the others, it"
    subject = begin if zero else name
    next_one = f"than with {other}" if few else f"and second smallest with {other}"
    return (
        f"{subject} is {ranks} with {first} {next_one}. Of these two, {first} has the "
        f"smaller value in {often}, by {by} in the median{interval}{left_out}."
    )


def _left_out(count: int, total: int) -> str:
    """Return how many cases are left out."""
    return f"; {count} of {total} cases are left out, where a run has no value" if count else ""


def matrix_table(name: str, groups: PairedConditions, quantity: MemberQuantity) -> Table:
    """Return the median difference of a quantity between each two conditions, row minus column."""
    assert groups.pairs is not None
    values, labels = quantity.values[groups.pairs], groups.labels
    rows = []
    for i, label in enumerate(labels):
        cells = [
            Cell(NO_VALUE) if i == j else _cell(paired_difference(values[:, i], values[:, j]))
            for j in range(len(labels))
        ]
        rows.append((Cell(label), *cells))
    heads = (Head("row minus column"), *(Head(label, numbers=True) for label in labels))
    title = f"{quantity.axis.text}: all pairs of conditions"
    note = (
        "Medians of paired differences; a smaller number is better. A mark says that the interval "
        f"of the median excludes zero, and that the median is at least {MATTERS:.0%} of the "
        f"values; without a mark no difference that matters is sure. {INTERVAL_NOTE}"
    )
    return Table(f"{name}-all-pairs-{quantity.name}", title, heads, tuple(rows), note)


def _cell(found: PairedDifference) -> Cell:
    is_marked = found.is_sure and found.matters
    tone = ("good" if found.median < 0 else "bad") if is_marked else ""
    return Cell(number(found.median), found.median if found.pairs else None, tone)


def _finite(values: Array) -> Array:
    return values[np.isfinite(values)]
