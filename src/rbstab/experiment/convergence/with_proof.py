"""A result with what a proof says about its motion: in its certificate and in its attributes.

Only these parts change. So a proof can be added to a stored result without a second integration. It
may be stored after the run: by a run of the same body, or by `rbstab stability`. Whoever shows a
stored result shows what is known now, and so the same everywhere.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

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
from rbstab.experiment.convergence.decisions import convergence_at_start
from rbstab.experiment.convergence.enclosed_samples import (
    COMPUTED_MOTION,
    computed_motion_check,
    enclosure_variables,
)
from rbstab.experiment.convergence.enclosed_samples import GROUP as ENCLOSURE
from rbstab.experiment.convergence.zero_description import described_by_proof
from rbstab.experiment.run_certificate import (
    CERTIFIED_REGION,
    GLOBAL_STABILITY,
    LEAST_REST_STATES,
    certificate_variables,
    proved_checks,
    rest_state_check,
)
from rbstab.experiment.stored_run import certificate_lines
from rbstab.experiment.summary import NO_REST_STATE
from rbstab.integrate.problem import Problem
from rbstab.store.result import Result
from rbstab.store.variables import Variable

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof

AnyResult = TypeVar("AnyResult", bound=Result)


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
    samples, enclosure = None, dict[str, Variable]()
    if enclose and proof is not None:
        # Imported late: most runs have no proof.
        from rbstab.experiment.convergence.exact_motion import prove_convergence

        convergence, samples = prove_convergence(config, problem, proof, enclose)
    else:
        convergence = convergence_at_start(problem, proof)
    replaced = GLOBAL_STABILITY, CERTIFIED_REGION, COMPUTED_MOTION
    checks = [line for line in certificate_lines(result) if line.check not in replaced]
    if samples is not None:
        enclosure = enclosure_variables(samples, problem.system)
        bound = computed_audit_bound(problem)
        checks.append(computed_motion_check(samples, result.variables, bound))
    kept = {
        name: variable
        for name, variable in result.variables.items()
        if name.partition("/")[0] != ENCLOSURE
    }
    attributes = result.attributes | {"verdict": str(overall(checks))}
    whole = replace(result, variables=kept | enclosure, attributes=attributes)
    return _stated(whole, [*checks, *proved_checks(problem, proof)], proof, convergence)


def _stated(
    result: AnyResult, checks: Sequence[Check], proof: "Proof | None", convergence: Convergence
) -> AnyResult:
    """Return a result with other checks, and other attributes of what is proved of it."""
    changed = {
        name: value
        for name, value in result.attributes.items()
        if name.partition("_")[0] != ATTRIBUTE
    }
    changed |= convergence_attributes(convergence)
    zero, Theta = str(changed["lyapunov_zero"]), result["rest_orientation"]
    described = described_by_proof(zero, Theta, proof, convergence.rest_state)
    if zero.startswith(NO_REST_STATE):
        # The warning begins with the same words, and goes on with what may be the reason.
        warnings = f"\n{changed.get('warnings', '')}".replace(f"\n{zero}", f"\n{described}")
        changed["warnings"] = warnings[1:]
    variables = {**result.variables, **certificate_variables(checks)}
    attributes = changed | {"lyapunov_zero": described}
    return replace(result, variables=variables, attributes=attributes)


def with_later_proof(result: Result, config: Config | None, proof: "Proof | None") -> Result:
    """Return a stored result with what a proof decides that was stored after it.

    What the result says itself stays, if the proof says no more. The verdict of the computed run
    never changes.

    Args:
        result: The result.
        config: Its config; None if this version cannot read it. Then nothing is added.
        proof: The proof in the folder of the result, if there is one.
    """
    lines = {line.check: line for line in certificate_lines(result)}
    stable, region = lines.get(GLOBAL_STABILITY), lines.get(CERTIFIED_REGION)
    # Its start would need the equations, and a stored result must not run code of a user.
    if proof is None or config is None or has_code(config) or not (stable and region):
        return result
    is_deeper = (
        region.verdict == Verdict.UNKNOWN
        and proof.region is not None
        and not proof.region.lower_bound <= region.bound
    )
    if max(stable, rest_state_check(proof), key=_strength) is stable and not is_deeper:
        return result
    problem = problem_of(config)
    for new in proved_checks(problem, proof):
        lines[new.check] = max(lines[new.check], new, key=_strength)
    convergence = stored_convergence(result.attributes)
    if convergence is None or convergence.proved is None:
        now = convergence_at_start(problem, proof)
        # A motion that was enclosed says why it was in vain.
        if convergence is None or now.proved is not None or not convergence.steps:
            convergence = now
    return _stated(result, list(lines.values()), proof, convergence)


def _strength(line: Check) -> tuple[bool, bool, float, float]:
    """Return how much a check says that a proof decides, so that of two the greater says more."""
    count = line.value if line.check == GLOBAL_STABILITY else 0.0
    count, bound = (-math.inf if math.isnan(number) else number for number in (count, line.bound))
    # A complete count of rest states says more than one of states that are at least there.
    return line.verdict != Verdict.UNKNOWN, line.quantity != LEAST_REST_STATES, count, bound
