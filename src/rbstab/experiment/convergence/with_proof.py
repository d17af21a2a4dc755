"""A result with what a proof says about its motion: in its certificate and in its attributes.

Only these parts change. So a proof can be added to a stored result without a second integration. It
may be stored after the run: by a run of the same body, or by `rbstab stability`. Whoever shows a
stored result shows what is known now, and so the same everywhere.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from rbstab.analysis.certificate.evidence import computed_audit_bound
from rbstab.analysis.certificate.verdict import Check, Verdict, overall
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code
from rbstab.experiment.convergence.convergence import (
    ATTRIBUTE,
    Convergence,
    Enclose,
    convergence_attributes,
    stored_convergence,
)
from rbstab.experiment.convergence.decisions import refusal
from rbstab.experiment.convergence.enclosed_samples import (
    COMPUTED_MOTION,
    EnclosedSamples,
    computed_motion_check,
    enclosure_variables,
)
from rbstab.experiment.convergence.enclosed_samples import GROUP as ENCLOSURE
from rbstab.experiment.convergence.zero_description import NO_REST_STATE, described_by_proof
from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.run_certificate import (
    CERTIFIED_REGION,
    GLOBAL_STABILITY,
    LEAST_REST_STATES,
    certificate_variables,
    proved_checks,
    rest_state_check,
)
from rbstab.experiment.run_certificate import GROUP as CERTIFICATE
from rbstab.experiment.stored_certificate import stored_lines
from rbstab.experiment.stored_config import stored_config
from rbstab.integrate.problem import Problem
from rbstab.store.errors import StoreError
from rbstab.store.result import Result

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof

AnyResult = TypeVar("AnyResult", bound=Result)


def takes_proof(result: Result) -> bool:
    """Return whether a result has what `with_proof` needs; some of older versions have not."""
    has_certificate = f"{CERTIFICATE}/check" in result and "rest_orientation" in result
    return has_certificate and "lyapunov_zero" in result.attributes


def with_proof(
    result: AnyResult,
    config: Config,
    problem: Problem,
    proof: "Proof | None",
    enclose: Enclose = Enclose.NOTHING,
) -> AnyResult:
    """Return a result with what a proof of its rest states says about it.

    Args:
        result: The result; it takes a proof.
        config: Its config.
        problem: The problem of the config.
        proof: The proof; without one, convergence is not decided.
        enclose: How far to enclose the exact motion; this needs the proof.
    """
    convergence, samples = _convergence(config, problem, proof, enclose)
    enclosure = {} if samples is None else enclosure_variables(samples, problem.system)
    replaced = GLOBAL_STABILITY, CERTIFIED_REGION, COMPUTED_MOTION
    checks = [line for line in stored_lines(result) if line.check not in replaced]
    if samples is not None:
        bound = computed_audit_bound(problem)
        checks.append(computed_motion_check(samples, result.variables, bound))
    lines = certificate_variables([*checks, *proved_checks(problem, proof)])
    kept = {
        name: variable
        for name, variable in result.variables.items()
        if name not in lines and name.partition("/")[0] != ENCLOSURE
    }
    attributes = attributes_with_proof(result, proof, str(overall(checks)), convergence)
    return replace(result, variables=kept | lines | enclosure, attributes=attributes)


def _convergence(
    config: Config, problem: Problem, proof: "Proof | None", enclose: Enclose
) -> tuple[Convergence, EnclosedSamples | None]:
    """Return what is proved of the exact motion; it is followed only if asked."""
    if proof is None:
        refused = refusal(problem, None)
        assert refused is not None
        return refused, None
    # Imported late: most runs have no proof.
    from rbstab.experiment.convergence.exact_motion import convergence_at_start, prove_convergence

    if enclose:
        convergence, samples = prove_convergence(config, problem, proof, enclose)
        return convergence, samples
    return convergence_at_start(config, problem, proof), None


def attributes_with_proof(
    result: Result, proof: "Proof | None", verdict: str, convergence: Convergence
) -> dict[str, str | int | float]:
    """Return the attributes of a result, with those of its proof in the place of older ones.

    Args:
        result: The result.
        proof: The proof; None without one.
        verdict: The verdict of the computed run.
        convergence: What is proved of the exact motion.
    """
    changed: dict[str, str | int | float] = {}
    for name, value in result.attributes.items():
        if name.partition("_")[0] == ATTRIBUTE:
            continue
        changed[name] = value
        if name == "verdict":
            changed |= {"verdict": verdict, **convergence_attributes(convergence)}
    if "lyapunov_zero" not in changed or "rest_orientation" not in result:
        return changed  # an older result does not say from which state its v counts
    zero = str(changed["lyapunov_zero"])
    Theta = result["rest_orientation"].astype(np.float64)
    described = described_by_proof(zero, Theta, proof, convergence.rest_state)
    if zero.startswith(NO_REST_STATE):
        # The warning begins with the same words, and goes on with what may be the reason.
        lines = [
            f"{described}{line.removeprefix(zero)}" if line.startswith(zero) else line
            for line in str(changed.get("warnings", "")).splitlines()
        ]
        changed["warnings"] = "\n".join(lines)
    return changed | {"lyapunov_zero": described}


class KnownNow(NamedTuple):
    """A stored result with all that is known of it now.

    Attributes:
        result: The result, with what the proof decides in its certificate and its attributes.
        config: Its config; None if this version cannot read it.
        proof: The proof in the folder of the result; None if there is none.
    """

    result: Result
    config: Config | None
    proof: "Proof | None"


def known_now(path: Path, result: Result, config: Config | None = None) -> KnownNow:
    """Return what is known of a stored result, with the proof in its folder.

    Args:
        path: The file of the result.
        result: The result.
        config: Its config, if the caller has it.
    """
    config = config or stored_config(result).config
    try:
        proof = None if config is None else cached_proof(path.parent, config)
    except StoreError:
        proof = None
    return KnownNow(with_later_proof(result, config, proof), config, proof)


def with_later_proof(result: Result, config: Config | None, proof: "Proof | None") -> Result:
    """Return a stored result with what a proof decides that was stored after it.

    What the result says itself stays, if the proof says no more. The verdict of the computed run
    never changes.

    Args:
        result: The result.
        config: Its config; None if this version cannot read it. Then nothing is added.
        proof: The proof in the folder of the result, if there is one.
    """
    lines = stored_lines(result)
    if proof is None or config is None or not _says_more(proof, lines):
        return result
    if has_code(config):
        # Its start would need the equations, and a stored result must not run code of a user.
        return result
    # Imported late: it needs the proofs.
    from rbstab.experiment.convergence.exact_motion import convergence_at_start

    problem = problem_of(config)
    new = {one.check: one for one in proved_checks(problem, proof)}
    found = stored_convergence(result.attributes)
    if found is None or found.proved is None:
        found = _further(found, convergence_at_start(config, problem, proof))
    changed = [_knowing_more(line, new.get(line.check)) for line in lines]
    attributes = attributes_with_proof(result, proof, str(result.attributes["verdict"]), found)
    variables = {**result.variables, **certificate_variables(changed)}
    return replace(result, variables=variables, attributes=attributes)


def _says_more(proof: "Proof", lines: Sequence[Check]) -> bool:
    """Return whether a proof may say more of a run than its certificate.

    A certificate without these checks is of an old version, and takes none.
    """
    by_name = {line.check: line for line in lines}
    stable, region = by_name.get(GLOBAL_STABILITY), by_name.get(CERTIFIED_REGION)
    if stable is None or region is None:
        return False
    if math.isnan(stable.value):
        return True
    now = rest_state_check(proof)
    if math.isnan(now.value):
        return False
    if (now.verdict, now.value) != (stable.verdict, stable.value):
        # A longer search has found more, or has proved it.
        return stable.verdict == Verdict.UNKNOWN or now.verdict != Verdict.UNKNOWN
    level = math.nan if proof.region is None else proof.region.lower_bound
    is_new = math.isnan(region.bound) and not math.isnan(level)
    return region.verdict == Verdict.UNKNOWN and (is_new or level > region.bound)


def _knowing_more(stored: Check, new: Check | None) -> Check:
    """Return the check that says more: a shorter proof may have less than the result has."""
    if new is None or math.isnan(new.value):
        return stored
    if math.isnan(stored.value):
        return new
    decided = [one.verdict != Verdict.UNKNOWN for one in (stored, new)]
    if stored.check == CERTIFIED_REGION:
        return new if decided[1] or not decided[0] else stored
    # A complete count of rest states stays, as does one of more states that were proved.
    counts_all = stored.quantity != LEAST_REST_STATES
    is_less = new.quantity == LEAST_REST_STATES and (counts_all or new.value < stored.value)
    return stored if decided[0] and (not decided[1] or is_less) else new


def _further(stored: Convergence | None, new: Convergence) -> Convergence:
    """Return the convergence that says more: a motion that was enclosed says why it was in vain."""
    return stored if stored is not None and stored.steps and new.proved is None else new
