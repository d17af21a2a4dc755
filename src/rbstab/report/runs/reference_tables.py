"""What a source prints, beside what was computed."""

from collections.abc import Sequence

from rbstab.experiment.summary import Comparison
from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import listed, number, untrusted, vector
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.tables import CENTIMETRES

HEADS = (
    Head("run"),
    Head("quantity"),
    Head("printed"),
    Head("computed"),
    Head("computed - printed"),
)


def reference_section(facts: Sequence[RunFacts]) -> Section | None:
    """Printed and computed values side by side; None where no config has a `reference`."""
    rows = tuple(_row(one.run.label, found) for one in facts for found in one.comparisons)
    blocks: list[Block] = [*_sentences(facts)]
    if not blocks:
        return None
    if rows:
        blocks += _stopped(facts)
        blocks.append(Table("reference", "Printed and computed values", HEADS, rows))
    return Section("source", "Against the source", tuple(blocks))


def _sentences(facts: Sequence[RunFacts]) -> list[str]:
    """The sources with their notes, each once for all the runs that name it."""
    labels: dict[str, list[str]] = {}
    for one in facts:
        reference = one.run.config.reference if one.run.config is not None else None
        if reference is not None:
            note = f": {untrusted(reference.note)}" if reference.note else ""
            labels.setdefault(f"{untrusted(reference.source)}{note}", []).append(one.run.label)
    return [f"{listed(runs)}: {sentence}." for sentence, runs in labels.items()]


def _stopped(facts: Sequence[RunFacts]) -> list[str]:
    """That what is compared is not the end that the source means, of runs that did not reach it."""
    return [
        f"{one.run.label}: the run stopped at {number(one.run.summary.end_time)} s "
        f"({one.run.result.status}); what was computed is of its motion until then."
        for one in facts
        if one.comparisons and one.run.result.status != RunStatus.COMPLETED
    ]


def _row(label: str, found: Comparison) -> tuple[Cell, ...]:
    # What is about the contact point is told in centimetres everywhere in a report.
    of_contact = found.name == "peak contact_displacement"
    factor, unit = (CENTIMETRES, "cm") if of_contact else (1.0, found.unit)
    printed = [factor * value for value in found.printed]
    computed = [factor * value for value in found.computed]
    apart = [c - p for c, p in zip(computed, printed, strict=True)]
    return (
        Cell(label),
        Cell(f"{found.name.replace('_', ' ')} [{unit}]"),
        *(Cell(vector(values)) for values in (printed, computed, apart)),
    )
