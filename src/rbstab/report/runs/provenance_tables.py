"""Report sections on warnings, provenance and the commands that repeat runs."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rbstab.files.shell_words import one_after_the_other, shell_word
from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import NO_VALUE, listed, number, untrusted
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.tables import number_cell

PER_RUN_ATTRIBUTES = ("steps", "evaluations", "wall_time")
"""Attributes that always have a column in the table of runs."""

SHOWN_ELSEWHERE = ("title", "variant", "status", "status_detail", "verdict", "warnings", "run_id")
"""Attributes that other tables of the report show."""

TITLES = {
    "convergence": "exact motion converges",
    "convergence_rest_state": "it converges to rest state",
    "convergence_time": "it is in a certified region from [s]",
    "convergence_energy_low": "v there, at least [J]",
    "convergence_energy_high": "v there, at most [J]",
    "convergence_bound": "level of that region [J]",
    "convergence_wall_time": "time of the enclosure [s]",
}
"""Words for attributes whose names do not say what they are."""

UNBOUNDED = "no bound"
"""The level of a region without one: every start converges."""


def warnings_section(facts: Sequence[RunFacts]) -> Section | None:
    """Return the section with the warnings of all runs; None without warnings.

    Runs with the same warning share a row.
    """
    runs: dict[str, list[str]] = {}
    for entry in facts:
        detail = entry.attribute("status_detail")
        for warning in [*([detail] if detail else []), *entry.attribute("warnings").splitlines()]:
            runs.setdefault(warning, []).append(entry.run.label)
    if not runs:
        return None
    rows = tuple((Cell(text), Cell(listed(labels))) for text, labels in runs.items())
    table = Table("warnings", "Warnings by run", (Head("warning"), Head("runs")), rows)
    return Section("warnings", "Warnings", (table,))


def provenance_section(facts: Sequence[RunFacts]) -> Section:
    """Return the section with versions, identities, tolerances, and commands that repeat runs."""
    blocks = [*_shared(facts), _by_run(facts), _commands(facts)]
    return Section("provenance", "Provenance", tuple(blocks), folded=True)


def _origin(facts: RunFacts) -> dict[str, str]:
    """Return the origin of a run, as texts by name: its attributes and integrator settings."""
    attributes: dict[str, Any] = dict(facts.run.result.attributes)
    origin = {
        TITLES.get(name, name.replace("_", " ")): _text(value)
        for name, value in attributes.items()
        if name not in (*SHOWN_ELSEWHERE, *PER_RUN_ATTRIBUTES)
    }
    integration = facts.run.data.get("integration")
    if isinstance(integration, dict):
        for key in ("method", "rtol", "atol"):
            if key in integration:
                value = integration[key]
                origin[key] = number(value, 12) if isinstance(value, float) else untrusted(value)
    return origin


def _text(value: Any) -> str:
    """Return the value of an attribute as text."""
    if isinstance(value, float):
        return UNBOUNDED if value == math.inf else number(value, 12)
    return str(value) or NO_VALUE


def _shared(facts: Sequence[RunFacts]) -> list[Block]:
    """Return the table of values that all runs share; [] if there are none."""
    origins = [_origin(entry) for entry in facts]
    rows = tuple(
        (Cell(name), Cell(value))
        for name, value in origins[0].items()
        if all(origin.get(name) == value for origin in origins)
    )
    title = "Shared by all runs" if len(facts) > 1 else "Origin of the run"
    return [Table("versions", title, (Head("property"), Head("value")), rows)] if rows else []


def _by_run(facts: Sequence[RunFacts]) -> Table:
    """Return the table of values that differ between runs."""
    origins = [_origin(entry) for entry in facts]
    names = list(dict.fromkeys(name for origin in origins for name in origin))
    differing = [name for name in names if len({origin.get(name) for origin in origins}) > 1]
    heads = (
        Head("run"),
        Head("file"),
        Head("run id"),
        *(Head(name) for name in differing),
        Head("steps", numbers=True),
        Head("evaluations", numbers=True),
        Head("wall time", "s", numbers=True),
    )
    rows = tuple(
        (
            Cell(entry.run.label),
            Cell(untrusted(entry.run.path)),
            Cell(entry.run.result.run_id),
            *(Cell(origin.get(name, NO_VALUE)) for name in differing),
            _attribute(entry, "steps", 12),
            _attribute(entry, "evaluations", 12),
            _attribute(entry, "wall_time", 3),
        )
        for entry, origin in zip(facts, origins, strict=True)
    )
    return Table("origins", "Origin of each run", heads, rows)


def _attribute(facts: RunFacts, name: str, digits: int) -> Cell:
    value = facts.run.result.attributes.get(name)
    return number_cell(float(value), digits) if isinstance(value, int | float) else Cell(NO_VALUE)


def _commands(facts: Sequence[RunFacts]) -> Table:
    """Return the commands that repeat runs from their stored configs, in another folder."""
    rows = tuple(
        (Cell(entry.run.label), Cell(repeat_command(entry.run.path, entry.run.name)))
        for entry in facts
    )
    heads = (Head("run"), Head("command"))
    return Table("commands", "Commands that repeat each run from its stored config", heads, rows)


def repeat_command(path: Path, name: str) -> str:
    """Return the command that repeats the run of a result in the folder `again`.

    Args:
        path: The file of the result.
        name: The name of the repeated run.
    """
    # NAME.yaml may be the user's own config; the command must not overwrite it.
    file, config = shell_word(path), shell_word(Path(f"{name}-again.yaml"))
    show, run = f"rbstab show {file} --config > {config}", f"rbstab run {config} -o again"
    return untrusted(one_after_the_other(show, run))
