"""A result with what a proof says about its motion: in its certificate and in its attributes.

Only these parts change. So a proof can be added to a stored result without a second integration.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rbstab.analysis.certificate.verdict import overall
from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import (
    ATTRIBUTE,
    Convergence,
    Enclose,
    convergence_attributes,
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
from rbstab.experiment.run_certificate import (
    CERTIFIED_REGION,
    GLOBAL_STABILITY,
    certificate_variables,
    computed_audit_bound,
    proved_checks,
)
from rbstab.experiment.run_certificate import GROUP as CERTIFICATE
from rbstab.experiment.stored_certificate import stored_lines
from rbstab.integrate.problem import Problem
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
