"""Which of several conditions is better in a quantity, and how surely: paired differences."""

import math
from collections.abc import Mapping, Sequence
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
from rbstab.report.sweeps.distributions import quantiles_of
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
    values = quantity.ranked[groups.pairs]
    # A condition without any value cannot be compared.
    columns = [column[~np.isnan(column)] for column in values.T]
    # Neither can one that holds the contact point: its displacement is 0 by construction.
    held = quantity.name == PEAK
    zero = [k for k, v in enumerate(columns) if held and len(v) and not v.any()]
    zero = zero if len(columns) - len(zero) > 1 else []
    others = [k for k, v in enumerate(columns) if len(v) and k not in zero]
    if len(others) < 2:
        return ""
    name, begin = _name(groups, quantity), ""
    if zero:
        always = listed(groups.labels[k] for k in zero)
        begin = f"{name} is always 0 with {always}, by construction. Of the others: "
        name = OTHERS
    # The median of a condition counts cases that another one may lack: pairs decide, not medians.
    order = sorted(others, key=lambda k: quantiles_of(columns[k], (0.5,))[0])
    best = _best(values, order, sampled=sampled)
    if best is None:
        subject = "" if name == OTHERS else f"{name}: "
        return f"{begin}{subject}none is better than all others; the table compares all pairs."
    compared = _compared(values, best, order)
    if not compared:
        return ""
    apart = [groups.labels[k] for k in order if k != best and k not in compared]
    alike = [k for k, one in compared.items() if _is_alike(one, sampled=sampled)]
    sentence = _Sentence(groups, quantity, name, best, sampled)
    without = (
        f" Without a common case with {groups.labels[best]}: {listed(apart)}." if apart else ""
    )
    if alike:
        return f"{begin}{sentence.on_alike(alike, compared)}{without}"
    (second, found), *more = compared.items()
    return f"{begin}{sentence.on_two(second, found, few=not more)}{without}"


def _compared(values: Array, best: int, order: Sequence[int]) -> dict[int, PairedDifference]:
    """Return the differences of one condition from the others with which it shares cases."""
    found = {k: paired_difference(values[:, best], values[:, k]) for k in order if k != best}
    return {k: one for k, one in found.items() if one.pairs or one.equal}


def _best(values: Array, order: Sequence[int], *, sampled: bool) -> int | None:
    """Return the condition that none is better than in common cases; None if there is none."""
    for best in order:
        compared = _compared(values, best, order)
        alike = {k for k, one in compared.items() if _is_alike(one, sampled=sampled)}
        if not any(one.median > 0 for k, one in compared.items() if k not in alike):
            return best
    return None


def _is_alike(found: PairedDifference, *, sampled: bool) -> bool:
    """Return whether two conditions have no difference that is sure and matters in most cases."""
    is_sure = found.is_sure or not sampled
    return found.equal > found.pairs or not (is_sure and found.matters)


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
        cases = counted(found.pairs, "case")
        smaller = round(found.negative * found.pairs)
        often = f"all {cases}" if smaller == found.pairs > 1 else f"{smaller} of {cases}"
        interval = ""
        if self.sampled:
            low, high = self._text(-found.high), self._text(-found.low)
            interval = (
                f"; with {CONFIDENCE:.0%} confidence, this median is between {low} and {high}"
            )
        ranks = f"smaller with {first} than with {other}. Of these two, {first}"
        if not few:
            ranks = f"smallest with {first}. Next is {other}: of these two, {first}"
        return (
            f"{self.name} is {ranks} has the smaller value in {often}, by "
            f"{self._text(-found.median)} in the median{interval}"
            f"{self._equal(found)}{self._left_out(found)}."
        )

    def on_alike(self, alike: list[int], compared: Mapping[int, PairedDifference]) -> str:
        """Return the sentence if other conditions have no difference from the best that matters."""
        labels = self.groups.labels
        names = listed(labels[k] for k in (self.best, *alike))
        others = [k for k in compared if k not in alike]
        smallest = ", which have the smallest values" if others else ""
        name = "" if self.name == OTHERS else f"{self.name}: "
        begin = f"{name}no difference that matters between {names}{smallest}"
        if len(alike) > 1:
            return f"{begin}."
        found = compared[alike[0]]
        left_out = self._left_out(found)
        if found.equal > found.pairs:
            common = counted(found.equal + found.pairs, "case")
            all_of = "all" if not found.pairs else f"{found.equal} of"
            return f"{begin}: it is the same in {all_of} {common}{left_out}."
        tail = f"{self._equal(found)}{left_out}."
        cases = counted(found.pairs, "case")
        if self.sampled and not found.is_sure:
            begin = begin.replace("no difference that matters", "no sure difference")
            return f"{begin} (median of {cases}{tail[:-1]})."
        return (
            f"{begin}. The difference is {self._text(abs(found.median))} in the median of {cases}, "
            f"less than {MATTERS:.0%} of the values{tail}"
        )

    def _text(self, difference: float) -> str:
        """Return a difference with its unit; an infinite one is that from a value after the end."""
        if not math.isfinite(difference):
            return "more than the runs last" if difference > 0 else "less"
        return f"{number(difference)} {self.quantity.axis.unit}".rstrip()

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
            why = "neither run was at rest by its end, or one ended early"
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
    values, labels = quantity.ranked[groups.pairs], groups.labels
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
        f"zero, that the median is at least {MATTERS:.0%} of the values, and that no more pairs "
        "are equal than differ; without a mark no difference that matters is sure. Each pair is "
        f"judged by itself. {INTERVAL_NOTE}"
    )
    return Table(f"{name}-all-pairs-{quantity.name}", title, heads, tuple(rows), note)


def _cell(found: PairedDifference, *, sampled: bool = True) -> Cell:
    is_marked = not _is_alike(found, sampled=True)
    tone = ("good" if found.median < 0 else "bad") if is_marked else ""
    text = _number(found.median) if found.pairs else "equal" if found.equal else NO_VALUE
    if sampled and found.is_sure:
        text = f"{text} ({_number(found.low)} to {_number(found.high)})"
    if found.pairs and found.equal:
        text = f"{text}; {found.equal} equal"
    value = found.median if math.isfinite(found.median) else None
    return Cell(text, value, tone)


def _number(difference: float) -> str:
    """Return a difference as text; an infinite one is that from a value after the end of a run."""
    if math.isinf(difference):
        return "later" if difference > 0 else "earlier"
    return number(difference)
