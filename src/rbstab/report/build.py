"""Build a report from results."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime

from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Block, Cards, Report, Section
from rbstab.report.model.words import counted, listed, untrusted
from rbstab.report.reading.sources import Run, Sources
from rbstab.report.runs.answers import answer_blocks
from rbstab.report.runs.certificate_tables import certificate_section
from rbstab.report.runs.config_tables import (
    config_section,
    differences_section,
    provenance_section,
)
from rbstab.report.runs.motion import animation_of
from rbstab.report.runs.reference_tables import reference_section
from rbstab.report.runs.sections import figures_section
from rbstab.report.runs.tables import summary_table, warnings_section
from rbstab.report.sweeps.answers import cards_of
from rbstab.report.sweeps.sections import SweepPart, sweep_part

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
    alone = not sources.runs and len(sources.sweeps) == 1
    sweeps = [sweep_part(sweep, alone=alone) for sweep in sources.sweeps]
    sections = _sections(sources.runs, sweeps, alone=alone)
    return Report(
        title=untrusted(title) if title else _title(sources, sweeps, alone=alone),
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        command=untrusted(command, MAX_COMMAND_LENGTH),
        sections=tuple(section for section in sections if section is not None),
        unread=sources.unread,
    )


def _sections(
    runs: Sequence[Run], sweeps: Sequence[SweepPart], *, alone: bool
) -> Iterator[Section | None]:
    """Yield the sections: the answers and what is wrong, then motion, figures and numbers."""
    if not alone:
        yield Section("summary", "Summary", tuple(_summary(runs, sweeps)))
    if runs:
        yield warnings_section(runs)
        yield _animations(runs)
        yield figures_section(runs)
        yield Section("runs", "Numbers", (summary_table(runs),))
        yield reference_section(runs)
        yield differences_section(runs)
    for part in sweeps:
        yield from part.sections
    if runs:
        yield certificate_section(runs)
        yield config_section(runs)
        yield provenance_section(runs)


def _summary(runs: Sequence[Run], sweeps: Sequence[SweepPart]) -> list[Block]:
    """Return the answers of runs and sweeps: the sentences on runs, then all cards."""
    blocks = [*(answer_blocks(runs) if runs else ())]
    if not sweeps:
        return blocks
    if len(runs) == 1:
        blocks[0] = f"Run {runs[0].label}: {blocks[0]}"
    cards = cards_of("sweeps-answers", [part.answer.card for part in sweeps])
    # A word means the same on both, and is explained once.
    explained = {word for block in blocks if isinstance(block, Cards) for word, _ in block.words}
    words = tuple((word, meaning) for word, meaning in cards.words if word not in explained)
    return [*blocks, replace(cards, words=words)]


def _animations(runs: Sequence[Run]) -> Section | None:
    """Return animated views of runs with more than one sample; None if there are none."""
    moving = [run for run in runs if run.config is not None and len(run.result["time"]) > 1]
    # If there are too many, those that ended early come first: of these the motion explains most.
    early_first = sorted(moving, key=lambda run: run.result.status == RunStatus.COMPLETED)
    shown = [run for run in moving if run in early_first[:MAX_ANIMATIONS]]
    blocks: list[Block] = [animation_of(run) for run in shown]
    if len(shown) < len(runs):
        others = listed(run.label for run in runs if run not in shown)
        blocks.insert(0, f"Shown: {len(shown)} of {len(runs)} runs. Not shown: {others}.")
    return Section("motion", "Motion", tuple(blocks)) if shown else None


def _title(sources: Sources, sweeps: Sequence[SweepPart], *, alone: bool) -> str:
    """Return the title of a single result, or the numbers of runs and sweeps."""
    if len(sources.runs) == 1 and not sweeps:
        return untrusted(sources.runs[0].result.attributes["title"])
    if alone:
        return sweeps[0].title or f"Sweep {sources.sweeps[0].label}"
    counts = ((len(sources.runs), "run"), (len(sweeps), "sweep"))
    return " and ".join(counted(count, word) for count, word in counts if count)
