"""The certificates of the runs of a report."""

from collections.abc import Sequence

from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.experiment.answers.check_words import comparison, word_of_check
from rbstab.experiment.answers.facts import TONES, Shown, answer_tone
from rbstab.experiment.answers.words import word_of
from rbstab.experiment.convergence.convergence import FALSE
from rbstab.report.model.document import Block, Cell, Entry, Head, Section, Table
from rbstab.report.model.words import counted
from rbstab.report.reading.sources import Run
from rbstab.report.runs.answers import QUESTIONS

MAX_FULL_CERTIFICATES = 8
"""If there are more runs, only failed checks are listed."""

ANSWERS = ("run", "question", "how sure", "answer")
CONVERGENCE = ("run", "converges", "what is proved of the exact motion")
CHECKS = ("run", "check", "how sure", "what is compared", "found", Head("time", "s"))
"""The heads of the tables."""

NOTE = (
    "Global stability and the certified region speak of the exact motion, the other checks of the "
    "computed one. A start outside of the certified region decides nothing. Where inputs supply "
    "power, v may rise, and nothing is stated of that."
)


def certificate_section(runs: Sequence[Run]) -> Section:
    """Return the section with answers, what is proved of the exact motions, and all checks."""
    blocks: list[Block] = []
    if len(runs) > 1:
        # The card of a single run has them.
        answers = [
            (
                run.label,
                QUESTIONS[name],
                Shown(answer.word, tone=answer_tone(answer)),
                answer.sentence,
            )
            for run in runs
            for name, answer in run.answer.answers.items()
        ]
        blocks.append(Table.of("answers-in-full", "Answers in full", ANSWERS, answers))
    proved = [
        (
            run.label,
            Cell(convergence.word, tone="bad" if convergence.word == FALSE else ""),
            convergence.sentence,
        )
        for run in runs
        if (convergence := run.convergence) is not None
    ]
    if proved:
        blocks.append(Table.of("convergence", "Convergence", CONVERGENCE, proved))
    in_full = len(runs) <= MAX_FULL_CERTIFICATES
    checks = [
        _line(run.label, line)
        for run in runs
        for line in run.checks
        if in_full or line.verdict == Verdict.VIOLATED
    ]
    if checks:
        title = "Checks of the certificates" if in_full else "Checks that failed"
        blocks.append(Table.of("certificate-lines", title, CHECKS, checks, NOTE))
    without = sum(not run.checks for run in runs)
    if without:
        blocks.append(f"Without a certificate: {counted(without, 'result')} of an older rbstab.")
    return Section("certificates", "Certificates", tuple(blocks), folded=True)


def _line(label: str, line: Check) -> tuple[Entry, ...]:
    word = word_of_check(line)
    tone = TONES.get(line.verdict, "") if word == word_of(line.verdict) else ""
    compared = comparison(line)
    return label, line.check, Cell(word, tone=tone), line.quantity, compared, line.when
