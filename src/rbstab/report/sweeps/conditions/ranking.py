"""Which of several conditions is better, and how surely: runs that ended early, paired values."""

from functools import cached_property

import numpy as np

from rbstab.experiment.answers.rounded import number
from rbstab.files.text import grouped
from rbstab.report.model.words import counted, listed
from rbstab.report.sweeps.conditions.paired_conditions import Conditions, conditions_of
from rbstab.report.sweeps.conditions.paired_difference import PairedDifference, paired_difference
from rbstab.report.sweeps.members import LEFT_RANGE, Members, kept
from rbstab.report.sweeps.outcomes import CONFIDENCE
from rbstab.report.sweeps.quantiles import quantiles_of
from rbstab.report.sweeps.quantities import MemberQuantity, main_quantities

SETTLING, PEAK, REGULARITY = "settling-time", "peak-displacement", "regularity"
"""The short names of the quantities that are compared."""

NAMES = {
    SETTLING: "The time to come to rest ({})",
    PEAK: "The largest displacement of the contact point ({})",
}
"""What sentences call a quantity, with its label; smaller values are better."""


class Ranking:
    """The conditions of a sweep, compared in one quantity by members that differ in nothing else.

    Args:
        groups: The conditions; they have pairs.
        quantity: The quantity.
        sampled: Whether the members are a sample; otherwise nothing is said of other members.

    Attributes:
        zero: The conditions that hold the contact point: its displacement is 0 by construction.
            They cannot be compared with the others; with less than two others none is left out.
        order: The conditions that have values to compare, the best median first. The median of a
            condition counts cases that another one may lack: pairs decide, not medians.
    """

    def __init__(self, groups: Conditions, quantity: MemberQuantity, *, sampled: bool) -> None:
        assert groups.pairs is not None
        self.groups, self.quantity, self.sampled = groups, quantity, sampled
        # Columns are read as a whole.
        self._values = np.asfortranarray(quantity.ranked[groups.pairs])
        self._differences: dict[tuple[int, int], PairedDifference] = {}
        self._sign = -1 if quantity.name == REGULARITY else 1
        columns = [column[~np.isnan(column)] for column in self._values.T]
        zero = [k for k, column in enumerate(columns) if len(column) and not column.any()]
        is_held = quantity.name == PEAK and len(columns) - len(zero) > 1
        self.zero = zero if is_held else []
        medians = [self._sign * quantiles_of(column, (0.5,))[0] for column in columns]
        compared = (k for k in range(len(columns)) if len(columns[k]) and k not in self.zero)
        self.order = sorted(compared, key=lambda k: medians[k])

    def difference(self, first: int, second: int) -> PairedDifference:
        """Return the differences of the first condition from the second; computed once."""
        if (first, second) not in self._differences:
            paired = paired_difference(self._values[:, first], self._values[:, second])
            self._differences[first, second] = paired
        return self._differences[first, second]

    @cached_property
    def best(self) -> int | None:
        """The condition that none is better than in common cases; None if there is none."""
        for best in self.order:
            others = [self.difference(best, k) for k in self.order if k != best]
            better = (
                self._sign * difference.median > 0
                for difference in others
                if not self._is_alike(difference)
            )
            if not any(better):
                return best
        return None

    @property
    def sentence(self) -> str:
        """Which condition is better, and how surely; "" if there are no two to compare."""
        if len(self.order) < 2:
            return ""
        labels, label = self.groups.labels, self.quantity.axis.label
        if self.quantity.name == SETTLING and self.groups.v_differs:
            label += ", each of its own v"
        name = NAMES[self.quantity.name].format(label)
        if self.zero:
            always = listed(labels[k] for k in self.zero)
            name += f", always 0 with {always} by construction,"
        best = self.best
        if best is None:
            return f"{name}: none is better than all others."
        compared = {k: self.difference(best, k) for k in self.order if k != best}
        compared = {
            k: difference
            for k, difference in compared.items()
            if difference.pairs or difference.equal
        }
        if not compared:
            return ""
        alike = [labels[k] for k, difference in compared.items() if self._is_alike(difference)]
        if alike:
            sure = "sure difference that matters" if self.sampled else "difference that matters"
            if len(alike) == len(compared):
                return f"{name}: no {sure} between {listed([labels[best], *alike], last=' and ')}."
            return f"{name} is smallest with {labels[best]}; no {sure} from {listed(alike)}."
        second, margin = next(iter(compared.items()))
        smaller = round(margin.negative * margin.pairs)
        often = "all" if smaller == margin.pairs else f"{grouped(smaller)} of the"
        total = len(self.groups.pairs if self.groups.pairs is not None else ())
        cases = counted(margin.pairs, "case")
        cases += f" that differ, of {grouped(total)}" if margin.pairs < total else ""
        interval = ""
        if self.sampled:
            low, high = self._text(-margin.high), self._text(-margin.low)
            interval = f" ({CONFIDENCE:.0%} interval: {low} to {high})"
        return (
            f"{name} is smallest with {labels[best]}: smaller than with {labels[second]} in "
            f"{often} {cases}, by {self._text(-margin.median)} in the median{interval}."
        )

    def _is_alike(self, difference: PairedDifference) -> bool:
        return difference.is_alike(sampled=self.sampled)

    def _text(self, difference: float) -> str:
        """Return a difference with its unit; an infinite one is that from a value after the end."""
        if not np.isfinite(difference):
            return "more than the runs last" if difference > 0 else "less"
        return f"{number(difference)} {self.quantity.axis.unit}".rstrip()


@kept
def rankings_of(members: Members) -> tuple[Ranking, ...]:
    """Return the rankings of conditions, one for each quantity; none without pairs."""
    groups = conditions_of(members)
    if groups.pairs is None:
        return ()
    sampled = members.is_drawn
    return tuple(Ranking(groups, q, sampled=sampled) for q in main_quantities(members))


def ranking_sentences(members: Members) -> list[str]:
    """Return which condition is better, and how surely; what is compared first."""
    groups = conditions_of(members)
    sentences = failure_sentences(members, groups) if groups.parameters else []
    sentences += [
        ranking.sentence for ranking in rankings_of(members) if ranking.quantity.name in NAMES
    ]
    sentences = [sentence for sentence in sentences if sentence]
    if not sentences or groups.pairs is None:
        return sentences
    cases, count = groups.pairs.shape
    kind = "variants" if all(p.axis.categories for p in groups.parameters) else "conditions"
    same = f"the same {counted(cases, 'case')}"
    return [f"Compared: {count} {kind}, each in {same}: {listed(groups.labels)}.", *sentences]


def failure_sentences(members: Members, groups: Conditions) -> list[str]:
    """Return how many runs of each condition did not complete; [] if all completed.

    The best and the worst condition are compared in the same cases. How often only one of both
    failed is binomial with p = 1/2 if the condition makes no difference (McNemar's test).
    """
    failed = members.outcomes >= LEFT_RANGE
    if not failed.any():
        return []
    of_each = [failed[part.chosen] for part in groups.slices]
    counts = [int(np.count_nonzero(mask)) for mask in of_each]
    parts = [
        f"{label}: {grouped(count)} of {grouped(len(mask))}"
        for label, count, mask in zip(groups.labels, counts, of_each, strict=True)
    ]
    sentence = f"Runs that ended early: {'; '.join(parts)}."
    best, worst = int(np.argmin(counts)), int(np.argmax(counts))
    if groups.pairs is None or counts[best] == counts[worst]:
        return [sentence]
    best_failed, worst_failed = failed[groups.pairs[:, best]], failed[groups.pairs[:, worst]]
    only_best, only_worst = (
        int(np.count_nonzero(k)) for k in (best_failed & ~worst_failed, worst_failed & ~best_failed)
    )
    text = (
        f"In {grouped(only_worst)} of the same {counted(len(best_failed), 'case')} only "
        f"{groups.labels[worst]} ended early, in {grouped(only_best)} only {groups.labels[best]}"
    )
    if not members.is_drawn:
        return [sentence, f"{text}."]
    # Imported late: SciPy's statistics take longer to load than the rest of a report.
    from scipy.stats import binomtest

    # Both are the extremes of many: a difference that chance makes is found more often among these.
    pairs = len(counts) * (len(counts) - 1) // 2
    chance = pairs * binomtest(only_best, only_best + only_worst, 0.5).pvalue
    sure = "more than chance makes" if chance < 1.0 - CONFIDENCE else "this may be chance"
    chosen = f", these two chosen from {pairs} pairs" if pairs > 1 else ""
    return [sentence, f"{text}: {sure} (sign test, {CONFIDENCE:.0%} confidence{chosen})."]
