"""Checks that failed in double precision, repeated in exact arithmetic."""

from collections.abc import Callable
from typing import NamedTuple

from rbstab.analysis.certificate.verdict import SEVERITY, Verdict
from rbstab.mechanics.numbers import Array

MAX_REPEATED = 12
"""Number of samples that a check repeats in exact arithmetic; each takes some milliseconds."""


class Finding(NamedTuple):
    """The verdict on one sample, and the number that it rests on."""

    verdict: Verdict
    value: float
    row: int


def confirmed(violated: bool) -> Verdict:
    """Return the verdict on a comparison that failed in double precision."""
    return Verdict.VIOLATED if violated else Verdict.UNKNOWN


def repeated(repeat: Callable[[int], Finding], rows: Array) -> Finding:
    """Repeat a check in exact arithmetic at samples where it failed, and return the worst finding.

    Args:
        repeat: Repeats the check at one sample.
        rows: The samples, worst first; the check is repeated at the first `MAX_REPEATED`.
    """
    findings = []
    for row in rows[:MAX_REPEATED].tolist():
        findings.append(repeat(row))
        if findings[-1].verdict is Verdict.VIOLATED:
            break
    return max(findings, key=lambda found: (SEVERITY.index(found.verdict), abs(found.value)))
