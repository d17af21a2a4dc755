"""The certificate of a run, read from its result."""

import math

from rbstab.analysis.certificate.verdict import Check
from rbstab.store.result import Result

POSITIVE = "positive"
"""The name of the check of the sign of v."""


def certificate_lines(result: Result) -> list[Check]:
    """Return the checks of the certificate; [] for a result without one."""
    names = [f"certificate/{column}" for column in Check._fields]
    if any(name not in result for name in names):
        return []
    return [Check(*row) for row in zip(*(result[name].tolist() for name in names), strict=True)]


def compares_v_minus_work(line: Check) -> bool:
    """Return whether a line is the check of the sign of v - ε, which has no lower bound."""
    return line.check == POSITIVE and line.bound == -math.inf
