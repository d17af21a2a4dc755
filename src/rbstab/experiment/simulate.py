"""Simulate one config."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbstab.analysis.certificate import overall
from rbstab.config.build import config_warnings, problem_of
from rbstab.config.load import load_config, resolved_yaml, run_id
from rbstab.config.schema import Config
from rbstab.config.section import Section
from rbstab.experiment.convergence.convergence import (
    Convergence,
    Enclose,
    convergence_attributes,
)
from rbstab.experiment.convergence.decisions import refusal
from rbstab.experiment.convergence.enclosed_samples import (
    EnclosedSamples,
    computed_motion_check,
    enclosure_variables,
)
from rbstab.experiment.provenance import provenance
from rbstab.experiment.record import (
    motion_warnings,
    record_of,
    recording_time,
    rest_state_of,
    zero_description,
)
from rbstab.experiment.resolution import inverse_warnings, resolution_warnings
from rbstab.experiment.run_certificate import (
    certificate_variables,
    computed_audit_bound,
    proved_checks,
)
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.engines import engine
from rbstab.integrate.problem import Problem, Progress
from rbstab.store.result import Result
from rbstab.systems.quantities import LAYOUT_VERSION

if TYPE_CHECKING:
    from rbstab.experiment.proof import Proof


def simulate(
    config: Config | str | Path | Mapping[str, Any],
    *,
    progress: Progress | None = None,
    proof: "Proof | None" = None,
    enclose: Enclose = Enclose.NOTHING,
    allow_python: bool = False,
) -> Result:
    """Integrate a config and return its result; no file is written.

    Args:
        config: A config, or any argument that `load_config` takes.
        progress: Called after every step with the time reached, s.
        proof: The proof of the rest states; without one, convergence is not decided.
        enclose: How far to enclose the exact motion; this needs the proof.
        allow_python: As for `load_config`, if the config is not loaded yet.

    Returns:
        The result. `Result.status` is the status at the end; `Result.to_xarray` returns a dataset.

    Raises:
        ConfigError: The config is wrong.
        EngineMissingError: The engine's package is not installed.
    """
    if not isinstance(config, Section):
        config = load_config(config, allow_python=allow_python)
    return simulate_problem(
        config, problem_of(config), progress=progress, proof=proof, enclose=enclose
    )


def simulate_problem(
    config: Config,
    problem: Problem,
    *,
    progress: Progress | None = None,
    proof: "Proof | None" = None,
    enclose: Enclose = Enclose.NOTHING,
) -> Result:
    """Integrate the problem of a config and return its result; see `simulate`."""
    integrate = engine(config.integration.engine)
    deadline = Deadline(problem.time_limit)
    rest = rest_state_of(problem)
    deadline.recording_time = recording_time(problem)
    begin = time.perf_counter()
    trajectory = integrate(problem, progress, deadline)
    wall_time = time.perf_counter() - begin
    record = record_of(problem, trajectory, rest, deadline)
    trajectory = record.trajectory
    convergence, samples = _motion_proof(config, problem, proof, enclose)
    checks, enclosure = record.checks, {}
    if samples is not None:
        bound = computed_audit_bound(problem)
        checks = [*checks, computed_motion_check(samples, record.variables, bound)]
        enclosure = enclosure_variables(samples)
    attributes: dict[str, str | int | float] = {
        "title": config.title,
        "variant": config.controller.variant,
        "status": str(trajectory.status),
        "status_detail": trajectory.detail,
        "warnings": "\n".join(
            [
                *config_warnings(config),
                *record.warnings,
                *motion_warnings(trajectory),
                *inverse_warnings(problem.system),
                *resolution_warnings(config.integration, trajectory, record.variables),
            ]
        ),
        "lyapunov_zero": zero_description(record.zero, proof),
        "verdict": str(overall(checks)),
        **convergence_attributes(convergence),
        "run_id": run_id(config),
        "layout_version": LAYOUT_VERSION,
        "engine": config.integration.engine,
        "steps": trajectory.steps,
        "evaluations": trajectory.evaluations,
        "wall_time": wall_time,
        **provenance(config.integration.engine),
    }
    lines = certificate_variables([*checks, *proved_checks(problem, proof)])
    return Result(record.variables | lines | enclosure, attributes, resolved_yaml(config))


def _motion_proof(
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
