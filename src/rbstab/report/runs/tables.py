"""The table of runs, and the entries of tables: verdicts, answers and outcomes with their tones."""

from collections.abc import Sequence

from rbstab.analysis.certificate.verdict import Verdict
from rbstab.analysis.lyapunov import ENERGY_SCALE, ENERGY_SCALE_NOTE
from rbstab.experiment.answers.outcome import Outcome, OutcomeKind
from rbstab.experiment.answers.run_answer import Answer
from rbstab.experiment.answers.state_words import kinds_of
from rbstab.experiment.answers.words import Sureness, word_of
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.model.words import NO_VALUE, number
from rbstab.report.runs.facts import FACTS, RunFacts

NUMBERS = (
    *("v(0)/c*", "at rest from", "peak |E|", "peak E1", "peak E2", "peak E3", "peak |θ2|"),
    *("v(0)", "v(end)", f"|r|/{ENERGY_SCALE}"),
)
"""The numbers of the table, the deciding ones first: a page shows as many columns as fit."""

NOTE = (
    "This start and whole range: how sure it is that the motion from this start, and every motion "
    "that stays in the range of the Euler angles, comes to rest. r = v(t) - v(0) - ∫v' dt is the "
    f"energy residual. {ENERGY_SCALE_NOTE} Rest states are those in the range; they and the "
    "certified region need a proof beside the result. Checks: what the checks of the computed run "
    "found together."
)

TONES: dict[str, str] = {
    Verdict.CERTIFIED: "good",
    Verdict.VIOLATED: "bad",
}
"""Tones of verdicts; what held but is not proved, and what is not decided, is no alarm."""

ANSWER_TONES = {Sureness.FALSE: "bad"}
"""Tones of answers. Green is only the outcome of a body that rests where it should: it may be
proved that it does not."""


def outcome_tone(outcome: Outcome) -> str:
    """Return the tone of an outcome; a body that still moves, or may leave, is no alarm."""
    tones = dict.fromkeys((OutcomeKind.LEFT_RANGE, OutcomeKind.FAILED), "bad")
    tones |= dict.fromkeys((OutcomeKind.RESTS_ELSEWHERE, OutcomeKind.UNSTABLE), "warning")
    return "good" if outcome.is_good else tones.get(outcome.kind, "")


def summary_table(facts: Sequence[RunFacts]) -> Table:
    """Return the table with one row for each run."""
    heads = (
        *(Head("run"), Head("outcome"), FACTS["tilt"].head, Head("this start")),
        *(Head("whole range"), *(FACTS[name].head for name in NUMBERS)),
        *(Head("status"), Head("rest states", numbers=True), Head("in certified region")),
        *(Head("variant"), Head("checks")),
    )
    return Table("runs", "Numbers of each run", heads, tuple(map(_row, facts)), NOTE)


def verdict_cell(verdict: str, target: str = "") -> Cell:
    """Return a cell with the word for a verdict and its tone."""
    return Cell(word_of(verdict) or NO_VALUE, tone=TONES.get(verdict, ""), target=target)


def number_cell(value: float, digits: int = 4) -> Cell:
    """Return a cell with a number."""
    return Cell(number(value, digits), value)


def answer_cell(answer: Answer) -> Cell:
    """Return a cell with how sure an answer is."""
    return Cell(answer.word, tone=ANSWER_TONES.get(answer.sureness, ""), target="certificates")


def _row(facts: RunFacts) -> tuple[Cell, ...]:
    status, outcome = facts.run.result.status, facts.answer.outcome
    early = "" if status == RunStatus.COMPLETED else f" at {number(facts.run.summary.end_time)} s"
    return (
        Cell(facts.run.label),
        Cell(outcome.kind.words, tone=outcome_tone(outcome)),
        FACTS["tilt"].cell(facts),
        answer_cell(facts.answer.this_start),
        answer_cell(facts.answer.whole_range),
        *(FACTS[name].cell(facts) for name in NUMBERS),
        Cell(f"{status}{early}", tone="bad" if early else ""),
        _rest_states(facts.proof),
        Cell(NO_VALUE if facts.region is None else "yes" if facts.region.inside else "no"),
        Cell(facts.attribute("variant") or NO_VALUE),
        verdict_cell(facts.attribute("verdict"), "certificates"),
    )


def _rest_states(proof: Proof | None) -> Cell:
    if proof is None:
        return Cell(NO_VALUE)
    count = len(proof.states)
    tone = "warning" if proof.globally_stable is False else ""
    found = "" if proof.proved else " found"
    kinds = f": {kinds_of(proof.states)}" if count > 1 else ""
    return Cell(f"{count}{found}{kinds}", float(count), tone)
