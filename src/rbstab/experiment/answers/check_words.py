"""A check of a certificate in words: how sure it is, and what was compared with what."""

import math
import operator

from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.experiment.answers.words import Sureness, word_of
from rbstab.experiment.run_certificate import (
    CERTIFIED_REGION,
    GLOBAL_STABILITY,
    LEAST_REST_STATES,
)
from rbstab.experiment.stored_run import compares_v_minus_work

AT_MOST, AT_LEAST = ("≤", ">", operator.le), ("≥", "<", operator.ge)

RELATIONS = {
    **dict.fromkeys(("audit", "decrease", "derivative", "computed motion"), AT_MOST),
    **dict.fromkeys(("supply", "breakpoints"), AT_MOST),
    **dict.fromkeys(("damping", "positive"), AT_LEAST),
    GLOBAL_STABILITY: ("=", "≠", operator.eq),
    CERTIFIED_REGION: ("<", "≥", operator.lt),
}
"""By check: the relation of value and bound where it holds, where it does not, and its test."""

NO_PROOF = "nothing is proved"
"""What is said of a check that only a proof decides, if there is none, or if it decides nothing."""


NOTHING_STATED = "-"
"""The word of a check that states nothing."""


def word_of_check(line: Check) -> str:
    """Return how sure the statement of a check is.

    A start outside of the certified region is no counterexample: nothing follows from it. Nothing
    is stated of v where elements supply power, as it may rise, and of the sign of v - ε.
    """
    if line.verdict == Verdict.DRIVEN or compares_v_minus_work(line):
        return NOTHING_STATED
    if line.check == CERTIFIED_REGION and line.verdict == Verdict.VIOLATED:
        return str(Sureness.NOT_DECIDED)
    return word_of(line.verdict)


def comparison(line: Check) -> str:
    """Return the value of a check beside its bound, such as "1.4e-14 ≤ 1e-08"."""
    if math.isnan(line.value):
        return NO_PROOF if line.check in {GLOBAL_STABILITY, CERTIFIED_REGION} else "no number"
    value = f"{line.value:.4g}"
    if line.check == GLOBAL_STABILITY and line.verdict == Verdict.UNKNOWN:
        return f"{value} found"
    if compares_v_minus_work(line):
        return f"{value}; v - ε has no lower bound"
    if line.check == CERTIFIED_REGION and line.bound == math.inf:
        return f"{value}; every start converges"
    if not math.isfinite(line.bound) or line.check not in RELATIONS:
        return value
    holds, fails, test = RELATIONS[line.check]
    if line.quantity == LEAST_REST_STATES:
        fails = ">"
    return f"{value} {holds if test(line.value, line.bound) else fails} {line.bound:.4g}"
