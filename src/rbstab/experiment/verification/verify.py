"""Verify a proof by the checker of `proof/check`, and compare it with a config."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of, system_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import may_build, without_code
from rbstab.experiment.proof import CODE_NOT_RUN, no_theorem
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import Proof

if TYPE_CHECKING:
    from rbstab.experiment.disturbed.stored import StoredBound
    from rbstab.proof.check.findings import Finding
    from rbstab.proof.model import Energy

CONFIG = "the config"

UNDECIDED = "second opinion"
"""The claim of what codac does not decide."""

SWITCHES = frozenset({"step", "positive"})
"""The operations of an energy that codac is not asked about."""

NOT_ASKED = "codac is asked about lists of rest states and certified regions only."

NO_CHECKER = "rotations"
"""The claim that is not checked: a list of rest states among all rotations."""


class Verification(NamedTuple):
    """The result of verifying a proof.

    Attributes:
        findings: The claims that were checked.
        unchecked: What was not checked, as sentences.
    """

    findings: "list[Finding]"
    unchecked: list[str]

    @property
    def verified(self) -> bool:
        """Whether all claims that were checked are verified."""
        return all(finding.verified for finding in self.findings)

    @property
    def takes_too_long(self) -> bool:
        """Whether no claim is refused, but the check ended before all were verified."""
        from rbstab.proof.check.findings import CONVEXITY, TIME, VERSION

        left = [finding.claim for finding in self.findings if not finding.verified]
        return bool(left) and {TIME, VERSION, CONVEXITY, NO_CHECKER, UNDECIDED}.issuperset(left)

    @property
    def outcome(self) -> str:
        """The result in words."""
        from rbstab.proof.check.findings import CONVEXITY, VERSION

        if self.verified:
            return "verified"
        if self.takes_too_long and any(finding.claim == VERSION for finding in self.findings):
            return "not decided: this checker does not know claims of this version"
        if any(finding.claim == NO_CHECKER for finding in self.findings):
            return "not decided: there is no checker of rest states among all rotations"
        if self.takes_too_long and any(finding.claim == UNDECIDED for finding in self.findings):
            return "not decided: codac does not decide every claim"
        if self.takes_too_long and self.findings[-1].claim == CONVEXITY:
            return "not decided: no rule shows that U is convex in what is not Θ"
        return "not decided: the check takes too long" if self.takes_too_long else "REFUSED"


def verify(
    proof: "Proof | StoredBound",
    config: Config | None = None,
    progress: "Callable[[Finding], None]" = lambda _: None,
    *,
    second: bool = False,
) -> Verification:
    """Check a proof, and whether it is one of a config.

    Args:
        proof: The proof of rest states, or of a bound on disturbances.
        config: The config; None to check the proof for its own energy U alone.
        progress: Called with each finding about the proof as soon as it is made.
        second: Whether to ask codac too, from the equations of the config.
    """
    from rbstab.proof.check.checker import check
    from rbstab.proof.check.findings import IN_RANGE, Finding

    if not isinstance(proof, Proof):
        from rbstab.experiment.verification.disturbances import verify_bound

        findings, unchecked = verify_bound(proof, config, progress)
        return Verification(findings, [*unchecked, *[NOT_ASKED] * second])
    if proof.on_rotations is not None:
        text = "No separate program checks it: `rbstab stability` can only make it again."
        return Verification([Finding("rest states on SO(3)", NO_CHECKER, False, text)], [])
    if not proof.has_energy:
        text = "The file has no reduced energy U. Make the proof again with `rbstab stability`."
        if proof.claims_nothing:
            text = f"There is no proof: {proof.outcome}."
        return Verification([Finding(IN_RANGE, "energy", False, text)], [])
    findings = check(proof.record, progress)
    if config is not None:
        findings = [*_config_findings(proof, config), *findings]
    unchecked = list(_unchecked(proof, config))
    if second and config is not None:
        for finding in second_opinion(proof, config):
            findings.append(finding)
            progress(finding)
        unchecked.append(NOT_ASKED)
    return Verification(findings, unchecked)


def _config_findings(proof: Proof, config: Config) -> "Iterator[Finding]":
    """Check that the proof is that of the config, and the hypotheses of its theorems."""
    from rbstab.proof.check.findings import Finding
    from rbstab.proof.passive.passive import why_not_in_proofs
    from rbstab.proof.reasons import NoEnergyReason
    from rbstab.proof.record import difference_from

    same_id = proof.id == proof_id(config)
    text = "The id of the proof is that of the config."
    if not same_id:
        text = "The id of the proof is not that of the config: it was made for another one."
    yield Finding(CONFIG, "id", same_id, text)
    if not may_build(config):
        return
    built = system_of(config)
    if built.supplies:
        text = f"The config has no reduced energy: {NoEnergyReason.SUPPLIES.value}."
        yield Finding(CONFIG, "energy", False, text)
        return
    not_passive, failing = why_not_in_proofs(built), no_theorem(config)
    text = "Mass, inertia and damping are positive definite."
    if not_passive is not None:
        text = f"No proof takes this code of a user into account: {not_passive}."
    elif failing is not None:
        text = f"{failing[:1].upper()}{failing[1:]}."
    yield Finding(CONFIG, "hypotheses", not_passive is None and failing is None, text)
    stored, energy = proof.reduced_energy, _energy_of(config)
    assert stored is not None
    other = energy if isinstance(energy, str) else difference_from(stored.model_dump(), energy)
    text = "The energy U of the proof is that of the config, as an exact expression."
    text = text if other is None else f"The energy U is not that of the config: {other}."
    yield Finding(CONFIG, "energy", other is None, text)


def _energy_of(config: Config) -> "Energy | str":
    """Return the energy of a config, traced from its equations; why there is none."""
    from rbstab.proof.reasons import NoReducedEnergy
    from rbstab.proof.rest_states import reduced_energy

    plain = partial(system_of, without_code(config))
    try:
        return reduced_energy(smooth_rest_system(problem_of(config)), plain)
    except NoReducedEnergy as error:
        return str(error)


def second_opinion(proof: Proof, config: Config) -> "Iterator[Finding]":
    """Yield what codac says of lists of rest states and certified regions, for a config.

    A claim that is not decided has the name `UNDECIDED`, and its own in its sentences.
    """
    from rbstab.experiment.verification.second.opinion import answers, question
    from rbstab.proof.check.findings import Finding
    from rbstab.proof.record import operations_of

    energy = _energy_of(config) if may_build(config) else CODE_NOT_RUN
    if not isinstance(energy, str):
        if energy.free:
            energy = "X, or own states, are left in its energy"
        elif not SWITCHES.isdisjoint(kind for kind, *_ in operations_of(energy.U)):
            energy = "its energy has terms that switch"
    if isinstance(energy, str):
        yield Finding("codac", UNDECIDED, False, f"It was not asked: {energy}.")
        return
    asked = question(proof.record["ranges"], energy, smooth_rest_system(problem_of(config)))
    for place, claim, verdict, text in answers(asked):
        decided = verdict != "not decided"
        said = text if decided else f"{claim.capitalize()}: {text}"
        yield Finding(f"codac: {place}", claim if decided else UNDECIDED, verdict == "proved", said)


def _unchecked(proof: Proof, config: Config | None) -> Iterator[str]:
    """Yield what was not checked, as sentences."""
    if config is not None and not may_build(config):
        yield (
            "The energy of the proof and the hypotheses of its theorems were not compared with "
            f"the config: {CODE_NOT_RUN}."
        )
    if config is None:
        yield "The energy U was not compared with a config; use --config CONFIG."
    wide = proof.unwrapped
    if not proof.proved:
        yield "The proof does not claim to list all rest states in the range of eq. 5."
    if wide is not None and not wide.proved:
        yield "The proof does not claim to list all rest states with any θ1 and θ3."
    yield "Values in doubles, which are not proved: Θ, X, own states, energies, levels and passes."
