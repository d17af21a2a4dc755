"""The answer of a run: does this start come to rest, and every motion that stays in the range?"""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.analysis.settling import SETTLED_FRACTION
from rbstab.config.schema import Config
from rbstab.experiment.answers.check_words import comparison
from rbstab.experiment.answers.outcome import Outcome, OutcomeKind, outcome_of, pushes_of
from rbstab.experiment.answers.rounded import rounded_down, rounded_up
from rbstab.experiment.answers.state_words import (
    ALMOST,
    almost_sentence,
    angles,
    counted_states,
    counterexample,
    every_motion,
    exceptions,
    unproved_stable,
)
from rbstab.experiment.answers.words import Sureness
from rbstab.experiment.convergence.convergence import (
    ASK_FOR_PROOF,
    EVERY_START,
    NO_PROOF,
    Convergence,
    Undecided,
    stored_convergence,
    undecided,
)
from rbstab.experiment.convergence.zero_description import NOT_LOWEST, OUTSIDE, is_below_end
from rbstab.experiment.run_certificate import (
    CERTIFIED_REGION,
    GLOBAL_STABILITY,
    LEAST_REST_STATES,
)
from rbstab.experiment.stored_run import certificate_lines
from rbstab.experiment.summary import at_rest_from, lyapunov_function_of, moves_on_in
from rbstab.integrate.status import RunStatus
from rbstab.store.result import Result

if TYPE_CHECKING:
    from rbstab.experiment.disturbed.bound import Bound
    from rbstab.experiment.stored_proof.proof import Proof

SAME_START = 1e-6
"""Two values of v(0) with a smaller relative difference count from the same rest state."""

UPRIGHT = 1e-3
"""rad: a body whose angles at rest are smaller rests upright, and needs no numbers."""

NO_BOUND = f"no proof of the stated bound is stored; {ASK_FOR_PROOF} tries to make it"

FALL = 1e-9
"""v has fallen if it did by more than this, relative to its largest value."""

SETTLED = f"v stays below v(0)/{1 / SETTLED_FRACTION:g}"
"""What "at rest" means for a computed run."""

SETTLED_DRIVEN = f"v stays below {SETTLED_FRACTION:g} of its largest value"
"""The same where elements supply power: v(0) may be zero."""


NO_REGION_THERE = (
    "no region surrounds an unstable rest state, so more steps help only if the motion leaves it"
)
"""What a proof can say of a motion that is computed to rest at an unstable rest state."""

STARTS_AT_REST = "0: it starts at rest, and v stays at round-off"
"""What a settling time of 0 means: v(0) may be zero."""


class Answer(NamedTuple):
    """An answer: how sure it is, and a sentence without a full stop.

    Attributes:
        sureness: How sure it is.
        sentence: The sentence.
        scope: Of which starts it is, if not of all of which it was asked.
    """

    sureness: Sureness
    sentence: str
    scope: str = ""

    @property
    def word(self) -> str:
        """How sure it is, with the scope."""
        return f"{self.scope}: {self.sureness}" if self.scope else str(self.sureness)

    def __str__(self) -> str:
        return f"{self.sureness}: {self.sentence}"


class RunAnswer(NamedTuple):
    """The answers of a run.

    Attributes:
        outcome: Where the body rests, and how far from where it should.
        this_start: Whether the motion from this start comes to rest.
        whole_range: Where all motions that stay in the range end, or almost all.
        pushes: Which pushes are proved to return; None if no level is proved.
        bound: Whether the disturbances that the config states never tilt the body far; None if it
            states none.
    """

    outcome: Outcome
    this_start: Answer
    whole_range: Answer
    pushes: Answer | None
    bound: Answer | None = None

    @property
    def answers(self) -> dict[str, Answer]:
        """The answers that are sentences, by their questions."""
        named = {"this_start": self.this_start, "whole_range": self.whole_range}
        others = {"pushes": self.pushes, "bound": self.bound}
        return named | {name: answer for name, answer in others.items() if answer is not None}

    def naming(self, command: str) -> "RunAnswer":
        """Return the same answers with another name of the command that makes a proof.

        Args:
            command: The command in place of `ASK_FOR_PROOF`, where it can be named better.
        """

        def renamed(answer: Answer) -> Answer:
            return answer._replace(sentence=answer.sentence.replace(ASK_FOR_PROOF, command))

        return self._replace(
            this_start=renamed(self.this_start),
            whole_range=renamed(self.whole_range),
            bound=None if self.bound is None else renamed(self.bound),
        )


def answer_of(
    result: Result,
    config: Config | None = None,
    proof: "Proof | None" = None,
    bound: "Bound | None" = None,
) -> RunAnswer:
    """Return the answers of a run.

    Args:
        result: The result; what is proved of it stands in its certificate and its attributes.
        config: Its config, which may say at which attitude the body is to rest.
        proof: The proof of its rest states; if it is given, counterexamples have their numbers.
        bound: What is proved of the disturbances that its config states.
    """
    pushes = pushes_of(config, proof)
    lines = {line.check: line for line in certificate_lines(result)}
    convergence = stored_convergence(result.attributes) or undecided(Undecided.NO_REGION, NO_PROOF)
    outcome = outcome_of(result, config, proof)
    if outcome.kind is OutcomeKind.UNSTABLE and convergence.proved is None and convergence.steps:
        convergence = replace(convergence, why=f"{convergence.why}; {NO_REGION_THERE}")
    return RunAnswer(
        outcome,
        _this_start(result, convergence, lines),
        _whole_range(result, convergence, lines.get(GLOBAL_STABILITY), proof),
        Answer(Sureness.PROVED, pushes) if pushes else None,
        _of_bound(config, bound),
    )


def _of_bound(config: Config | None, bound: "Bound | None") -> Answer | None:
    if bound is not None and bound.proved:
        return Answer(Sureness.PROVED, f"{bound.claimed}; {bound.about_start}")
    if bound is not None:
        return Answer(Sureness.NOT_DECIDED, f"{bound.claimed}: {bound.why}")
    is_stated = config is not None and config.bound is not None
    return Answer(Sureness.NOT_DECIDED, NO_BOUND) if is_stated else None


def _this_start(result: Result, convergence: Convergence, lines: dict[str, Check]) -> Answer:
    if convergence.proved is False:
        return Answer(Sureness.FALSE, f"the exact motion never comes to rest: {convergence.why}")
    if convergence.proved:
        which = _reached_state(result, convergence, lines.get(GLOBAL_STABILITY))
        sentence = f"the exact motion converges to {which}{_how_proved(convergence)}"
        return Answer(Sureness.PROVED, sentence)
    seen, region, margin = _seen(result, lines), lines.get(CERTIFIED_REGION), ""
    if region is not None and region.bound > 0 and region.value >= region.bound:
        level = rounded_down(region.bound, 4)
        margin = (
            f"the start is {region.value:.4g} J above the lowest rest state, not below c* = {level}"
            f" J, the level of the certified region; "
        )
    return Answer(seen.sureness, f"{seen.sentence}. Not proved: {margin}{convergence.why}")


def _reached_state(result: Result, convergence: Convergence, line: Check | None) -> str:
    """Return which rest state the exact motion reaches, and of how many if that is known."""
    state = f"rest state {convergence.rest_state}"
    decided = line is not None and line.verdict in {Verdict.CERTIFIED, Verdict.VIOLATED}
    if line is None or not decided or line.value <= 0 or line.quantity == LEAST_REST_STATES:
        return state
    if line.value == 1:
        return f"the only rest state in the range{_leaning(result)}"
    return f"{state} of {int(line.value)}"


def _how_proved(convergence: Convergence) -> str:
    if convergence.bound == math.inf:
        return f", as from {EVERY_START.split(' conv')[0]}"
    if not convergence.time:
        return f": it starts inside {convergence.region}"
    return f": it is inside {convergence.region} from t = {rounded_up(convergence.time)} s on"


def _leaning(result: Result) -> str:
    """Return at which angles the body rests where v is zero, if it is not upright there."""
    text = str(result.attributes.get("lyapunov_zero"))
    Theta = result["rest_orientation"]
    leans = is_below_end(text) and OUTSIDE not in text and bool((abs(Theta) >= UPRIGHT).any())
    return f", Θ = {angles(Theta)} rad" if leans else ""


def _from(settled: str) -> str:
    """Return a settling time, from `at_rest_from`, in a sentence."""
    return f"from t {settled if settled.startswith('≤') else f'= {settled}'} s on"


def _fall_of(result: Result) -> str:
    """Return what v did along a run that is not at rest."""
    v = lyapunov_function_of(result)
    begin, last, largest = float(v[0]), float(v[-1]), float(abs(v).max())
    end = float(result["time"][-1])
    did = f"{'fell' if last < begin else 'rose'} from {begin:.4g} J to {last:.4g} J"
    if abs(begin - last) <= FALL * largest or f"{begin:.4g}" == f"{last:.4g}":
        did = f"stays at {last:.4g} J"
    text = f"the Lyapunov function v {did} along the computed run"
    if last < 0:
        text += ", below that of the rest state from which v counts"
    if moves_on_in(result):
        return f"{text}; the body moves on without damping at t = {end:.4g} s"
    return f"{text}; it is not at rest by t = {end:.4g} s"


def _seen(result: Result, lines: dict[str, Check]) -> Answer:
    """Return what was seen of the computed motion: only one at rest was seen to come to rest."""
    status, end = result.status, float(result["time"][-1])
    settled = at_rest_from(result)
    of_proofs = {GLOBAL_STABILITY, CERTIFIED_REGION}
    failed = [
        line
        for line in lines.values()
        if line.verdict == Verdict.VIOLATED and line.check not in of_proofs
    ]
    if failed:
        line = failed[0]
        what = f"the check {line.check} of the computed run failed"
        if line.check == "damping":
            what = "the stored energy v is no Lyapunov function of this run"
        why = f"{what}: {line.quantity}: {comparison(line)}"
    elif status == RunStatus.RANGE_LEFT:
        why = f"the computed motion left the range of θ2 at t = {end:.4g} s"
    elif status != RunStatus.COMPLETED:
        why = f"the run ended early: {status} at t = {end:.4g} s"
    elif result.attributes.get("verdict") == Verdict.DRIVEN:
        stays = SETTLED_DRIVEN.replace("stays", "does not stay")
        if settled:
            stays = f"{SETTLED_DRIVEN} {_from(settled)}"
        why = f"elements drive the computed motion to t = {end:.4g} s; {stays}"
    elif not settled:
        why = _fall_of(result)
    else:
        text = f"the computed motion is at rest {_from(settled)} ({SETTLED})"
        if settled == "0":
            text = "the computed motion starts at rest, and stays there (v stays at round-off)"
        if str(result.attributes.get("lyapunov_zero")).endswith(NOT_LOWEST):
            text += ", at a rest state that is not the lowest one known"
        return Answer(Sureness.SEEN, text)
    return Answer(Sureness.NOT_DECIDED, why)


def _whole_range(
    result: Result, convergence: Convergence, line: Check | None, proof: "Proof | None"
) -> Answer:
    if result.attributes.get("verdict") == Verdict.DRIVEN:
        why = "elements supply power: nothing is proved of such motions"
        return Answer(Sureness.NOT_DECIDED, why)
    verdict = Verdict.UNKNOWN if line is None else line.verdict
    if line is None or (verdict == Verdict.UNKNOWN and math.isnan(line.value)):
        return Answer(Sureness.NOT_DECIDED, NO_PROOF if proof is None else proof.ended)
    almost = None if proof is None else proof.almost_every_start
    if verdict == Verdict.CERTIFIED:
        every = EVERY_START if convergence.bound == math.inf else every_motion(proof)
        return Answer(Sureness.PROVED, every, "" if almost is None else almost.outcome)
    if verdict != Verdict.VIOLATED:
        ended = "" if proof is None else f" ({proof.ended})"
        states = counted_states(int(line.value))
        why = f"a search found {states}, and it is not proved that there are no others{ended}"
        return Answer(Sureness.NOT_DECIDED, why)
    if proof is not None and almost is not None and almost.proved:
        sentence = f"{almost_sentence(proof, almost)}; {exceptions(proof)}"
        return Answer(Sureness.PROVED, sentence, f"{ALMOST} {almost.outcome}".rstrip())
    return Answer(Sureness.FALSE, _counterexample(line, proof, convergence.rest_state))


def _counterexample(line: Check, proof: "Proof | None", rest_state: int | None) -> str:
    """Return why not all motions end in one rest state; `rest_state` is that of this start."""
    count = int(line.value)
    if count == 0:
        return "no motion that stays in the range comes to rest: it has no rest state"
    if count == 1:
        return "the only rest state in the range is not stable"
    rests, more, place = "", "", "in the range"
    least = "at least " if line.quantity == LEAST_REST_STATES else ""
    if proof is not None:
        other, stable = counterexample(proof, rest_state), unproved_stable(proof, rest_state)
        rests = "" if other is None else f"the body can also rest at {other}; "
        rests += "" if stable is None else f"a search also found {stable}; "
        more = f"; a search found {len(proof.states)}" if least else ""
        place = proof.place
    _, colon, kinds = line.quantity.partition(": ")
    return f"{rests}it has {least}{counted_states(count)} {place}{colon}{kinds}{more}"
