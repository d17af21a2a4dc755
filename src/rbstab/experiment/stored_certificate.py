"""The certificate of a run, read from its result."""

import math

from rbstab.analysis.certificate.verdict import Check
from rbstab.store.result import Result

POSITIVE = "positive"
"""The name of the check of the sign of v."""


def certificate_lines(result: Result) -> list[Check]:
    """Return the checks of the certificate; [] for an older result without a certificate.

    What is compared has its true name: in files, v - ε is called v.
    """
    lines = stored_lines(result)
    if not any(map(compares_v_minus_work, lines)):
        return lines
    return [line._replace(quantity=_of_v_minus_work(line.quantity)) for line in lines]


def stored_lines(result: Result) -> list[Check]:
    """Return the checks as they are in the file, to be stored again."""
    names = [f"certificate/{column}" for column in Check._fields]
    if any(name not in result for name in names):
        return []
    rows = zip(*(result[name].tolist() for name in names), strict=True)
    return [Check(*row) for row in rows]


def compares_v_minus_work(line: Check) -> bool:
    """Return whether a line is the check of the sign of v - ε, which has no lower bound."""
    return line.check == POSITIVE and line.bound == -math.inf


def _of_v_minus_work(quantity: str) -> str:
    return quantity.replace("min v /", "min (v - ε) /").replace("rise of v ", "rise of v - ε ")
