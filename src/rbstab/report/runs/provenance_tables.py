"""Where results come from, what is odd about them, and how they are made again."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import NOTHING, listed, number, shell_word, untrusted
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.tables import quantity

MAX_COMMANDS = 24
"""Runs whose commands are written out."""

OF_ONE_RUN = ("steps", "evaluations", "wall_time")
"""Attributes that belong to each run by itself."""

SHOWN_ELSEWHERE = ("title", "variant", "status", "status_detail", "verdict", "warnings", "run_id")


def warnings_section(facts: Sequence[RunFacts]) -> Section | None:
    """What is odd about the runs, each sentence once; None where nothing is."""
    runs: dict[str, list[str]] = {}
    for one in facts:
        detail = one.attribute("status_detail")
        for warning in [*([detail] if detail else []), *one.attribute("warnings").splitlines()]:
            runs.setdefault(warning, []).append(one.run.label)
    if not runs:
        return None
    rows = tuple((Cell(text), Cell(listed(labels))) for text, labels in runs.items())
    table = Table("warnings", "What is odd", (Head("warning"), Head("runs")), rows)
    return Section("warnings", "Warnings", (table,))


def provenance_section(facts: Sequence[RunFacts]) -> Section:
    """Versions, identities, tolerances, and the commands that make the runs again."""
    blocks: list[Block] = []
    shared = _shared(facts)
    if shared is not None:
        blocks.append(shared)
    blocks += [_by_run(facts), *_commands(facts)]
    return Section("provenance", "Provenance", tuple(blocks))


def _origin(facts: RunFacts) -> dict[str, str]:
    """What made a run, as texts: its attributes, and how exactly it was followed."""
    attributes: dict[str, Any] = dict(facts.run.result.attributes)
    found = {
        name.replace("_", " "): str(value) or NOTHING
        for name, value in attributes.items()
        if name not in (*SHOWN_ELSEWHERE, *OF_ONE_RUN)
    }
    integration = facts.run.data.get("integration")
    if isinstance(integration, dict):
        for key in ("method", "rtol", "atol"):
            if key in integration:
                value = integration[key]
                found[key] = number(value, 12) if isinstance(value, float) else untrusted(value)
    return found


def _shared(facts: Sequence[RunFacts]) -> Table | None:
    """What is the same of all runs."""
    origins = [_origin(one) for one in facts]
    rows = tuple(
        (Cell(name), Cell(value))
        for name, value in origins[0].items()
        if all(origin.get(name) == value for origin in origins)
    )
    title = "Of all runs" if len(facts) > 1 else "Of the run"
    return Table("versions", title, (Head("what"), Head("value")), rows) if rows else None


def _by_run(facts: Sequence[RunFacts]) -> Table:
    """What each run has of its own."""
    origins = [_origin(one) for one in facts]
    names = list(dict.fromkeys(name for origin in origins for name in origin))
    own = [name for name in names if len({origin.get(name) for origin in origins}) > 1]
    heads = (
        Head("run"),
        Head("file"),
        Head("run id"),
        *(Head(name) for name in own),
        Head("steps", numbers=True),
        Head("evaluations", numbers=True),
        Head("wall time", "s", numbers=True),
    )
    rows = tuple(
        (
            Cell(one.run.label),
            Cell(untrusted(one.run.path)),
            Cell(one.run.result.run_id),
            *(Cell(origin.get(name, NOTHING)) for name in own),
            _attribute(one, "steps", 12),
            _attribute(one, "evaluations", 12),
            _attribute(one, "wall_time", 3),
        )
        for one, origin in zip(facts, origins, strict=True)
    )
    return Table("origins", "Of each run", heads, rows)


def _attribute(facts: RunFacts, name: str, digits: int) -> Cell:
    value = facts.run.result.attributes.get(name)
    return quantity(float(value), digits) if isinstance(value, int | float) else Cell(NOTHING)


def _commands(facts: Sequence[RunFacts]) -> list[Block]:
    """How runs are repeated: from their stored configs, into another folder."""
    if len(facts) > MAX_COMMANDS:
        return [
            "Each run is repeated from its stored config: "
            "rbstab show RESULT --config > NAME.yaml && rbstab run NAME.yaml -o again"
        ]
    names = _names([one.run.path for one in facts])
    rows = tuple(
        (Cell(one.run.label), Cell(repeating(one.run.path, name)))
        for one, name in zip(facts, names, strict=True)
    )
    heads = (Head("run"), Head("command"))
    return [Table("commands", "What repeats each run, from its stored config", heads, rows)]


def _names(paths: Sequence[Path]) -> list[str]:
    """The names of results, with numbers where several have the same."""
    counts = Counter(path.stem for path in paths)
    return [
        path.stem if counts[path.stem] == 1 else f"{path.stem}-{number + 1}"
        for number, path in enumerate(paths)
    ]


def repeating(path: Path, name: str) -> str:
    """The command that repeats the run of a result into the folder `again`, by a name."""
    # Beside a result there may be the config that somebody has written by hand.
    file, config = shell_word(path), shell_word(Path(f"{name}-again.yaml"))
    return untrusted(f"rbstab show {file} --config > {config} && rbstab run {config} -o again")
