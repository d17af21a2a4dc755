"""Verdicts on checks and on runs."""

from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple


class Verdict(StrEnum):
    """The verdict on a check, or on a computed run."""

    CERTIFIED = "certified"
    """Proved of the exact motion. The verdict of a run is never this: it speaks of what was
    computed. In runs that were stored before this distinction, it says that convergence is proved.
    """

    CONSISTENT = "consistent"
    """Holds on this run, but is not proved for all motions."""

    DRIVEN = "driven"
    """Elements supply power, so v may rise. That every rise is supplied holds on this run."""

    VIOLATED = "violated"
    """Does not hold on this run."""

    UNKNOWN = "unknown"
    """Not decided: no proof decides it, or the stored numbers are too inaccurate to tell."""


SEVERITY = (Verdict.CONSISTENT, Verdict.DRIVEN, Verdict.UNKNOWN, Verdict.VIOLATED)
"""The verdicts of checks, the worst last."""


class Check(NamedTuple):
    """One line of a certificate.

    `check` is its name, `verdict` a `Verdict`. `value` is compared with `bound`; `quantity` is a
    description of both. `when`, s, is the time at which the value occurs, or NaN if it has no time.
    """

    check: str
    verdict: str
    value: float
    bound: float
    when: float
    quantity: str


def overall(checks: Sequence[Check]) -> str:
    """Return the verdict of a computed run: the worst verdict of its checks.

    What is proved of the exact motion has no part in it: the run may have stopped early, or have
    been computed with a large tolerance.
    """
    return max((check.verdict for check in checks), key=SEVERITY.index, default=SEVERITY[0])


def verdict_of(holds: bool) -> Verdict:
    """Return the verdict on a comparison of stored numbers."""
    return Verdict.CONSISTENT if holds else Verdict.VIOLATED
