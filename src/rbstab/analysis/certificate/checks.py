"""All checks of a run."""

from rbstab.analysis.certificate.damping_check import damping
from rbstab.analysis.certificate.evidence import Evidence
from rbstab.analysis.certificate.rate_check import rate
from rbstab.analysis.certificate.value_checks import (
    audit,
    breakpoints,
    decrease,
    positive,
    rise,
    supplied,
)
from rbstab.analysis.certificate.verdict import Check


def checks_of(run: Evidence) -> list[Check]:
    """Return the checks that need only the run, not a proof."""
    if run.supplied is None:
        falls = [decrease(run)]
    else:
        falls = [rise(run), supplied(run, run.supplied), *breakpoints(run)]
    return [audit(run), *falls, damping(run), positive(run), rate(run)]
