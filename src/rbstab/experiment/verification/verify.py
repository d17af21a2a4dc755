"""Verify a proof by the checker of `analysis/proof_check`, and compare it with a config."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from rbstab.analysis.exact import decimals
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of, system_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code, may_run_code, without_code
from rbstab.experiment.answers.reasons import NOT_DAMPED
from rbstab.experiment.proof import CODE_NOT_RUN
from rbstab.experiment.stored_proof.identity import PROOF_VERSION, proof_id
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.written_energies import energy_of, tied_energy_of
from rbstab.experiment.verification.second.opinion import UNDECIDED, not_asked, second_opinion

if TYPE_CHECKING:
    from rbstab.analysis.proof.reduced_energy import ExactSystem
    from rbstab.analysis.proof_check.findings import Finding

CONFIG = "the config"

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
        from rbstab.analysis.proof_check.findings import TIME

        left = [finding.claim for finding in self.findings if not finding.verified]
        return bool(left) and all(claim in {TIME, NO_CHECKER, UNDECIDED} for claim in left)

    @property
    def outcome(self) -> str:
        """The result in words."""
        if self.verified:
            return "verified"
        if any(finding.claim == NO_CHECKER for finding in self.findings):
            return "not decided: there is no checker of rest states among all rotations"
        if self.takes_too_long and any(one.claim == UNDECIDED for one in self.findings):
            return "not decided: codac does not decide every claim"
        return "not decided: the check takes too long" if self.takes_too_long else "REFUSED"


def verify(
    proof: Proof,
    config: Config | None = None,
    progress: "Callable[[Finding], None]" = lambda _: None,
    *,
    second: bool = False,
) -> Verification:
    """Check a proof, and whether it is one of a config.

    Args:
        proof: The proof.
        config: The config; None to check the proof for its own energy U alone.
        progress: Called with each finding about the proof as soon as it is made.
        second: Whether to ask codac too, from the equations of the config.
    """
    from rbstab.analysis.proof_check.checker import check
    from rbstab.analysis.proof_check.findings import IN_RANGE, Finding
    from rbstab.analysis.proof_check.tied.checker import check_tied

    if proof.on_rotations is not None:
        text = "No separate program checks it: `rbstab stability` can only make it again."
        return Verification([Finding("rest states on SO(3)", NO_CHECKER, False, text)], [])
    if not proof.has_energy:
        text = "The file has no reduced energy U. Make the proof again with `rbstab stability`."
        if proof.claims_nothing:
            text = f"There is no proof: {proof.outcome}."
        return Verification([Finding(IN_RANGE, "energy", False, text)], [])
    checked_by = check if proof.reduced_energy else check_tied
    findings = checked_by(proof.model_dump(mode="json"), progress)
    if config is not None:
        findings = [*_config_findings(proof, config), *findings]
    unchecked = list(_unchecked(proof, config))
    if second and config is not None:
        for said in second_opinion(proof, config):
            findings.append(Finding(*said))
            progress(findings[-1])
        unchecked += not_asked(proof)
    return Verification(findings, unchecked)


def _config_findings(proof: Proof, config: Config) -> "Iterator[Finding]":
    """Check that the proof is that of the config, and the hypotheses of its theorems."""
    from rbstab.analysis.proof.definite import indefinite_parameter, why_not_damped
    from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy
    from rbstab.analysis.proof.traced.separate import damping_of_users
    from rbstab.analysis.proof_check.findings import Finding

    same_id = proof.id in {proof_id(config, version) for version in range(2, PROOF_VERSION + 1)}
    text = "The id of the proof is that of the config."
    if not same_id:
        text = "The id of the proof is not that of the config: it was made for another one."
    yield Finding(CONFIG, "id", same_id, text)
    if not _can_build(config):
        return
    built = system_of(config)
    if built.supplies:
        text = f"The config has no reduced energy: {NoEnergyReason.SUPPLIES.value}."
        yield Finding(CONFIG, "energy", False, text)
        return
    system = system_of(without_code(config), decimals)
    indefinite = indefinite_parameter(system)
    undamped = why_not_damped(system, damping_of_users(built))
    text = "Mass, inertia and damping are positive definite."
    if indefinite is not None:
        text = f"{indefinite} is not positive definite."
    elif undamped is not None:
        text = f"{NOT_DAMPED[:1].upper()}{NOT_DAMPED[1:]}: {undamped}."
    yield Finding(CONFIG, "hypotheses", indefinite is None and undamped is None, text)
    try:
        compare = _same_energy if proof.reduced_energy else _same_tied_energy
        same = compare(proof, config, partial(system_of, config))
    except NoReducedEnergy as error:
        yield Finding(CONFIG, "energy", False, f"The config has no reduced energy: {error}.")
        return
    name = "U" if proof.reduced_energy else "W"
    text = f"The energy {name} of the proof is that of the config: all its coefficients agree."
    if not same:
        text = f"The energy {name} of the proof is not that of the config."
    yield Finding(CONFIG, "energy", same, text)


def _can_build(config: Config) -> bool:
    """Return whether the equations of a config can be built: code of users may not run."""
    return may_run_code(config) or not has_code(config)


def _same_energy(proof: Proof, config: Config, exact: "ExactSystem") -> bool:
    """Return whether U of a proof is that of a config."""
    from rbstab.analysis.proof.reduced_energy import reduced_energy
    from rbstab.analysis.proof_check.equations import agrees_with_equations

    stored = proof.reduced_energy
    assert stored is not None
    plain = partial(system_of, without_code(config))
    found = reduced_energy(smooth_rest_system(problem_of(config)), plain).form
    same = energy_of(found).model_dump() == stored.model_dump()
    return same and agrees_with_equations(stored.model_dump(mode="json"), exact)


def _same_tied_energy(proof: Proof, config: Config, exact: "ExactSystem") -> bool:
    """Return whether W of a proof is that of a config."""
    from rbstab.analysis.proof.tied.energy import tied_energy
    from rbstab.analysis.proof_check.tied.equations import agrees_with_tied_equations

    stored = proof.tied_energy
    assert stored is not None
    plain = partial(system_of, without_code(config))
    found = tied_energy(smooth_rest_system(problem_of(config)), plain)
    same = tied_energy_of(found).model_dump() == stored.model_dump()
    return same and agrees_with_tied_equations(stored.model_dump(mode="json"), exact)


def _unchecked(proof: Proof, config: Config | None) -> Iterator[str]:
    """Yield what was not checked, as sentences."""
    if config is not None and not _can_build(config):
        yield (
            "The energy of the proof and the hypotheses of its theorems were not compared with "
            f"the config: {CODE_NOT_RUN}."
        )
    if config is None:
        name = "U" if proof.reduced_energy else "W"
        yield f"The energy {name} was not compared with a config; use --config CONFIG."
    wide = proof.unwrapped
    if not proof.proved:
        yield "The proof does not claim to list all rest states in the range of eq. 5."
    if wide is not None and not wide.proved:
        yield "The proof does not claim to list all rest states with any θ1 and θ3."
    yield "Values in doubles, which are not proved: Θ, X, own states, energies, levels and passes."
