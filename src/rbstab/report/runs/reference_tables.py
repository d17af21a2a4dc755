"""Tables that compare the values printed in a source with the computed values."""

from collections.abc import Sequence

from rbstab.config.sections.body import Reference
from rbstab.experiment.answers.facts import ended_early
from rbstab.experiment.answers.rounded import NO_VALUE, vector
from rbstab.experiment.summary import ReferenceValue, reference_values_of
from rbstab.report.model.document import Block, Cell, Entry, Section, Table
from rbstab.report.model.words import listed, untrusted, with_unit
from rbstab.report.reading.sources import Run
from rbstab.report.runs.config_tables import value_text
from rbstab.report.runs.paper_cases import CASES, changed_keys

HEADS = ("run", "quantity", "printed", "verdict", "computed", "computed - printed")

NOTE = (
    "Disproved: the exact motion of this config, with its numbers as they are written, is proved "
    "to end elsewhere. A printed number stands for all numbers that round to its digits. The "
    "verdict is empty if the motion was not enclosed to its end (rbstab run CONFIG --prove "
    "--to-end)."
)

CLAIM = "globally stable"
"""What the paper says of its controlled bodies, in the range of eq. 5."""

CHANGED_HEADS = ("run", "source", "keys that differ, and the values of the source")

CHANGED_NOTE = (
    "What the source prints says nothing about these runs, so they are not compared with it: they "
    "are not of its case."
)


def reference_section(runs: Sequence[Run]) -> Section | None:
    """Return the section with printed and computed values; None if no config has a `reference`."""
    changes = {run.label: _changes(run) for run in runs}
    references = {
        run: reference for run in runs if (reference := _of(run)) and not changes[run.label]
    }
    labels: dict[str, list[str]] = {}
    for run, reference in references.items():
        note = f": {untrusted(reference.note)}" if reference.note else ""
        labels.setdefault(f"{untrusted(reference.source)}{note}", []).append(run.label)
    blocks: list[Block] = [f"{listed(named)}: {source}." for source, named in labels.items()]
    values = [
        (run, value)
        for run, reference in references.items()
        for value in reference_values_of(run.result, reference, run.summary)
    ]
    rows = [_row(run.label, value) for run, value in values]
    rows += [_claim(run) for run, reference in references.items() if _is_of_paper(run, reference)]
    if rows:
        early = {run.label: end for run, _ in values if (end := ended_early(run))}
        blocks += [
            f"{label}: ended early: {end}. Its computed values describe the motion until then."
            for label, end in early.items()
        ]
        blocks.append(Table.of("reference", "Printed and computed", HEADS, rows, NOTE))
    changed = [
        (run.label, untrusted(reference.source), changes[run.label])
        for run in runs
        if (reference := _of(run)) and changes[run.label]
    ]
    if changed:
        table = "reference-changed", "Changed configs", CHANGED_HEADS, changed, CHANGED_NOTE
        blocks.append(Table.of(*table))
    return Section("source", "Comparison with the source", tuple(blocks)) if blocks else None


def _of(run: Run) -> Reference | None:
    return None if run.config is None else run.config.reference


def _changes(run: Run) -> str:
    """Return the keys in which a run differs from the case of its source; "" for none."""
    keys = {} if run.config is None else changed_keys(run.config, run.data)
    return "; ".join(
        f"{untrusted(key)} = {value_text(value)} ({value_text(printed)})"
        for key, (value, printed) in keys.items()
    )


def _is_of_paper(run: Run, reference: Reference) -> bool:
    """Whether a run is a case of the paper as it stands there: without elements of its own."""
    return reference.source in CASES and run.config is not None and not run.config.elements


def _claim(run: Run) -> tuple[Entry, ...]:
    """Return what the paper says of the stability of its case, beside what is known."""
    answer = run.answer.whole_range
    return run.label, "the body is", CLAIM, answer.word, answer.sentence, NO_VALUE


def _row(label: str, value: ReferenceValue) -> tuple[Entry, ...]:
    differences = [c - p for c, p in zip(value.computed, value.printed, strict=True)]
    name = with_unit(value.name.replace("_", " "), value.unit)
    vectors = map(vector, (value.computed, differences))
    return label, name, vector(value.printed), _exact(value), *vectors


def _exact(value: ReferenceValue) -> Cell:
    """Return whether a printed value may be that of the exact motion, if this is known."""
    if value.exact is None:
        return Cell(NO_VALUE)
    return Cell("disproved", tone="bad") if value.disproved else Cell("possible")
