"""Simulate one config."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.approached_state import is_unstable
from rbstab.analysis.certificate.verdict import overall
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of
from rbstab.config.elements import reading_angles
from rbstab.config.errors import describe
from rbstab.config.load import load_config, resolved_yaml, run_id
from rbstab.config.schema import Config
from rbstab.config.warnings import config_warnings
from rbstab.experiment.answers.result import Result
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.convergence.with_proof import with_proof
from rbstab.experiment.convergence.zero_description import no_rest_state_warning, zero_description
from rbstab.experiment.provenance import provenance
from rbstab.experiment.record import (
    record_of,
    recording_time,
    rest_state_of,
)
from rbstab.experiment.resolution import inverse_warnings, motion_warnings, resolution_warnings
from rbstab.experiment.run_certificate import certificate_variables
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.engines import engine
from rbstab.integrate.problem import Problem, Progress

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof


def simulate(
    config: Config | str | Path | Mapping[str, Any],
    *,
    progress: Progress | None = None,
    proof: "Proof | None" = None,
    enclose: Enclose = Enclose.NOTHING,
    allow_python: bool = False,
) -> Result:
    """Compute the motion that a config describes, and return its result; no file is written.

    It integrates the equations of motion (eq. 1) and ∫v' dt from the initial state, and tests the
    energy balance and other properties of the motion (the certificate).

    Args:
        config: A config, or any argument that `load_config` takes.
        progress: Called after every step with the time reached, s.
        proof: The proof of the rest states, from `prove`; without one, convergence is not decided.
        enclose: How far to enclose the exact motion in proved bounds; this needs the proof.
        allow_python: As for `load_config`.

    Returns:
        The result. If the run stops early, `Result.status` is the reason and the arrays hold the
        samples that were reached; no error is raised.

    Raises:
        ConfigError: The config is invalid.
        EngineMissingError: The engine's package is not installed.
        TypeError: `proof` is no proof, or `enclose` no member of `Enclose`.
        ValueError: The exact motion is to be enclosed, but no proof is given.
    """
    _check_proof(proof, enclose)
    config = load_config(config, allow_python=allow_python)
    return simulate_problem(
        config, problem_of(config), progress=progress, proof=proof, enclose=enclose
    )


def _check_proof(proof: object, enclose: object) -> None:
    """Refuse arguments of `simulate` that are of another type, or do not fit together."""
    # Imported late: few runs have a proof.
    from rbstab.experiment.stored_proof.proof import Proof

    if not (proof is None or isinstance(proof, Proof)):
        raise TypeError(f"proof: is {describe(proof)} (expected what rbstab.prove returns)")
    if enclose not in tuple(Enclose):
        names = ", ".join(f"rbstab.Enclose.{member.name}" for member in Enclose)
        raise TypeError(f"enclose: is {describe(enclose)} (expected one of {names})")
    if enclose != Enclose.NOTHING and proof is None:
        raise ValueError("enclose: needs a proof (expected proof=rbstab.prove(config))")


def simulate_problem(
    config: Config,
    problem: Problem,
    *,
    progress: Progress | None = None,
    proof: "Proof | None" = None,
    enclose: Enclose = Enclose.NOTHING,
) -> Result:
    """Integrate the problem of a config and return its result.

    Args:
        config: The config.
        problem: Its problem, from `problem_of`.
        progress: As `simulate`.
        proof: As `simulate`.
        enclose: As `simulate`.
    """
    integrate = engine(config.integration.engine)
    deadline = Deadline(problem.time_limit)
    rest = rest_state_of(problem)
    deadline.recording_time = recording_time(problem)
    begin = time.perf_counter()
    trajectory = integrate(problem, progress, deadline)
    wall_time = time.perf_counter() - begin
    record = record_of(problem, trajectory, rest, deadline)
    trajectory = record.trajectory
    with np.errstate(all="ignore"):
        unstable = is_unstable(smooth_rest_system(problem), record.zero.rest)
    reads_angles = bool(reading_angles(config.controller, config.elements))
    arrays = Result(record.variables, {"variant": config.controller.variant}, "")
    attributes: dict[str, str | int | float] = {
        "title": config.title,
        "variant": config.controller.variant,
        "status": str(trajectory.status),
        "status_detail": trajectory.detail,
        "warnings": "\n".join(
            [
                *config_warnings(config),
                *([] if record.zero.rest.is_at_rest else [no_rest_state_warning(problem.system)]),
                *motion_warnings(trajectory, reads_angles=reads_angles),
                *inverse_warnings(problem.system),
                *resolution_warnings(config.integration, trajectory, record.variables),
            ]
        ),
        "lyapunov_zero": zero_description(record.zero, arrays, unstable=unstable),
        "verdict": str(overall(record.checks)),
        "run_id": run_id(config),
        "engine": config.integration.engine,
        "steps": trajectory.steps,
        "evaluations": trajectory.evaluations,
        "wall_time": wall_time,
        **provenance(config.integration.engine),
    }
    lines = certificate_variables(record.checks)
    result = Result(record.variables | lines, attributes, resolved_yaml(config))
    return with_proof(result, config, problem, proof, enclose)
