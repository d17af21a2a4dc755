"""The summary table of runs: status, verdict and the main numbers of each run."""

import math
from collections.abc import Sequence

from rbstab.analysis.certificate.verdict import Verdict
from rbstab.analysis.lyapunov import ENERGY_SCALE, ENERGY_SCALE_NOTE
from rbstab.analysis.settling import SETTLED_FRACTION
from rbstab.experiment.answers.outcome import Outcome, OutcomeKind
from rbstab.experiment.answers.run_answer import Answer
from rbstab.experiment.answers.state_words import kinds_of
from rbstab.experiment.answers.words import Sureness, word_of
from rbstab.experiment.convergence.convergence import FALSE, NOT_DECIDED, PROVED
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.summary import at_least, at_rest_from, is_driven
from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.model.words import NO_VALUE, number
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.margin import margin_of

HEADS = (
    Head("run"),
    Head("outcome"),
    Head("tilt", "°", numbers=True),
    Head("this start"),
    Head("whole range"),
    Head("v(0)/c*", numbers=True),
    Head("at rest from", "s", numbers=True),
    Head("peak |E|", "m", numbers=True),
    Head("status"),
    Head("peak E1", "m", numbers=True),
    Head("peak E2", "m", numbers=True),
    Head("peak E3", "m", numbers=True),
    Head("peak |θ2|", "rad", numbers=True),
    Head("v(0)", "J", numbers=True),
    Head("v(end)", "J", numbers=True),
    Head("rest states", numbers=True),
    Head("in certified region"),
    Head("variant"),
    Head(f"|r|/{ENERGY_SCALE}", numbers=True),
    Head("checks"),
)
"""The deciding columns are first: a page shows as many as fit."""

NOTE = (
    "Outcome and tilt: what became of the motion, and the angle between the attitude at which it "
    "rests, or that at the end, and the desired one. "
    "This start and whole range: how sure it is that the motion from this start, and every motion "
    "that stays in the range of the Euler angles, comes to rest. A computed run is "
    f"at rest from the time after which v stays below {SETTLED_FRACTION:g} v(0), unless at its end "
    "v no longer falls although the body moves. "
    "v(0)/c*: below 1, the start is in the certified region, in which convergence is proved; both "
    "count from the rest state of the region. "
    "E is the displacement of the contact point from its anchor; peak E1, E2 and E3 are its values "
    "farthest from zero, by axis. "
    "v is the Lyapunov function, and r = v(t) - v(0) - ∫v' dt is the energy residual. "
    f"{ENERGY_SCALE_NOTE} Rest states are those in the range of the Euler angles; they and the "
    "certified region need a proof beside the result (rbstab run makes it). Checks: what the "
    "checks of the computed run found together."
)

WORK_NOTE = (
    "For a connector that slides on s = F + κE, the table shows v - ε in place of v. ε is the work "
    "of the contact force. v - ε does not end at zero, so the settling time is computed from v."
)
"""Added to the note if a run stores v - ε."""

DRIVEN_NOTE = (
    "Where inputs supply power, a body may start at rest: it is at rest again from the time after "
    f"which v stays below {SETTLED_FRACTION:g} of its largest value. While an input goes on, it is "
    "not."
)
"""Added to the note if inputs act on a body."""

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
    note = f"{NOTE} {WORK_NOTE}" if any(entry.run.stores_v_minus_work for entry in facts) else NOTE
    if any(is_driven(entry.run.result) for entry in facts):
        note = f"{note} {DRIVEN_NOTE}"
    return Table("runs", "Runs", HEADS, tuple(_row(entry) for entry in facts), note)


def verdict_cell(verdict: str, target: str = "") -> Cell:
    """Return a cell with the word for a verdict and its tone."""
    return Cell(word_of(verdict) or NO_VALUE, tone=TONES.get(verdict, ""), target=target)


def convergence_cell(facts: RunFacts) -> Cell:
    """Return a cell that says whether convergence of the exact motion is proved."""
    word = _convergence(facts)
    return Cell(word, tone="bad" if word == FALSE else "", target="certificates")


def _convergence(facts: RunFacts) -> str:
    if facts.convergence is not None:
        return facts.convergence.word
    # In older results the verdict says it.
    return PROVED if facts.attribute("verdict") == Verdict.CERTIFIED else NOT_DECIDED


def number_cell(value: float, digits: int = 4) -> Cell:
    """Return a cell with a number."""
    return Cell(number(value, digits), value)


def _row(facts: RunFacts) -> tuple[Cell, ...]:
    s, status = facts.run.summary, facts.run.result.status
    completed = status == RunStatus.COMPLETED
    return (
        Cell(facts.run.label),
        *_outcome_cells(facts.answer.outcome),
        *map(_answer_cell, (facts.answer.this_start, facts.answer.whole_range)),
        _start_over_level(facts),
        Cell(at_rest_from(facts.run.result) or NO_VALUE, facts.run.settling_time),
        _peak_distance(facts),
        Cell(status if completed else f"{status} at {number(s.end_time)} s", tone=_tone(completed)),
        *(number_cell(peak) for peak in s.peak_contact_displacement),
        Cell(at_least(s.pitch_resolved) + number(s.largest_pitch), s.largest_pitch),
        *(_lyapunov_cell(v, facts) for v in (s.lyapunov_start, s.lyapunov_end)),
        _rest_states(facts.proof),
        _inside(None if facts.region is None else facts.region.inside),
        Cell(facts.attribute("variant") or NO_VALUE),
        number_cell(s.relative_residual, 2),
        verdict_cell(facts.attribute("verdict"), "certificates"),
    )


def _start_over_level(facts: RunFacts) -> Cell:
    """Return a cell with v(0)/c*, as on the cards; there is none where every start converges."""
    margin = margin_of(facts)
    if margin is None:
        return Cell(NO_VALUE)
    return Cell(number(margin.ratio, 3), margin.ratio)


def _peak_distance(facts: RunFacts) -> Cell:
    s = facts.run.summary
    return Cell(at_least(s.displacement_resolved) + number(s.peak_distance), s.peak_distance)


def _lyapunov_cell(value: float, facts: RunFacts) -> Cell:
    """Return a cell with v, or with v - ε, which it names, where that stands in place of v."""
    if not facts.run.stores_v_minus_work:
        return number_cell(value)
    return Cell(f"{number(value)} (v - ε)", value)


def _outcome_cells(outcome: Outcome) -> tuple[Cell, Cell]:
    """Return the outcome of a run, and its tilt in degrees."""
    tilt = math.nan if outcome.tilt is None else math.degrees(outcome.tilt)
    return Cell(outcome.kind.words, tone=outcome_tone(outcome)), number_cell(tilt, 3)


def _answer_cell(answer: Answer) -> Cell:
    tone = ANSWER_TONES.get(answer.sureness, "")
    return Cell(answer.word, tone=tone, target="certificates")


def _tone(completed: bool) -> str:
    return "" if completed else "bad"


def _rest_states(proof: Proof | None) -> Cell:
    if proof is None:
        return Cell(NO_VALUE)
    count = len(proof.states)
    tone = "warning" if proof.globally_stable is False else ""
    found = "" if proof.proved else " found"
    kinds = f": {kinds_of(proof.states)}" if count > 1 else ""
    return Cell(f"{count}{found}{kinds}", float(count), tone)


def _inside(inside: bool | None) -> Cell:
    return {
        True: Cell("yes"),
        False: Cell("no"),
        None: Cell(NO_VALUE),
    }[inside]
