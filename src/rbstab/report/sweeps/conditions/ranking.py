"""Which of several conditions is better in a quantity, and how surely: paired differences."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.words import counted, listed, number
from rbstab.report.sweeps.conditions.paired_conditions import PairedConditions
from rbstab.report.sweeps.conditions.paired_difference import (
    MATTERS,
    PairedDifference,
    PairedValues,
    paired_values,
)
from rbstab.report.sweeps.distributions import quantiles_of
from rbstab.report.sweeps.fractions import CONFIDENCE
from rbstab.report.sweeps.quantities import MemberQuantity

SETTLING, PEAK = "settling-time", "peak-displacement"
"""The short names of quantities of which more is said."""

LARGER_IS_BETTER = ("regularity",)
"""The short names of quantities that are better if they are larger; all others if smaller."""

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
    values, order = paired_values(groups, quantity), comparable(groups, quantity)
    if len(order) < 2:
        return ""
    name, begin = _name(groups, quantity), ""
    zero = always_zero(groups, quantity)
    if zero:
        always = listed(groups.labels[k] for k in zero)
        begin = f"{name} is always 0 with {always}, by construction. Of the others: "
        name = OTHERS
    best = _best(values, order, sampled=sampled)
    if best is None:
        subject = "" if name == OTHERS else f"{name}: "
        return f"{begin}{subject}none is better than all others; the table compares all pairs."
    compared = _compared(values, best, order)
    if not compared:
        return ""
    apart = [groups.labels[k] for k in order if k != best and k not in compared]
    alike = [k for k, one in compared.items() if is_alike(one, sampled=sampled)]
    sentence = _Sentence(groups, quantity, name, best, sampled)
    without = (
        f" Without a common case with {groups.labels[best]}: {listed(apart)}." if apart else ""
    )
    if alike:
        return f"{begin}{sentence.on_alike(alike, compared)}{without}"
    (second, found), *more = compared.items()
    return f"{begin}{sentence.on_two(second, found, few=not more)}{without}"


def always_zero(groups: PairedConditions, quantity: MemberQuantity) -> list[int]:
    """Return the conditions that hold the contact point: its displacement is 0 by construction.

    They cannot be compared with the others. If there are less than two others, none is left out.
    """
    if quantity.name != PEAK:
        return []
    columns = _known(groups, quantity)
    zero = [k for k, column in enumerate(columns) if len(column) and not column.any()]
    return zero if len(columns) - len(zero) > 1 else []


def comparable(groups: PairedConditions, quantity: MemberQuantity) -> list[int]:
    """Return the conditions that have values to compare, that with the smallest median first.

    The median of a condition counts cases that another one may lack: pairs decide, not medians.
    """
    columns, zero = _known(groups, quantity), always_zero(groups, quantity)
    others = [k for k, column in enumerate(columns) if len(column) and k not in zero]
    return sorted(others, key=lambda k: quantiles_of(columns[k], (0.5,))[0])


def best_of(groups: PairedConditions, quantity: MemberQuantity, *, sampled: bool) -> int | None:
    """Return the condition than which none is better in common cases; None if there is none."""
    values, order = paired_values(groups, quantity), comparable(groups, quantity)
    if quantity.name in LARGER_IS_BETTER:
        values, order = PairedValues(-values.values), order[::-1]
    return _best(values, order, sampled=sampled)


def _known(groups: PairedConditions, quantity: MemberQuantity) -> list[Array]:
    """Return the values of each condition that are known, or known to be later than the end."""
    columns = paired_values(groups, quantity).values.T
    return [column[~np.isnan(column)] for column in columns]


def _compared(values: PairedValues, best: int, order: Sequence[int]) -> dict[int, PairedDifference]:
    """Return the differences of one condition from the others with which it shares cases."""
    found = {k: values.difference(best, k) for k in order if k != best}
    return {k: one for k, one in found.items() if one.pairs or one.equal}


def _best(values: PairedValues, order: Sequence[int], *, sampled: bool) -> int | None:
    """Return the condition that none is better than in common cases; None if there is none."""
    for best in order:
        compared = _compared(values, best, order)
        alike = {k for k, one in compared.items() if is_alike(one, sampled=sampled)}
        if not any(one.median > 0 for k, one in compared.items() if k not in alike):
            return best
    return None


def is_alike(found: PairedDifference, *, sampled: bool) -> bool:
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
        if len(alike) == 1:
            names = f"{labels[self.best]} and {labels[alike[0]]}"
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
