"""The certificates of the runs of a report."""

from collections.abc import Sequence

from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.experiment.answers.check_words import comparison, word_of_check
from rbstab.experiment.answers.words import word_of
from rbstab.experiment.convergence.convergence import FALSE
from rbstab.report.model.document import Block, Cell, Head, Section, Table
from rbstab.report.model.words import counted
from rbstab.report.runs.answers import QUESTIONS
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.tables import ANSWER_TONES, TONES, number_cell

MAX_FULL_CERTIFICATES = 8
"""If there are more runs, only failed checks are listed."""

ANSWER_HEADS = (Head("run"), Head("question"), Head("how sure"), Head("answer"))

LINE_HEADS = (
    Head("run"),
    Head("check"),
    Head("how sure"),
    Head("what is compared"),
    Head("found"),
    Head("time", "s", numbers=True),
)

NOTE = (
    "Global stability and the certified region speak of the exact motion, the other checks of the "
    "computed one. A start outside of the certified region decides nothing. Where inputs supply "
    "power, v may rise, and nothing is stated of that."
)


def certificate_section(facts: Sequence[RunFacts]) -> Section:
    """Return the section with answers, what is proved of the exact motions, and all checks."""
    blocks: list[Block] = []
    if len(facts) > 1:
        # The card of a single run has them.
        rows = tuple(row for entry in facts for row in _answers(entry))
        blocks.append(Table("answers-in-full", "Answers in full", ANSWER_HEADS, rows))
    blocks += _convergence(facts)
    in_full = len(facts) <= MAX_FULL_CERTIFICATES
    lines = tuple(
        _line(entry.run.label, line)
        for entry in facts
        for line in entry.lines
        if in_full or line.verdict == Verdict.VIOLATED
    )
    if lines:
        title = "Checks of the certificates" if in_full else "Checks that failed"
        blocks.append(Table("certificate-lines", title, LINE_HEADS, lines, NOTE))
    without = sum(not entry.lines for entry in facts)
    if without:
        blocks.append(f"Without a certificate: {counted(without, 'result')} of an older rbstab.")
    return Section("certificates", "Certificates", tuple(blocks), folded=True)


def _answers(facts: RunFacts) -> list[tuple[Cell, ...]]:
    return [
        (
            Cell(facts.run.label),
            Cell(QUESTIONS[name]),
            Cell(answer.word, tone=ANSWER_TONES.get(answer.sureness, "")),
            Cell(answer.sentence),
        )
        for name, answer in facts.answer.answers.items()
    ]


def _convergence(facts: Sequence[RunFacts]) -> list[Block]:
    """Return a table with what is proved of the exact motion of each run; [] without any."""
    rows = []
    for entry in facts:
        found = entry.convergence
        if found is not None:
            tone = "bad" if found.word == FALSE else ""
            rows.append((Cell(entry.run.label), Cell(found.word, tone=tone), Cell(found.sentence)))
    heads = (Head("run"), Head("converges"), Head("what is proved of the exact motion"))
    return [Table("convergence", "Convergence", heads, tuple(rows))] if rows else []


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
