"""Tables that compare the values printed in a source with the computed values."""

from collections.abc import Sequence

from rbstab.experiment.summary import ReferenceValue
from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import NO_VALUE, listed, number, untrusted, vector
from rbstab.report.runs.config_tables import value_text
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.paper_cases import CASES, changed_keys

HEADS = (
    Head("run"),
    Head("quantity"),
    Head("printed"),
    Head("verdict"),
    Head("computed"),
    Head("computed - printed"),
)

NOTE = (
    "Disproved: the exact motion of this config, with its numbers as they are written, is proved "
    "to end elsewhere. A printed number stands for all numbers that round to its digits. The "
    "verdict is empty if the motion was not enclosed to its end (rbstab run CONFIG --prove "
    "--to-end)."
)

CLAIM = "globally stable"
"""What the paper says of its controlled bodies, in the range of eq. 5."""

CHANGED_HEADS = (
    Head("run"),
    Head("source"),
    Head("keys that differ, and the values of the source"),
)

CHANGED_NOTE = (
    "What the source prints says nothing about these runs, so they are not compared with it: they "
    "are not of its case."
)


def reference_section(facts: Sequence[RunFacts]) -> Section | None:
    """Return the section with printed and computed values; None if no config has a `reference`."""
    changes = {entry.run.label: _changes(entry) for entry in facts}
    own = [entry for entry in facts if not changes[entry.run.label]]
    changed = [entry for entry in facts if changes[entry.run.label]]
    rows = [_row(entry.run.label, value) for entry in own for value in entry.comparisons]
    rows += [_claim(entry) for entry in own if _is_of_paper(entry)]
    blocks: list[Block] = list(_sentences(own))
    if rows:
        blocks += _stopped(own)
        blocks.append(Table("reference", "Printed and computed", HEADS, tuple(rows), NOTE))
    if changed:
        others = tuple(
            (Cell(entry.run.label), Cell(untrusted(_source(entry))), Cell(changes[entry.run.label]))
            for entry in changed
        )
        blocks.append(
            Table("reference-changed", "Changed configs", CHANGED_HEADS, others, CHANGED_NOTE)
        )
    if not blocks:
        return None
    return Section("source", "Comparison with the source", tuple(blocks))


def _is_of_paper(entry: RunFacts) -> bool:
    """Whether a run is a case of the paper as it stands there: without elements of its own."""
    config = entry.run.config
    return config is not None and _source(entry) in CASES and not config.elements


def _claim(entry: RunFacts) -> tuple[Cell, ...]:
    """Return what the paper says of the stability of its case, beside what is known."""
    answer = entry.answer.whole_range
    return (
        *(Cell(entry.run.label), Cell("the body is"), Cell(CLAIM)),
        *(Cell(answer.word), Cell(answer.sentence), Cell(NO_VALUE)),
    )


def _changes(entry: RunFacts) -> str:
    """Return the keys in which a run differs from the case of its source; "" for none."""
    config, data = entry.run.config, entry.run.data
    keys = changed_keys(config, data) if config is not None and data else {}
    return "; ".join(
        f"{untrusted(key)} = {value_text(value)} ({value_text(printed)})"
        for key, (value, printed) in keys.items()
    )


def _source(entry: RunFacts) -> str:
    reference = entry.run.config.reference if entry.run.config is not None else None
    return reference.source if reference is not None else ""


def _sentences(facts: Sequence[RunFacts]) -> list[str]:
    """Return a sentence for each source, with its note and the runs that refer to it."""
    labels: dict[str, list[str]] = {}
    for entry in facts:
        reference = entry.run.config.reference if entry.run.config is not None else None
        if reference is not None:
            note = f": {untrusted(reference.note)}" if reference.note else ""
            labels.setdefault(f"{untrusted(reference.source)}{note}", []).append(entry.run.label)
    return [f"{listed(runs)}: {sentence}." for sentence, runs in labels.items()]


def _stopped(facts: Sequence[RunFacts]) -> list[str]:
    """Return a warning for each run that stopped before the time of the printed values."""
    return [
        f"{entry.run.label}: the run stopped at {number(entry.run.summary.end_time)} s "
        f"({entry.run.result.status}). Its computed values describe the motion until then."
        for entry in facts
        if entry.comparisons and entry.run.result.status != RunStatus.COMPLETED
    ]


def _row(label: str, comparison: ReferenceValue) -> tuple[Cell, ...]:
    computed, printed = comparison.computed, comparison.printed
    differences = [c - p for c, p in zip(computed, printed, strict=True)]
    return (
        Cell(label),
        Cell(f"{comparison.name.replace('_', ' ')} [{comparison.unit}]"),
        Cell(vector(printed)),
        _exact(comparison),
        *(Cell(vector(values)) for values in (computed, differences)),
    )


def _exact(comparison: ReferenceValue) -> Cell:
    if comparison.exact is None:
        return Cell(NO_VALUE)
    if comparison.disproved:
        return Cell("disproved", tone="bad")
    return Cell("possible")
