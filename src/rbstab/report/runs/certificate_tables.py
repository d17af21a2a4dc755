"""The certificates of the runs of a report."""

from collections.abc import Sequence

from rbstab.analysis.certificate import Verdict
from rbstab.experiment.stored_certificate import CertificateLine
from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import NOTHING, counted
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.tables import quantity, verdict_cell

MAX_IN_FULL = 8
"""Runs whose certificates are written out; of more, what is violated is."""

LINE_HEADS = (
    Head("run"),
    Head("check"),
    Head("verdict"),
    Head("what was found"),
    Head("value", numbers=True),
    Head("bound", numbers=True),
    Head("at", "s", numbers=True),
)


def certificate_section(facts: Sequence[RunFacts]) -> Section:
    """A matrix of verdicts, and the lines behind them."""
    blocks: list[Block] = [_matrix(facts)]
    in_full = len(facts) <= MAX_IN_FULL
    lines = [
        (one, line)
        for one in facts
        for line in one.lines
        if in_full or line.verdict == Verdict.VIOLATED
    ]
    if lines:
        title = "The lines of the certificates" if in_full else "What is violated"
        rows = tuple(_line(one.run.label, line) for one, line in lines)
        blocks.append(Table("certificate-lines", title, LINE_HEADS, rows))
    elif not in_full:
        blocks.append("No line of any certificate is violated.")
    without = sum(not one.lines for one in facts)
    if without:
        blocks.append(f"{counted(without, 'result')} of an older rbstab: no certificate is stored.")
    return Section("certificates", "Certificates", tuple(blocks))


def _matrix(facts: Sequence[RunFacts]) -> Table:
    checks = list(dict.fromkeys(line.check for one in facts for line in one.lines))
    heads = (Head("run"), *(Head(check) for check in checks), Head("verdict of the run"))
    rows = []
    for one in facts:
        found = {line.check: line.verdict for line in one.lines}
        cells = [verdict_cell(found.get(check, NOTHING)) for check in checks]
        overall = verdict_cell(one.attribute("verdict"))
        rows.append((Cell(one.run.label), *cells, overall))
    note = (
        "consistent: seen to hold on this run; certified: proved; violated: seen not to hold; "
        "unknown: no proof was there to be read."
    )
    return Table("certificate-matrix", "What was found of each run", heads, tuple(rows), note)


def _line(label: str, line: CertificateLine) -> tuple[Cell, ...]:
    return (
        Cell(label),
        Cell(line.check),
        verdict_cell(line.verdict),
        Cell(line.quantity),
        quantity(line.value),
        quantity(line.bound),
        quantity(line.when),
    )
