"""What is said of a run in a word or a number: each fact once, with its name, unit and meaning.

Commands, reports and comparisons choose facts from `FACTS` by their names.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from rbstab.analysis.certificate.verdict import Verdict
from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.experiment.answers.assessed_run import AssessedRun
from rbstab.experiment.answers.outcome import Outcome, OutcomeKind
from rbstab.experiment.answers.rounded import NO_VALUE, number
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
from rbstab.experiment.summary import (
    UNKNOWN_STEPS,
    at_least,
    at_rest_from,
    lyapunov_function_of,
)
from rbstab.integrate.status import RunStatus

T = TypeVar("T")

TONES = {Verdict.CERTIFIED.value: "good", Verdict.VIOLATED.value: "bad"}
"""Tones of verdicts; what held but is not proved, and what is not decided, is no alarm."""


class Shown(NamedTuple):
    """A fact as it is shown: a text, its number if it is one, and "good", "bad" or "warning"."""

    text: str
    value: float | None = None
    tone: str = ""

    @property
    def is_number(self) -> bool:
        """Whether its text says no more than its number, which is known."""
        return self.value is not None and self.text == number(self.value) != NO_VALUE


@dataclass(frozen=True)
class Fact(Generic[T]):
    """A fact about a run, or about the members of a sweep.

    Args:
        name: Its name in tables and on cards.
        unit: Its unit; "" for a pure number and for words.
        get: Gets it, as it is shown or as a text or a number; NaN if the run has none.
        words: What it means; "" if its name says it.
    """

    name: str
    unit: str
    get: Callable[[T], Shown | str | float]
    words: str = ""

    @property
    def head(self) -> str:
        """Its name with its unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def of(self, subject: T) -> Shown:
        """Return it as it is shown; numbers have four significant digits."""
        value = self.get(subject)
        if isinstance(value, Shown):
            return value
        return Shown(value) if isinstance(value, str) else Shown(number(value), float(value))

    def text(self, subject: T) -> str:
        """Return it with its unit; "" if it is no number, or none is known."""
        text, value, _ = self.of(subject)
        if value is None or math.isnan(value):
            return ""
        degrees = f" ({math.degrees(value):.4g}°)" if self.unit == "rad" else ""
        return f"{text} {self.unit}".strip() + degrees


def answer_tone(answer: Answer) -> str:
    """Return the tone of an answer; only the outcome of a body that rests where it should is good.

    It may be proved that a body rests elsewhere.
    """
    return "bad" if answer.sureness == Sureness.FALSE else ""


def _answer(answer: Answer) -> Shown:
    return Shown(answer.word, tone=answer_tone(answer))


def outcome_tone(outcome: Outcome) -> str:
    """Return the tone of an outcome; a body that still moves, or may leave, is no alarm."""
    tones = dict.fromkeys((OutcomeKind.LEFT_RANGE, OutcomeKind.FAILED), "bad")
    tones |= dict.fromkeys((OutcomeKind.RESTS_ELSEWHERE, OutcomeKind.UNSTABLE), "warning")
    return "good" if outcome.is_good else tones.get(outcome.kind, "")


def ended_early(run: AssessedRun) -> str:
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


def margin_of(run: AssessedRun) -> Margin:
    """Return v(0) and the level with which it is compared; NaN if no finite level is proved.

    It is the region that contains the start, or that proves convergence (perhaps that of all θ1 and
    θ3), or else that of the lowest rest state. Where every start converges there is no level.
    """
    region, convergence = run.region, run.convergence
    level = convergence.bound if convergence is not None and convergence.proved else None
    if level is None or (region is not None and region.inside):
        margin = NO_MARGIN if region is None else Margin(region.start, region.level)
    elif region is not None and convergence is not None and convergence.rest_state == 1:
        margin = Margin(region.start, level)
    # The stored v counts from the rest state below the end of the motion, if it says so.
    elif is_below_end(run.attribute("lyapunov_zero")):
        margin = Margin(run.summary.lyapunov_start, level)
    else:
        margin = NO_MARGIN
    return margin if 0.0 < margin.level < math.inf and math.isfinite(margin.start) else NO_MARGIN


def _other_start(run: AssessedRun) -> float:
    """Return v(0) as it is compared with c*; NaN if it is that of the run."""
    start = margin_of(run).start
    same = math.isclose(start, run.summary.lyapunov_start, rel_tol=SAME_START)
    return math.nan if same else start


def _tilt(run: AssessedRun) -> Shown | float:
    tilt = run.answer.outcome.tilt
    if tilt is None:
        return math.nan
    return Shown(number(round(math.degrees(tilt), 3), 3), math.degrees(tilt))


def _at_rest_from(run: AssessedRun) -> Shown:
    return Shown(at_rest_from(run.result) or NO_VALUE, run.settling_time)


def _largest_v(run: AssessedRun) -> Shown | float:
    """Return the largest v of a run that inputs drive, with its time."""
    v = np.asarray(lyapunov_function_of(run.result), dtype=float)
    if not run.is_driven or not np.any(np.isfinite(v)):
        return math.nan
    place = int(np.nanargmax(v))
    largest, time = float(v[place]), float(run.result["time"][place])
    return Shown(f"{number(largest)} J at {number(time)} s", largest)


def _peak(value: float, *, resolved: bool) -> Shown:
    """Return a peak, with ≥ if some steps are not known, in which it may be larger."""
    return Shown(at_least(resolved or math.isnan(value)) + number(value), value)


def _peak_by_axis(axis: int) -> Fact[AssessedRun]:
    def peak(run: AssessedRun) -> float:
        """A sample is no peak."""
        s = run.summary
        return s.peak_contact_displacement[axis] if s.displacement_resolved else math.nan

    return Fact(f"peak E{axis + 1}", "m", peak)


def _status(run: AssessedRun) -> Shown:
    early = ended_early(run)
    return Shown(early or run.result.status, tone="bad" if early else "")


def _rest_states(run: AssessedRun) -> Shown:
    proof = run.proof
    if proof is None:
        return Shown(NO_VALUE)
    count = len(proof.states)
    tone = "warning" if proof.globally_stable is False else ""
    suffix = "" if proof.proved else " found"
    kinds = f": {kinds_of(proof.states)}" if count > 1 else ""
    return Shown(f"{count}{suffix}{kinds}", float(count), tone)


def _in_region(run: AssessedRun) -> str:
    region = run.region
    return NO_VALUE if region is None else "yes" if region.inside else "no"


def _checks(run: AssessedRun) -> Shown:
    verdict = run.attribute("verdict")
    return Shown(word_of(verdict) or NO_VALUE, tone=TONES.get(verdict, ""))


def _outcome(run: AssessedRun) -> Shown:
    outcome = run.answer.outcome
    return Shown(outcome.brief, tone=outcome_tone(outcome))


_FACTS: tuple[Fact[AssessedRun], ...] = (
    Fact("outcome", "", _outcome),
    Fact(
        "tilt",
        "°",
        _tilt,
        "the angle from the desired attitude to that at which it rests, or at its end",
    ),
    Fact("this start", "", lambda run: _answer(run.answer.this_start)),
    Fact("whole range", "", lambda run: _answer(run.answer.whole_range)),
    Fact(
        "at rest from",
        "s",
        _at_rest_from,
        f"{SETTLED} from then on; where elements supply power, {SETTLED_DRIVEN}. "
        f"{STARTS_AT_REST}. ≤: not later, {UNKNOWN_STEPS}",
    ),
    Fact(
        "v(0)",
        "J",
        lambda run: run.summary.lyapunov_start,
        "the Lyapunov function v at the start; v is an energy that damping takes away, zero at "
        "the rest state below the end of the motion",
    ),
    Fact("v(end)", "J", lambda run: run.summary.lyapunov_end),
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
        lambda run: _peak(run.summary.peak_distance, resolved=run.summary.displacement_resolved),
        f"E is the displacement of the contact point from its anchor. ≥: {UNKNOWN_STEPS}, and the "
        "peak may be larger",
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
        lambda run: Shown(number(run.summary.relative_residual, 2), run.summary.relative_residual),
        "the largest energy residual r = v(t) - v(0) - ∫v' dt, which is the error of the "
        "computation",
    ),
    Fact("status", "", _status),
    Fact("rest states", "", _rest_states),
    Fact("in certified region", "", _in_region),
    Fact("time reached", "s", lambda run: run.summary.end_time),
    Fact("wall time", "s", lambda run: float(run.result.attributes["wall_time"])),
    Fact("run id", "", lambda run: run.result.run_id),
    Fact("variant", "", lambda run: run.attribute("variant") or NO_VALUE),
    Fact("checks", "", _checks),
)
FACTS = {fact.name: fact for fact in _FACTS}
"""The facts about a run by their names."""
