"""Which of several conditions has the fewest runs that did not complete, and how surely."""

import numpy as np

from rbstab.files.counts import grouped
from rbstab.mechanics.numbers import Array
from rbstab.report.model.words import counted
from rbstab.report.sweeps.conditions.paired_conditions import PairedConditions
from rbstab.report.sweeps.fractions import CONFIDENCE
from rbstab.report.sweeps.members import LEFT_RANGE, OUTCOMES, Members


def failure_sentences(members: Members, groups: PairedConditions, *, sampled: bool) -> list[str]:
    """Return how many runs of each condition did not complete; [] if all completed.

    The best and the worst condition are compared in the same cases. How often only one of both
    failed is binomial with p = 1/2 if the condition makes no difference (McNemar's test).

    Args:
        members: The members.
        groups: The conditions.
        sampled: Whether the members are a sample; otherwise nothing is said of other members.
    """
    failed = members.outcomes >= LEFT_RANGE
    if not failed.any():
        return []
    which = np.unique(members.outcomes[failed]).tolist()
    name = f"Runs that ended early ({', '.join(OUTCOMES[code] for code in which)})"
    of_each = [failed[groups.codes == k] for k in range(len(groups.labels))]
    counts = [int(np.count_nonzero(own)) for own in of_each]
    parts = [
        f"{label}: {grouped(count)} of {grouped(len(own))}"
        for label, count, own in zip(groups.labels, counts, of_each, strict=True)
    ]
    sentences = [f"{name}: {'; '.join(parts)}."]
    if groups.pairs is not None and min(counts) < max(counts):
        best, worst = int(np.argmin(counts)), int(np.argmax(counts))
        names = groups.labels[best], groups.labels[worst]
        found = failed[groups.pairs]
        pairs = len(counts) * (len(counts) - 1) // 2
        both = found[:, best], found[:, worst]
        sentences.append(_in_the_same_cases(names, *both, pairs if sampled else None))
    return sentences


def _in_the_same_cases(names: tuple[str, str], best: Array, worst: Array, pairs: int | None) -> str:
    """Return how often only one of two conditions failed in the same case.

    Args:
        names: The labels of both.
        best: Whether the run of the first failed, shape (cases,).
        worst: The same of the second.
        pairs: From how many pairs of conditions these two were chosen as the extremes; None if the
            members are no sample. A difference that chance makes is found more often among many.
    """
    only_worst = int(np.count_nonzero(worst & ~best))
    only_best = int(np.count_nonzero(best & ~worst))
    text = (
        f"In {grouped(only_worst)} of the same {counted(len(best), 'case')} only {names[1]} ended "
        f"early, in {grouped(only_best)} only {names[0]}"
    )
    if pairs is None:
        return f"{text}."
    # Imported late: SciPy's statistics take longer to load than the rest of a report.
    from scipy.stats import binomtest

    chance = pairs * binomtest(only_best, only_best + only_worst, 0.5).pvalue
    sure = "more than chance makes" if chance < 1.0 - CONFIDENCE else "this may be chance"
    chosen = f", these two chosen from {pairs} pairs" if pairs > 1 else ""
    return f"{text}: {sure} (sign test, {CONFIDENCE:.0%} confidence{chosen})."
