"""The certificates of the runs of a report."""

from collections.abc import Sequence

from rbstab.analysis.certificate import Verdict
from rbstab.experiment.stored_certificate import CertificateLine
from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import NO_VALUE, counted
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.tables import convergence_cell, number_cell, verdict_cell

MAX_FULL_CERTIFICATES = 8
"""If there are more runs, only violated checks are listed."""

LINE_HEADS = (
    Head("run"),
    Head("check"),
    Head("verdict"),
    Head("quantity"),
    Head("value", numbers=True),
    Head("bound", numbers=True),
    Head("time", "s", numbers=True),
)


def certificate_section(facts: Sequence[RunFacts]) -> Section:
    """Return the section with the table of verdicts and the table of checks."""
    blocks: list[Block] = [*_convergence_list(facts), _matrix(facts)]
    in_full = len(facts) <= MAX_FULL_CERTIFICATES
    lines = [
        (entry, line)
        for entry in facts
        for line in entry.lines
        if in_full or line.verdict == Verdict.VIOLATED
    ]
    if lines:
        title = "Checks of the certificates" if in_full else "Violated checks"
        rows = tuple(_line(entry.run.label, line) for entry, line in lines)
        blocks.append(Table("certificate-lines", title, LINE_HEADS, rows))
    elif not in_full:
        blocks.append("No certificate has a violated check.")
    without = sum(not entry.lines for entry in facts)
    if without:
        blocks.append(f"Without a certificate: {counted(without, 'result')} of an older rbstab.")
    return Section("certificates", "Certificates", tuple(blocks))


def _convergence_list(facts: Sequence[RunFacts]) -> list[Block]:
    """Return a table with what is proved of the exact motion of each run."""
    rows = [
        (Cell(entry.run.label), convergence_cell(entry), Cell(entry.convergence.sentence))
        for entry in facts
        if entry.convergence is not None
    ]
    if not rows:
        return []
    heads = (Head("run"), Head("converges"), Head("what is proved of the exact motion"))
    return [Table("convergence", "Convergence", heads, tuple(rows))]


def _matrix(facts: Sequence[RunFacts]) -> Table:
    checks = list(dict.fromkeys(line.check for entry in facts for line in entry.lines))
    heads = (Head("run"), *(Head(check) for check in checks), Head("verdict of the run"))
    rows = []
    for entry in facts:
        verdicts = {line.check: line.verdict for line in entry.lines}
        cells = [verdict_cell(verdicts.get(check, NO_VALUE)) for check in checks]
        overall = verdict_cell(entry.attribute("verdict"))
        rows.append((Cell(entry.run.label), *cells, overall))
    note = (
        "The verdict of a run speaks of what was computed. consistent: held along this run, but is "
        "not proved. driven: inputs supply power, so v may rise; what rises is supplied. "
        "violated: did not hold along this run, or is disproved. certified: proved. "
        "unknown: not decided, because there is no stored "
        "proof, or because the numbers are too inaccurate. Numbers over v(0) are divided by a ten "
        "thousandth of the largest energy if that is larger."
    )
    return Table("certificate-matrix", "Verdicts of each run", heads, tuple(rows), note)


def _line(label: str, line: CertificateLine) -> tuple[Cell, ...]:
    return (
        Cell(label),
        Cell(line.check),
        verdict_cell(line.verdict),
        Cell(line.quantity),
        number_cell(line.value),
        number_cell(line.bound),
        number_cell(line.when),
    )
