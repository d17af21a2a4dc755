"""What is known of a run, and the table of its numbers: each with name, unit, getter and words.

Tables, cards and comparisons choose numbers from `FACTS` by their names.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.analysis.certificate.verdict import Check
from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.experiment.answers.run_answer import (
    SAME_START,
    SETTLED,
    SETTLED_DRIVEN,
    STARTS_AT_REST,
    RunAnswer,
)
from rbstab.experiment.convergence.convergence import Convergence
from rbstab.experiment.convergence.zero_description import is_below_end
from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.summary import (
    ReferenceValue,
    at_least,
    at_rest_from,
    lyapunov_function_of,
    reference_values_of,
)
from rbstab.report.model.document import Cell, Head
from rbstab.report.model.words import number
from rbstab.report.reading.answers import RegionCheck, answers_of
from rbstab.report.reading.sources import Run


@dataclass(frozen=True, eq=False)
class RunFacts:
    """A run with its certificate, proof and comparisons.

    Args:
        run: The run.
        lines: The checks of its certificate, also those that a later proof decides.
        proof: The stored proof for its body, gravity and controller; None without one.
        region: The check of the certified region; None if there is none.
        convergence: What is proved of the exact motion; None for an older result.
        answer: What is known about stability, and how surely.
        comparisons: Printed values of the config's `reference`, each with the computed one.
    """

    run: Run
    lines: tuple[Check, ...]
    proof: Proof | None
    region: RegionCheck | None
    convergence: Convergence | None
    answer: RunAnswer
    comparisons: tuple[ReferenceValue, ...]

    def attribute(self, name: str) -> str:
        """Return an attribute of the result as text; "" if it is missing."""
        return str(self.run.result.attributes.get(name, ""))


def facts_of(runs: Sequence[Run]) -> tuple[RunFacts, ...]:
    """Return the facts of runs, in their order."""
    return tuple(map(_facts, runs))


def _facts(run: Run) -> RunFacts:
    result, config = run.result, run.config
    proof = None if config is None else cached_proof(run.path.parent, config)
    reference = config.reference if config is not None else None
    known = run.known_answers or answers_of(result, config, proof)
    return RunFacts(
        run=run,
        lines=known.lines,
        proof=proof,
        region=known.region,
        convergence=known.convergence,
        answer=known.answer,
        comparisons=tuple(
            reference_values_of(result, reference, run.summary) if reference is not None else ()
        ),
    )


class Fact(NamedTuple):
    """A number of a run.

    Attributes:
        name: Its name in tables and on cards.
        unit: Its unit; "" for a pure number.
        value: Gets it; NaN if the run has none.
        words: What it means; "" if its name says it.
        text: Gets its text without unit, where that is not just the number.
        digits: Its significant digits.
    """

    name: str
    unit: str
    value: Callable[[RunFacts], float]
    words: str = ""
    text: Callable[[RunFacts], str] | None = None
    digits: int = 4

    @property
    def head(self) -> Head:
        """The head of its column."""
        return Head(self.name, self.unit, numbers=True)

    def cell(self, facts: RunFacts) -> Cell:
        """Return its entry in a table."""
        value = self.value(facts)
        known = self.text is not None and not math.isnan(value)
        text = self.text(facts) if self.text is not None and known else number(value, self.digits)
        return Cell(text, value)

    def shown(self, facts: RunFacts) -> str:
        """Return it with its unit; "" if the run has none."""
        cell = self.cell(facts)
        if cell.value is None or math.isnan(cell.value):
            return ""
        degrees = f" ({math.degrees(cell.value):.4g}°)" if self.unit == "rad" else ""
        return f"{cell.text} {self.unit}".strip() + degrees


class Margin(NamedTuple):
    """v(0) and the level of a certified region, J, both from the same rest state."""

    start: float
    level: float

    @property
    def ratio(self) -> float:
        """v(0)/c*: below 1, the start is inside; above 1 nothing follows."""
        return self.start / self.level


def margin_of(facts: RunFacts) -> Margin | None:
    """Return v(0) and the level with which it is compared; None if no finite level is proved.

    It is the region that contains the start, or that proves convergence (perhaps that of all θ1 and
    θ3), or else that of the lowest rest state. Where every start converges there is no level.
    """
    region, found = facts.region, facts.convergence
    if region is not None and region.inside:
        return _margin(region.start, region.level)
    if found is None or not found.proved or found.bound is None:
        return None if region is None else _margin(region.start, region.level)
    if region is not None and found.rest_state == 1:
        return _margin(region.start, found.bound)
    # The stored v counts from the rest state below the end of the motion, if it says so.
    if not is_below_end(facts.attribute("lyapunov_zero")):
        return None
    return _margin(facts.run.summary.lyapunov_start, found.bound)


def _margin(start: float, level: float) -> Margin | None:
    return Margin(start, level) if 0.0 < level < math.inf and math.isfinite(start) else None


def _ratio(facts: RunFacts) -> float:
    margin = margin_of(facts)
    return math.nan if margin is None else margin.ratio


def _other_start(facts: RunFacts) -> float:
    """Return v(0) as it is compared with c*; NaN if it is that of the run."""
    margin = margin_of(facts)
    own = facts.run.summary.lyapunov_start
    if margin is None or math.isclose(margin.start, own, rel_tol=SAME_START):
        return math.nan
    return margin.start


def _largest_v(facts: RunFacts) -> tuple[float, float]:
    """Return the largest v of a run that inputs drive, J, and its time, s; NaN of another run."""
    v = np.asarray(lyapunov_function_of(facts.run.result), dtype=float)
    if not facts.run.is_driven or not np.any(np.isfinite(v)):
        return math.nan, math.nan
    place = int(np.nanargmax(v))
    return float(v[place]), float(facts.run.result["time"][place])


def _last_v(facts: RunFacts) -> str:
    """Return v at the end as text, with the name of what stands in its place on s = F + κE."""
    work = " (v - ε)" if facts.run.stores_v_minus_work else ""
    return f"{number(facts.run.summary.lyapunov_end)}{work}"


def _tilt(facts: RunFacts) -> float:
    tilt = facts.answer.outcome.tilt
    return math.nan if tilt is None else math.degrees(tilt)


def _peak_by_axis(axis: int) -> Fact:
    return Fact(f"peak E{axis + 1}", "m", lambda f: f.run.summary.peak_contact_displacement[axis])


FACTS = {
    fact.name: fact
    for fact in (
        Fact(
            "tilt",
            "°",
            _tilt,
            "the angle from the desired attitude to that at which it rests, or at its end",
            text=lambda f: number(round(_tilt(f), 3), 3),
        ),
        Fact(
            "at rest from",
            "s",
            lambda f: f.run.settling_time,
            f"{SETTLED} from then on; where inputs supply power, {SETTLED_DRIVEN}. "
            f"{STARTS_AT_REST}. ≤: the samples do not show it better",
            text=lambda f: at_rest_from(f.run.result),
        ),
        Fact(
            "v(0)",
            "J",
            lambda f: f.run.summary.lyapunov_start,
            "the Lyapunov function v at the start; v is an energy that damping takes away, zero at "
            "the rest state below the end of the motion. On a surface s = F + κE, v - ε stands in "
            "its place: ε is the work of the contact force",
        ),
        Fact(
            "v(end)",
            "J",
            lambda f: f.run.summary.lyapunov_end,
            text=_last_v,
        ),
        Fact(
            "largest v",
            "",
            lambda f: _largest_v(f)[0],
            text=lambda f: "{} J at {} s".format(*map(number, _largest_v(f))),
        ),
        Fact(
            "start above the rest state of c*",
            "J",
            _other_start,
            "v(0) as it is compared with c*",
        ),
        Fact(
            "v(0)/c*",
            "",
            _ratio,
            "c* is a level of v below which every motion is proved to converge; here both count "
            "from the rest state of that proof. Below 1 the start has the proof, above 1 nothing "
            "follows",
        ),
        Fact(
            "peak |E|",
            "m",
            lambda f: f.run.summary.peak_distance,
            "E is the displacement of the contact point from its anchor. ≥: between the samples "
            "the peak may be larger",
            text=lambda f: (
                at_least(f.run.summary.displacement_resolved) + number(f.run.summary.peak_distance)
            ),
        ),
        *map(_peak_by_axis, range(3)),
        Fact(
            "peak |θ2|",
            "rad",
            lambda f: f.run.summary.largest_pitch,
            "θ2 is the second Euler angle. The range is |θ2| < π/2 rad, and |θ1| and |θ3| < π",
            text=lambda f: (
                at_least(f.run.summary.pitch_resolved) + number(f.run.summary.largest_pitch)
            ),
        ),
        Fact(
            f"|r|/{ENERGY_SCALE}",
            "",
            lambda f: f.run.summary.relative_residual,
            "the largest energy residual r = v(t) - v(0) - ∫v' dt, which is the error of the "
            "computation",
            digits=2,
        ),
    )
}
"""The numbers of a run by their names."""
