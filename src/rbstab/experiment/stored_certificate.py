"""The certificate of a run, read from its result."""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from rbstab.analysis.lyapunov import Scale, named_scale
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

    What is compared has its true name: v - ε where the result stores that in place of v, and the
    energy by which the number was divided.
    """
    lines = stored_lines(result)
    words = _true_names(result, lines)
    return [line._replace(quantity=_renamed(line.quantity, words)) for line in lines]


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


def _true_names(result: Result, lines: Iterable[CertificateLine]) -> dict[str, str]:
    """Return what the certificate of a result calls otherwise, by its names in files.

    In files every scale is called v(0), and also v - ε is called v.
    """
    known = all(name in result for name in ("lyapunov", "energy"))
    words = {}
    if known and len(result["lyapunov"]):
        scale = scale_of(result)
        words["/ v(0)"] = f"/ {scale.name}"
    if any(map(compares_v_minus_work, lines)):
        words |= {"min v /": "min (v - ε) /", "rise of v ": "rise of v - ε "}
    return words


def _renamed(quantity: str, words: Mapping[str, str]) -> str:
    for name, true_name in words.items():
        quantity = quantity.replace(name, true_name)
    return quantity


def scale_of(result: Result) -> Scale:
    """Return the energy by which errors of v of a result are divided, with its name."""
    driven = "supplied_energy" in result
    supplied = result["supplied_energy"] if driven else None
    return named_scale(result["lyapunov"], result["energy"], supplied)
