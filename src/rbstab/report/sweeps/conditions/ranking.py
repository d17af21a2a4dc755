"""Which of several conditions is better in a quantity, and how surely: paired differences."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.model.words import NO_VALUE, counted, listed, number
from rbstab.report.sweeps.conditions.paired_conditions import PairedConditions
from rbstab.report.sweeps.conditions.paired_difference import (
    MATTERS,
    PairedDifference,
    paired_difference,
)
from rbstab.report.sweeps.fractions import CONFIDENCE
from rbstab.report.sweeps.quantities import MemberQuantity

INTERVAL_NOTE = (
    f"The interval of a median is that of order statistics, with {CONFIDENCE:.0%} confidence: it "
    "assumes nothing but independent pairs."
)


SETTLING, PEAK = "settling-time", "peak-displacement"
"""The short names of quantities of which more is said."""

OTHERS = "it"
"""The name of a quantity after a sentence that names it."""

AT_THE_START = ", as where the largest value is that at the start"

PLAIN_NAMES = {
    SETTLING: "The time to come to rest ({})",
    PEAK: "The largest displacement of the contact point ({})",
}
"""Names of quantities that need no explanation, by their short names; their labels follow."""


def ranking_sentences(
    groups: PairedConditions, quantities: list[MemberQuantity], *, sampled: bool
) -> list[str]:
    """Return a sentence on each quantity: the best condition, and how surely.

    Args:
        groups: The conditions.
        quantities: The quantities, each of which is better if it is smaller.
        sampled: Whether the members are a sample; otherwise nothing is said of other members.
    """
    if groups.pairs is None:
        return []
    found = (_sentence(groups, quantity, sampled=sampled) for quantity in quantities)
    return [sentence for sentence in found if sentence]


def compared_sentence(groups: PairedConditions) -> str:
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
    """Return a sentence on the best conditions; "" if there are no two to compare."""
    assert groups.pairs is not None
    values = quantity.values[groups.pairs]
    # A condition without any value cannot be compared.
    columns = [_finite(column) for column in values.T]
    # Neither can one that holds the contact point: its displacement is 0 by construction.
    zero = [k for k, v in enumerate(columns) if len(v) and not v.any()]
    zero = zero if len(columns) - len(zero) > 1 else []
    others = [k for k, v in enumerate(columns) if len(v) and k not in zero]
    if len(others) < 2:
        return ""
    # Where two conditions share no case, nothing can be said.
    order = sorted(others, key=lambda k: float(np.median(columns[k])))
    best, second, *_ = order
    found = paired_difference(values[:, best], values[:, second])
    if not found.pairs and not found.equal:
        return ""
    if found.median > 0:
        # The medians may be in the other order than most of the pairs, which are what is compared.
        best, second = second, best
        found = paired_difference(values[:, best], values[:, second])
    name = _name(groups, quantity)
    begin = ""
    if zero:
        always = listed(groups.labels[k] for k in zero)
        begin = f"{name} is always 0 with {always}, by construction. Of the others: "
        name = OTHERS
    compared = {k: paired_difference(values[:, best], values[:, k]) for k in others if k != best}
    alike = [k for k, one in compared.items() if _is_alike(one, sampled=sampled)]
    sentence = _Sentence(groups, quantity, name, best, sampled)
    if alike:
        return f"{begin}{sentence.on_alike(alike, compared)}"
    return f"{begin}{sentence.on_two(second, found, few=len(others) == 2)}"


def _is_alike(found: PairedDifference, *, sampled: bool) -> bool:
    """Return whether two conditions have no difference that is sure and matters."""
    return not found.pairs or (sampled and not found.is_sure) or not found.matters


def _name(groups: PairedConditions, quantity: MemberQuantity) -> str:
    label = quantity.axis.label
    if quantity.name == SETTLING and groups.has_own_v:
        label = f"{label}; v is not the same function in each condition"
    return PLAIN_NAMES.get(quantity.name, "The {}").format(label)


class _Sentence(NamedTuple):
    """What is needed to write a sentence on the condition with the smallest values."""

    groups: PairedConditions
    quantity: MemberQuantity
    name: str
    best: int
    sampled: bool

    def on_two(self, second: int, found: PairedDifference, *, few: bool) -> str:
        """Return the sentence if the best condition is better than all others."""
        first, other = self.groups.labels[self.best], self.groups.labels[second]
        unit = self.quantity.axis.unit
        by = f"{number(-found.median)} {unit}".rstrip()
        cases = counted(found.pairs, "case")
        smaller = round(found.negative * found.pairs)
        often = f"all {cases}" if smaller == found.pairs > 1 else f"{smaller} of {cases}"
        ends = f"{number(-found.high)} and {number(-found.low)} {unit}".rstrip()
        interval = (
            f"; with {CONFIDENCE:.0%} confidence, this median is between {ends}"
            if self.sampled
            else ""
        )
        ranks = "smaller" if few else "smallest"
        next_one = f"than with {other}" if few else f"and second smallest with {other}"
        return (
            f"{self.name} is {ranks} with {first} {next_one}. Of these two, {first} has the "
            f"smaller value in {often}, by {by} in the median{interval}"
            f"{self._equal(found)}{self._left_out(found)}."
        )

    def on_alike(self, alike: list[int], compared: Mapping[int, PairedDifference]) -> str:
        """Return the sentence if other conditions have no difference from the best that matters."""
        labels = self.groups.labels
        names = listed(labels[k] for k in (self.best, *alike))
        others = [k for k in compared if k not in alike]
        smallest = ", which have the smallest values" if others else ""
        begin = f"{self.name}: no difference that matters between {names}{smallest}"
        if len(alike) > 1:
            return f"{begin}."
        found = compared[alike[0]]
        if not found.pairs:
            return f"{begin}: it is the same in all {counted(found.equal, 'case')}."
        tail = f"{self._equal(found)}{self._left_out(found)}."
        cases = counted(found.pairs, "case")
        if self.sampled and not found.is_sure:
            begin = begin.replace("no difference that matters", "no sure difference")
            return f"{begin} (median of {cases}{tail[:-1]})."
        by = f"{number(abs(found.median))} {self.quantity.axis.unit}".rstrip()
        return (
            f"{begin}. The difference is {by} in the median of {cases}, less than {MATTERS:.0%} "
            f"of the values{tail}"
        )

    def _equal(self, found: PairedDifference) -> str:
        if not found.equal:
            return ""
        why = AT_THE_START if self.quantity.name == PEAK else ""
        return f"; in {counted(found.equal, 'further case')} both are equal{why}"

    def _left_out(self, found: PairedDifference) -> str:
        """Return how many cases are left out, and why."""
        assert self.groups.pairs is not None
        total = len(self.groups.pairs)
        count = total - found.pairs - found.equal
        why = "a run ended early"
        if self.quantity.name == SETTLING:
            why = "a run was not at rest by its end, or ended early"
        return f"; {count} of {total} cases are left out, where {why}" if count else ""


def matrix_table(
    name: str, groups: PairedConditions, quantity: MemberQuantity, *, sampled: bool
) -> Table:
    """Return the median difference of a quantity between each two conditions, row minus column.

    Args:
        name: The anchor of the sweep.
        groups: The conditions.
        quantity: The quantity.
        sampled: Whether the members are a sample; otherwise the medians have no intervals.
    """
    assert groups.pairs is not None
    values, labels = quantity.values[groups.pairs], groups.labels
    rows = []
    for i, label in enumerate(labels):
        cells = [
            Cell(NO_VALUE)
            if i == j
            else _cell(paired_difference(values[:, i], values[:, j]), sampled=sampled)
            for j in range(len(labels))
        ]
        rows.append((Cell(label), *cells))
    heads = (Head("row minus column"), *(Head(label, numbers=True) for label in labels))
    title = f"{quantity.axis.text}: all pairs of conditions"
    between = f", with their intervals of {CONFIDENCE:.0%} confidence" if sampled else ""
    note = (
        f"Medians of paired differences{between}; a smaller number is better. Pairs with equal "
        "values are left out, and counted. A mark says that the interval of the median excludes "
        f"zero, and that the median is at least {MATTERS:.0%} of the values; without a mark no "
        f"difference that matters is sure. {INTERVAL_NOTE}"
    )
    return Table(f"{name}-all-pairs-{quantity.name}", title, heads, tuple(rows), note)


def _cell(found: PairedDifference, *, sampled: bool = True) -> Cell:
    is_marked = found.is_sure and found.matters
    tone = ("good" if found.median < 0 else "bad") if is_marked else ""
    text = number(found.median) if found.pairs else "equal" if found.equal else NO_VALUE
    if sampled and found.pairs and np.isfinite(found.low):
        text = f"{text} ({number(found.low)} to {number(found.high)})"
    if found.pairs and found.equal:
        text = f"{text}; {found.equal} equal"
    return Cell(text, found.median if found.pairs else None, tone)


def _finite(values: Array) -> Array:
    return values[np.isfinite(values)]
