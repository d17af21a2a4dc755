"""Tables with a row for each run: its numbers, and what is wrong with it."""

from collections.abc import Sequence

from rbstab.analysis.lyapunov import ENERGY_SCALE, ENERGY_SCALE_NOTE
from rbstab.experiment.answers.facts import FACTS
from rbstab.report.model.document import Cell, Entry, Head, Section, Table
from rbstab.report.model.words import listed
from rbstab.report.reading.sources import Run

COLUMNS = (
    *("outcome", "tilt", "this start", "whole range", "v(0)/c*", "at rest from"),
    *("peak |E|", "peak E1", "peak E2", "peak E3", "peak |θ2|", "v(0)", "v(end)"),
    *(f"|r|/{ENERGY_SCALE}", "status", "rest states", "in certified region", "variant", "checks"),
)
"""The facts of the table, the deciding ones first: a page shows as many columns as fit."""

IN_CERTIFICATES = ("this start", "whole range", "checks")
"""Facts that the section of certificates gives in full."""

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
    heads: list[Head | str] = ["run", *(Head(fact.name, fact.unit) for fact in facts)]
    rows: list[list[Entry]] = [[run.label, *(_cell(name, run) for name in COLUMNS)] for run in runs]
    return Table.of("runs", "Numbers of each run", heads, rows, NOTE)


def _cell(name: str, run: Run) -> Cell:
    target = "certificates" if name in IN_CERTIFICATES else ""
    return Cell(*FACTS[name].of(run), target=target)


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
    rows = [(warning, listed(run_labels)) for warning, run_labels in labels.items()]
    table = Table.of("warnings", "Warnings by run", ("warning", "runs"), rows)
    return Section("warnings", "Warnings", (table,))
