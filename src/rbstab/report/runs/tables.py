"""Tables with a row for each run: its numbers, and what is wrong with it."""

from collections.abc import Sequence

from rbstab.analysis.lyapunov import ENERGY_SCALE, ENERGY_SCALE_NOTE
from rbstab.report.model.document import Section, Table
from rbstab.report.model.words import listed
from rbstab.report.reading.sources import Run
from rbstab.report.runs.facts import FACTS

COLUMNS = (
    *("run", "outcome", "tilt", "this start", "whole range", "v(0)/c*", "at rest from"),
    *("peak |E|", "peak E1", "peak E2", "peak E3", "peak |θ2|", "v(0)", "v(end)"),
    *(f"|r|/{ENERGY_SCALE}", "status", "rest states", "in certified region", "variant", "checks"),
)
"""The facts of the table, the deciding ones first: a page shows as many columns as fit."""

NOTE = (
    "This start and whole range: how sure it is that the motion from this start, and every motion "
    "that stays in the range of the Euler angles, comes to rest. r = v(t) - v(0) - ∫v' dt is the "
    f"energy residual. {ENERGY_SCALE_NOTE} Rest states are those in the range; they and the "
    "certified region need a proof beside the result. Checks: what the checks of the computed run "
    "found together."
)


def summary_table(runs: Sequence[Run]) -> Table:
    """Return the table with one row for each run."""
    facts = [FACTS[name] for name in COLUMNS]
    rows = [[fact.get(run) for fact in facts] for run in runs]
    return Table.of("runs", "Numbers of each run", [fact.head for fact in facts], rows, NOTE)


def warnings_section(runs: Sequence[Run]) -> Section | None:
    """Return the section with the warnings of all runs; None without warnings.

    Runs with the same warning share a row.
    """
    labels: dict[str, list[str]] = {}
    for run in runs:
        for warning in (run.attribute("status_detail"), *run.attribute("warnings").splitlines()):
            if warning:
                labels.setdefault(warning, []).append(run.label)
    if not labels:
        return None
    rows = [(warning, listed(own)) for warning, own in labels.items()]
    table = Table.of("warnings", "Warnings by run", ("warning", "runs"), rows)
    return Section("warnings", "Warnings", (table,))
