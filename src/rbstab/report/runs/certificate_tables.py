"""The certificates of the runs of a report."""

from collections.abc import Sequence

from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.analysis.lyapunov import ENERGY_SCALE_NOTE
from rbstab.experiment.answers.check_words import comparison, word_of_check
from rbstab.experiment.answers.words import word_of
from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import NO_VALUE, counted
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.tables import TONES, convergence_cell, number_cell, verdict_cell

MAX_FULL_CERTIFICATES = 8
"""If there are more runs, only failed checks are listed."""

LINE_HEADS = (
    Head("run"),
    Head("check"),
    Head("how sure"),
    Head("what is compared"),
    Head("found"),
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
        title = "Checks of the certificates" if in_full else "Checks that failed"
        rows = tuple(_line(entry.run.label, line) for entry, line in lines)
        blocks.append(Table("certificate-lines", title, LINE_HEADS, rows))
    elif not in_full:
        blocks.append("No check failed.")
    without = sum(not entry.lines for entry in facts)
    if without:
        blocks.append(f"Without a certificate: {counted(without, 'result')} of an older rbstab.")
    return Section("certificates", "Certificates", tuple(blocks), folded=True)


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
    heads = (Head("run"), *(Head(check) for check in checks), Head("computed run"))
    rows = []
    for entry in facts:
        lines = {line.check: line for line in entry.lines}
        cells = [check_cell(lines[check]) if check in lines else Cell(NO_VALUE) for check in checks]
        overall = verdict_cell(entry.attribute("verdict"))
        rows.append((Cell(entry.run.label), *cells, overall))
    driven = "Where inputs supply power, v may rise, and nothing is stated of that. "
    if not any(entry.run.is_driven for entry in facts):
        driven = ""
    note = (
        "The last column puts the checks of the computed run together; global stability and the "
        "certified region have no part in it, because they speak of the exact motion. A start "
        f"outside of the certified region decides nothing. {driven}{ENERGY_SCALE_NOTE}"
    )
    return Table("certificate-matrix", "Checks of each run", heads, tuple(rows), note)


def check_cell(line: Check) -> Cell:
    """Return a cell with the word for a check."""
    word = word_of_check(line)
    return Cell(word, tone=TONES.get(line.verdict, "") if word == word_of(line.verdict) else "")


def _line(label: str, line: Check) -> tuple[Cell, ...]:
    return (
        Cell(label),
        Cell(line.check),
        check_cell(line),
        Cell(line.quantity),
        Cell(comparison(line)),
        number_cell(line.when),
    )
