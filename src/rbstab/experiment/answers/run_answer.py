"""The answer of a run: does this start come to rest, and every motion that stays in the range?"""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.analysis.settling import SETTLED_FRACTION
from rbstab.config.schema import Config
from rbstab.experiment.answers.check_words import comparison
from rbstab.experiment.answers.rounded import rounded_down, rounded_up
from rbstab.experiment.answers.words import Sureness
from rbstab.experiment.convergence.convergence import (
    ASK_FOR_PROOF,
    EVERY_START,
    Convergence,
    Enclose,
    stored_convergence,
)
from rbstab.experiment.convergence.zero_description import A_LOWER_ONE, is_approached
from rbstab.experiment.outcome import Outcome, outcome_of, pushes_of
from rbstab.experiment.run_certificate import (
    CERTIFIED_REGION,
    GLOBAL_STABILITY,
    LEAST_REST_STATES,
)
from rbstab.experiment.stored_certificate import CertificateLine, certificate_lines
from rbstab.experiment.summary import lyapunov_function_of, moves_on_in, settling_time_of
from rbstab.integrate.status import RunStatus
from rbstab.store.result import Result

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof

SAME_START = 1e-6
"""Two values of v(0) with a smaller relative difference count from the same rest state."""

UPRIGHT = 1e-3
"""rad: a body whose angles at rest are smaller rests upright, and needs no numbers."""

ROUND_OFF = 1e-9
"""rad: a smaller angle is printed as zero."""

SETTLED = f"v stays below v(0)/{1 / SETTLED_FRACTION:g}"
"""What "at rest" means for a computed run."""


class Answer(NamedTuple):
    """An answer: how sure it is, and a sentence without a full stop."""

    sureness: Sureness
    sentence: str

    def __str__(self) -> str:
        return f"{self.sureness}: {self.sentence}"


class RunAnswer(NamedTuple):
    """The answers of a run.

    Attributes:
        outcome: Where the body rests, and how far from where it should.
        this_start: Whether the motion from this start comes to rest.
        whole_range: Whether all motions that stay in the range end in one rest state.
        pushes: Which pushes are proved to return; None if no level is proved.
    """

    outcome: Outcome
    this_start: Answer
    whole_range: Answer
    pushes: Answer | None

    @property
    def answers(self) -> dict[str, Answer]:
        """The answers that are sentences, by their questions."""
        named = {"this_start": self.this_start, "whole_range": self.whole_range}
        return named | ({} if self.pushes is None else {"pushes": self.pushes})

    def naming(self, command: str) -> "RunAnswer":
        """Return the same answers with another name of the command that makes a proof.

        Args:
            command: The command in place of `ASK_FOR_PROOF`, where it can be named better.
        """

        def renamed(answer: Answer) -> Answer:
            return answer._replace(sentence=answer.sentence.replace(ASK_FOR_PROOF, command))

        return self._replace(
            this_start=renamed(self.this_start), whole_range=renamed(self.whole_range)
        )


def answer_of(
    result: Result, config: Config | None = None, proof: "Proof | None" = None
) -> RunAnswer:
    """Return the answers of a run.

    Args:
        result: The result; what is proved of it stands in its certificate and its attributes.
        config: Its config, which may say at which attitude the body is to rest.
        proof: The proof of its rest states; if it is given, counterexamples have their numbers.
    """
    pushes = pushes_of(config, proof)
    lines = {line.check: line for line in certificate_lines(result)}
    found = stored_convergence(result.attributes)
    return RunAnswer(
        outcome_of(result, config, proof),
        _this_start(result, found, lines),
        _whole_range(result, found, lines.get(GLOBAL_STABILITY), proof),
        Answer(Sureness.PROVED, pushes) if pushes else None,
    )


def answer_beside(
    result: Result,
    config: Config | None,
    proof: "Proof | None",
    checks: Sequence[Check] | None = None,
) -> RunAnswer:
    """Return the answers of a stored run, with a proof that may have been stored after it.

    Args:
        result: The result.
        config: Its config; None if this version cannot read it.
        proof: The proof that is stored in the same folder, if there is one.
        checks: The checks that the proof decides, if they are known: those of `proved_checks`.
    """
    # Imported late: it reads proofs.
    from rbstab.experiment.convergence.later_proof import with_later_proof

    return answer_of(with_later_proof(result, config, proof, checks), config, proof)


def _this_start(
    result: Result, found: Convergence | None, lines: dict[str, CertificateLine]
) -> Answer:
    if found is not None and found.proved is not None:
        if not found.proved:
            return Answer(Sureness.FALSE, f"the exact motion never comes to rest: {found.why}")
        return Answer(Sureness.PROVED, _proved(found, _rest_states(lines), _leaning(result)))
    if result.attributes.get("verdict") == Verdict.CERTIFIED:
        # So it is in results of before the attribute `convergence`.
        return Answer(Sureness.PROVED, "the exact motion comes to rest")
    seen = _seen(result, lines)
    start = float(lyapunov_function_of(result)[0])
    reason = _why_not_proved(found, lines.get(CERTIFIED_REGION), start)
    return Answer(seen.sureness, f"{seen.sentence}. Not proved: {reason}")


def _leaning(result: Result) -> str:
    """Return at which angles the body rests where v is zero, if it is not upright there."""
    if "rest_orientation" not in result or not is_approached(result):
        return ""
    Theta = result["rest_orientation"]
    leans = bool((abs(Theta) >= UPRIGHT).any())
    return f", Θ = {_angles(Theta)} rad" if leans else ""


def _proved(found: Convergence, count: int | None, leaning: str) -> str:
    which = f"rest state {found.rest_state} of {count}"
    if count == 1:
        which = f"the only rest state{leaning}"
    if count is None:
        which = f"rest state {found.rest_state}"
    if found.bound == math.inf:
        return f"the exact motion converges to {which}, as from {EVERY_START.split(' conv')[0]}"
    if found.energy is None or found.bound is None or not found.time:
        where = f"it starts inside {found.region}"
    else:
        where = f"it is inside {found.region} from t = {rounded_up(found.time)} s on"
    return f"the exact motion converges to {which}: {where}"


def _driven_settling(settled: float) -> str:
    """Return when v of a driven motion has settled, as text."""
    least = f"{SETTLED_FRACTION:g} of its largest value"
    if math.isnan(settled):
        return f"v does not stay below {least}"
    return f"v stays below {least} from t = {settled:.4g} s on"


def _seen(result: Result, lines: dict[str, CertificateLine]) -> Answer:
    """Return what was seen of the computed motion: only one at rest was seen to come to rest."""
    status, end = result.status, float(result["time"][-1])
    failed = [line for line in lines.values() if line.verdict == Verdict.VIOLATED]
    failed = [line for line in failed if line.check not in {GLOBAL_STABILITY, CERTIFIED_REGION}]
    settled = settling_time_of(result)
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
    elif not lines:
        why = "the result has no certificate"
    elif result.attributes.get("verdict") == Verdict.DRIVEN:
        why = f"inputs drive the computed motion to t = {end:.4g} s; {_driven_settling(settled)}"
    elif not math.isnan(settled):
        text = f"the computed motion is at rest from t = {settled:.4g} s on ({SETTLED})"
        if str(result.attributes.get("lyapunov_zero")).endswith(A_LOWER_ONE):
            text += ", at a rest state that is not the lowest one known"
        return Answer(Sureness.SEEN, text)
    else:
        v = lyapunov_function_of(result)
        begin, last = float(v[0]), float(v[-1])
        lower = ", below that of the rest state from which v counts" if last < 0 else ""
        still = f"; it is not at rest by t = {end:.4g} s"
        if moves_on_in(result):
            still = (
                f", where it no longer falls: the body moves on without damping at t = {end:.4g} s"
            )
        why = (
            f"the Lyapunov function v fell from {begin:.4g} J to {last:.4g} J along the computed "
            f"run{lower}{still}"
        )
    return Answer(Sureness.NOT_DECIDED, why)


def _why_not_proved(found: Convergence | None, region: CertificateLine | None, start: float) -> str:
    """Return why nothing is proved of a start, with v(0) as the run has it."""
    if found is None:
        return f"there is no proof; {ASK_FOR_PROOF} makes it"
    margin = ""
    if region is not None and region.bound > 0 and region.value >= region.bound:
        level = rounded_down(region.bound, 4)
        # The v of the run counts from the rest state that the motion approaches.
        same = math.isclose(region.value, start, rel_tol=SAME_START)
        counted = "" if same else ", counted from the lowest rest state,"
        margin = (
            f"v(0) = {region.value:.4g} J{counted} is not below c* = {level} J, the level of the "
            f"certified region; "
        )
        if found.enclosed is Enclose.NOTHING:
            return f"{margin}{ASK_FOR_PROOF} follows the exact motion"
    return f"{margin}{found.why}"


def _whole_range(
    result: Result,
    found: Convergence | None,
    line: CertificateLine | None,
    proof: "Proof | None",
) -> Answer:
    if result.attributes.get("verdict") == Verdict.DRIVEN:
        return Answer(
            Sureness.NOT_DECIDED, "inputs supply power: nothing is proved of such motions"
        )
    if line is None or (line.verdict == Verdict.UNKNOWN and math.isnan(line.value)):
        why = f"no proof of the rest states is stored; {ASK_FOR_PROOF} makes it"
        if proof is not None:
            why = proof.ended
        return Answer(Sureness.NOT_DECIDED, why)
    if line.verdict == Verdict.CERTIFIED:
        if found is not None and found.bound == math.inf:
            return Answer(Sureness.PROVED, EVERY_START)
        keeps = "that stays in the range, and away from θ2 = ±π/2,"
        if proof is not None and proof.kept_by:
            keeps = f"that stays in the range, which {proof.kept_by} keeps away from θ2 = ±π/2,"
            if proof.needs_lengths:
                keeps = f"{keeps} and away from springs without length,"
        elif proof is not None and proof.needs_lengths:
            keeps = "that stays in the range, away from θ2 = ±π/2 and from springs without length,"
        return Answer(Sureness.PROVED, f"every motion {keeps} converges to the only rest state")
    if line.verdict == Verdict.VIOLATED:
        own = None if found is None else found.rest_state
        return Answer(Sureness.FALSE, _counterexample(line, proof, own))
    count = int(line.value)
    found_states = f"{count or 'no'} rest state{'' if count == 1 else 's'}"
    reason = f" ({proof.ended})" if proof is not None else ""
    why = f"a search found {found_states}, and it is not proved that there are no others{reason}"
    return Answer(Sureness.NOT_DECIDED, why)


def _counterexample(line: CertificateLine, proof: "Proof | None", own: int | None) -> str:
    """Return why not all motions end in one rest state; `own` is the one of this start."""
    count = int(line.value)
    if count == 0:
        return "no motion that stays in the range comes to rest: it has no rest state"
    if count == 1:
        return "the only rest state is not stable"
    states = [] if proof is None else list(proof.states)
    # The second lowest, unless this start ends there: then the lowest.
    states = states[:1] if own == 2 else states[1:]
    others = [state for state in states if state.proved]
    where = f" at Θ = {_angles(others[0].orientation)} rad" if others else " elsewhere"
    least, found = "", ""
    if line.quantity == LEAST_REST_STATES:
        least = "at least "
        found = "" if proof is None else f"; a search found {len(proof.states)}"
    return f"the body can also rest{where}; it has {least}{count} rest states in the range{found}"


def _angles(Theta: Iterable[float]) -> str:
    # Round-off is no angle, and zero has no sign.
    rounded = (0.0 if abs(angle) < ROUND_OFF else angle for angle in Theta)
    return "(" + ", ".join(f"{angle:.4g}" for angle in rounded) + ")"


def _rest_states(lines: dict[str, CertificateLine]) -> int | None:
    """Return the number of rest states in the range, if it is known."""
    line = lines.get(GLOBAL_STABILITY)
    if line is None or line.quantity == LEAST_REST_STATES:
        return None
    known = line.verdict in {Verdict.CERTIFIED, Verdict.VIOLATED}
    return int(line.value) if known and line.value > 0 else None
