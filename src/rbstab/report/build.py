"""Build a report from results."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Block, Cards, Report, Section
from rbstab.report.model.words import counted, listed, untrusted
from rbstab.report.reading.sources import Run, Sources
from rbstab.report.runs.answers import answer_blocks
from rbstab.report.runs.certificate_tables import certificate_section
from rbstab.report.runs.config_tables import config_section, differences_section
from rbstab.report.runs.facts import RunFacts, facts_of
from rbstab.report.runs.motion import animation_of
from rbstab.report.runs.provenance_tables import provenance_section, warnings_section
from rbstab.report.runs.reference_tables import reference_section
from rbstab.report.runs.sections import figures_section
from rbstab.report.runs.tables import summary_table

if TYPE_CHECKING:
    from rbstab.report.sweeps.sections import SweepPart

MAX_COMMAND_LENGTH = 20_000
"""Maximum length of the command; large, because a truncated command cannot be run."""

MAX_ANIMATIONS = 4
"""Maximum number of animated views; each needs its own drawing area on a page."""


def report_of(sources: Sources, command: str, title: str | None = None) -> Report:
    """Return the report of some results.

    Args:
        sources: The results.
        command: The command that repeats the report.
        title: The heading; default: the title of the result, or the number of results.

    Raises:
        StoreError: The file of a sweep cannot be read.
    """
    facts, sweeps = facts_of(sources.runs), _sweep_parts(sources)
    return Report(
        title=untrusted(title) if title else _title(sources, sweeps),
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        command=untrusted(command, MAX_COMMAND_LENGTH),
        sections=tuple(_sections(sources, facts, sweeps)),
        unread=sources.unread,
    )


def _is_alone(sources: Sources) -> bool:
    """Return whether there is one sweep and nothing else."""
    return not sources.runs and len(sources.sweeps) == 1


def _sweep_parts(sources: Sources) -> "list[SweepPart]":
    if not sources.sweeps:
        return []
    # Imported late: it needs many modules, and most reports have no sweep.
    from rbstab.report.sweeps.sections import sweep_part

    return [sweep_part(sweep, alone=_is_alone(sources)) for sweep in sources.sweeps]


def _sections(
    sources: Sources, facts: Sequence[RunFacts], sweeps: Sequence["SweepPart"]
) -> Iterable[Section]:
    """Yield the sections: the answers and what is wrong, then motion, figures and numbers."""
    summary = [*(answer_blocks(facts) if facts else ())]
    if sweeps and not _is_alone(sources):
        summary = _with_sweeps(summary, facts, sweeps)
    if summary:
        yield Section("summary", "Summary", tuple(summary))
    if facts:
        yield from _present(warnings_section(facts), _animations(sources.runs))
        yield figures_section(facts)
        yield Section("runs", "Numbers", (summary_table(facts),))
        yield from _present(reference_section(facts), differences_section(facts))
    for part in sweeps:
        yield from part.sections
    if facts:
        yield certificate_section(facts)
        yield from _present(config_section(facts))
        yield provenance_section(facts)


def _with_sweeps(
    of_runs: list[Block], facts: Sequence[RunFacts], sweeps: Sequence["SweepPart"]
) -> list[Block]:
    """Return the answers of runs and sweeps: the sentences on runs, then all cards."""
    from rbstab.report.sweeps.answers import cards_of

    sentences = [block for block in of_runs if isinstance(block, str)]
    if len(facts) == 1:
        sentences[0] = f"Run {facts[0].run.label}: {sentences[0]}"
    cards = [block for block in of_runs if not isinstance(block, str)]
    of_sweeps = cards_of("sweeps-answers", [p.answer.card for p in sweeps])
    # A word means the same on both, and is explained once.
    known = {word for block in cards if isinstance(block, Cards) for word, _ in block.words}
    words = tuple((word, meaning) for word, meaning in of_sweeps.words if word not in known)
    return [*sentences, *cards, replace(of_sweeps, words=words)]


def _present(*sections: Section | None) -> Iterable[Section]:
    return (section for section in sections if section is not None)


def _animations(runs: Sequence[Run]) -> Section | None:
    """Return animated views of runs with more than one sample; None if there are none.

    If there are too many, those that ended early come first: of these the motion explains most.
    """
    moving = [run for run in runs if run.config is not None and len(run.result["time"]) > 1]
    if not moving:
        return None
    early_first = sorted(moving, key=lambda run: run.result.status == RunStatus.COMPLETED)
    chosen = early_first[:MAX_ANIMATIONS]
    shown = [run for run in moving if run in chosen]
    blocks: list[Block] = [animation_of(run) for run in shown]
    if len(shown) < len(runs):
        others = listed(run.label for run in runs if run not in shown)
        blocks.insert(0, f"Shown: {len(shown)} of {len(runs)} runs. Not shown: {others}.")
    return Section("motion", "Motion", tuple(blocks))


def _title(sources: Sources, sweeps: Sequence["SweepPart"]) -> str:
    """Return the title of a single result, or the numbers of runs and sweeps."""
    if len(sources.runs) == 1 and not sources.sweeps:
        return untrusted(sources.runs[0].result.attributes["title"])
    if _is_alone(sources):
        return sweeps[0].title or f"Sweep {sources.sweeps[0].label}"
    counts = ((len(sources.runs), "run"), (len(sources.sweeps), "sweep"))
    return " and ".join(counted(count, word) for count, word in counts if count)
