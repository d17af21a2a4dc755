"""The certificate of a run, read from its result."""

import math
from typing import NamedTuple

from rbstab.store.result import Result

POSITIVE = "positive"
"""The name of the check of the sign of v."""


class CertificateLine(NamedTuple):
    """One check of a certificate: its name, its verdict, and a value with its bound.

    quantity describes value and bound. when is the time of the value, s; NaN if it has none.
    """

    check: str
    verdict: str
    value: float
    bound: float
    when: float
    quantity: str


def certificate_lines(result: Result) -> list[CertificateLine]:
    """Return the checks of the certificate; [] for an older result without a certificate.

    What is compared has its true name: in files, v - ε is called v.
    """
    lines = stored_lines(result)
    if not any(map(compares_v_minus_work, lines)):
        return lines
    return [line._replace(quantity=_of_v_minus_work(line.quantity)) for line in lines]


def stored_lines(result: Result) -> list[CertificateLine]:
    """Return the checks as they are in the file, to be stored again."""
    names = [f"certificate/{column}" for column in CertificateLine._fields]
    if any(name not in result for name in names):
        return []
    rows = zip(*(result[name].tolist() for name in names), strict=True)
    return [CertificateLine(*row) for row in rows]


def compares_v_minus_work(line: CertificateLine) -> bool:
    """Return whether a line is the check of the sign of v - ε, which has no lower bound."""
    return line.check == POSITIVE and line.bound == -math.inf


def _of_v_minus_work(quantity: str) -> str:
    return quantity.replace("min v /", "min (v - ε) /").replace("rise of v ", "rise of v - ε ")
