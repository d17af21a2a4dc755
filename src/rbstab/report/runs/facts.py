"""What is said of a run in a few words or a number: each fact once, with name, unit and meaning.

Tables, cards and comparisons choose facts from `FACTS` by their names.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rbstab.analysis.certificate.verdict import Verdict
from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.experiment.answers.outcome import Outcome, OutcomeKind
from rbstab.experiment.answers.run_answer import (
    SAME_START,
    SETTLED,
    SETTLED_DRIVEN,
    STARTS_AT_REST,
    Answer,
)
from rbstab.experiment.answers.state_words import kinds_of
from rbstab.experiment.answers.words import Sureness, word_of
from rbstab.experiment.convergence.zero_description import is_below_end
from rbstab.experiment.summary import at_least, at_rest_from, lyapunov_function_of
from rbstab.integrate.status import RunStatus
from rbstab.report.model.document import Cell, Entry, Head
from rbstab.report.model.words import NO_VALUE, number
from rbstab.report.reading.sources import Run

TONES = {Verdict.CERTIFIED.value: "good", Verdict.VIOLATED.value: "bad"}
"""Tones of verdicts; what held but is not proved, and what is not decided, is no alarm."""

ANSWER_TONES = {Sureness.FALSE: "bad"}
"""Tones of answers. Green is only the outcome of a body that rests where it should: it may be
proved that it does not."""


class Fact(NamedTuple):
    """A fact about a run.

    Attributes:
        name: Its name in tables and on cards.
        unit: Its unit; "" for a pure number and for words.
        get: Gets it, as an entry of a table; NaN if the run has none.
        words: What it means; "" if its name says it.
    """

    name: str
    unit: str
    get: Callable[[Run], Entry]
    words: str = ""

    @property
    def head(self) -> Head:
        """The head of its column."""
        return Head(self.name, self.unit)

    def shown(self, run: Run) -> str:
        """Return it with its unit; "" if the run has none."""
        text, value, *_ = Cell.of(self.get(run))
        if value is None or math.isnan(value):
            return ""
        degrees = f" ({math.degrees(value):.4g}°)" if self.unit == "rad" else ""
        return f"{text} {self.unit}".strip() + degrees


def answer_cell(answer: Answer, target: str = "") -> Cell:
    """Return how sure an answer is, with its tone."""
    return Cell(answer.word, tone=ANSWER_TONES.get(answer.sureness, ""), target=target)


def outcome_tone(outcome: Outcome) -> str:
    """Return the tone of an outcome; a body that still moves, or may leave, is no alarm."""
    tones = dict.fromkeys((OutcomeKind.LEFT_RANGE, OutcomeKind.FAILED), "bad")
    tones |= dict.fromkeys((OutcomeKind.RESTS_ELSEWHERE, OutcomeKind.UNSTABLE), "warning")
    return "good" if outcome.is_good else tones.get(outcome.kind, "")


def ended_early(run: Run) -> str:
    """Return how and when a run ended early; "" for one that did not."""
    status = run.result.status
    end = number(run.summary.end_time)
    return "" if status == RunStatus.COMPLETED else f"{status} at {end} s"


class Margin(NamedTuple):
    """v(0) and the level of a certified region, J, both from the same rest state."""

    start: float
    level: float

    @property
    def ratio(self) -> float:
        """v(0)/c*: below 1, the start is inside; above 1 nothing follows."""
        return self.start / self.level


NO_MARGIN = Margin(math.nan, math.nan)


def margin_of(run: Run) -> Margin:
    """Return v(0) and the level with which it is compared; NaN if no finite level is proved.

    It is the region that contains the start, or that proves convergence (perhaps that of all θ1 and
    θ3), or else that of the lowest rest state. Where every start converges there is no level.
    """
    region, found = run.answers.region, run.answers.convergence
    level = found.bound if found is not None and found.proved else None
    if level is None or (region is not None and region.inside):
        margin = NO_MARGIN if region is None else Margin(region.start, region.level)
    elif region is not None and found is not None and found.rest_state == 1:
        margin = Margin(region.start, level)
    # The stored v counts from the rest state below the end of the motion, if it says so.
    elif is_below_end(run.attribute("lyapunov_zero")):
        margin = Margin(run.summary.lyapunov_start, level)
    else:
        margin = NO_MARGIN
    return margin if 0.0 < margin.level < math.inf and math.isfinite(margin.start) else NO_MARGIN


def _other_start(run: Run) -> float:
    """Return v(0) as it is compared with c*; NaN if it is that of the run."""
    start = margin_of(run).start
    same = math.isclose(start, run.summary.lyapunov_start, rel_tol=SAME_START)
    return math.nan if same else start


def _tilt(run: Run) -> Entry:
    tilt = run.answer.outcome.tilt
    if tilt is None:
        return math.nan
    return Cell(number(round(math.degrees(tilt), 3), 3), math.degrees(tilt))


def _at_rest_from(run: Run) -> Cell:
    return Cell(at_rest_from(run.result) or NO_VALUE, run.settling_time)


def _last_v(run: Run) -> Cell:
    """Return v at the end, with the name of what stands in its place on s = F + κE."""
    v = run.summary.lyapunov_end
    return Cell(f"{number(v)}{' (v - ε)' if run.stores_v_minus_work else ''}", v)


def _largest_v(run: Run) -> Entry:
    """Return the largest v of a run that inputs drive, with its time."""
    v = np.asarray(lyapunov_function_of(run.result), dtype=float)
    if not run.is_driven or not np.any(np.isfinite(v)):
        return math.nan
    place = int(np.nanargmax(v))
    largest, time = float(v[place]), float(run.result["time"][place])
    return Cell(f"{number(largest)} J at {number(time)} s", largest)


def _peak(value: float, *, resolved: bool) -> Cell:
    """Return a peak, with ≥ if it may be larger between the samples."""
    return Cell(at_least(resolved or math.isnan(value)) + number(value), value)


def _peak_by_axis(axis: int) -> Fact:
    return Fact(f"peak E{axis + 1}", "m", lambda run: run.summary.peak_contact_displacement[axis])


def _status(run: Run) -> Cell:
    early = ended_early(run)
    return Cell(early or run.result.status, tone="bad" if early else "")


def _rest_states(run: Run) -> Cell:
    proof = run.proof
    if proof is None:
        return Cell(NO_VALUE)
    count = len(proof.states)
    tone = "warning" if proof.globally_stable is False else ""
    found = "" if proof.proved else " found"
    kinds = f": {kinds_of(proof.states)}" if count > 1 else ""
    return Cell(f"{count}{found}{kinds}", float(count), tone)


def _in_region(run: Run) -> str:
    region = run.answers.region
    return NO_VALUE if region is None else "yes" if region.inside else "no"


def _checks(run: Run) -> Cell:
    verdict = run.attribute("verdict")
    return Cell(word_of(verdict) or NO_VALUE, tone=TONES.get(verdict, ""), target="certificates")


def _outcome(run: Run) -> Cell:
    outcome = run.answer.outcome
    return Cell(outcome.kind.words, tone=outcome_tone(outcome))


FACTS = {
    fact.name: fact
    for fact in (
        Fact("run", "", lambda run: run.label),
        Fact("outcome", "", _outcome),
        Fact(
            "tilt",
            "°",
            _tilt,
            "the angle from the desired attitude to that at which it rests, or at its end",
        ),
        Fact("this start", "", lambda run: answer_cell(run.answer.this_start, "certificates")),
        Fact("whole range", "", lambda run: answer_cell(run.answer.whole_range, "certificates")),
        Fact(
            "at rest from",
            "s",
            _at_rest_from,
            f"{SETTLED} from then on; where inputs supply power, {SETTLED_DRIVEN}. "
            f"{STARTS_AT_REST}. ≤: the samples do not show it better",
        ),
        Fact(
            "v(0)",
            "J",
            lambda run: run.summary.lyapunov_start,
            "the Lyapunov function v at the start; v is an energy that damping takes away, zero at "
            "the rest state below the end of the motion. On a surface s = F + κE, v - ε stands in "
            "its place: ε is the work of the contact force",
        ),
        Fact("v(end)", "J", _last_v),
        Fact("largest v", "", _largest_v),
        Fact(
            "start above the rest state of c*",
            "J",
            _other_start,
            "v(0) as it is compared with c*",
        ),
        Fact(
            "v(0)/c*",
            "",
            lambda run: margin_of(run).ratio,
            "c* is a level of v below which every motion is proved to converge; here both count "
            "from the rest state of that proof. Below 1 the start has the proof, above 1 nothing "
            "follows",
        ),
        Fact(
            "peak |E|",
            "m",
            lambda run: _peak(
                run.summary.peak_distance, resolved=run.summary.displacement_resolved
            ),
            "E is the displacement of the contact point from its anchor. ≥: between the samples "
            "the peak may be larger",
        ),
        *map(_peak_by_axis, range(3)),
        Fact(
            "peak |θ2|",
            "rad",
            lambda run: _peak(run.summary.largest_pitch, resolved=run.summary.pitch_resolved),
            "θ2 is the second Euler angle. The range is |θ2| < π/2 rad, and |θ1| and |θ3| < π",
        ),
        Fact(
            f"|r|/{ENERGY_SCALE}",
            "",
            lambda run: Cell(
                number(run.summary.relative_residual, 2), run.summary.relative_residual
            ),
            "the largest energy residual r = v(t) - v(0) - ∫v' dt, which is the error of the "
            "computation",
        ),
        Fact("status", "", _status),
        Fact("rest states", "", _rest_states),
        Fact("in certified region", "", _in_region),
        Fact("variant", "", lambda run: run.attribute("variant") or NO_VALUE),
        Fact("checks", "", _checks),
    )
}
"""The facts about a run by their names."""
