"""Simulating one config."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rbstab.config.build import config_warnings, problem_of
from rbstab.config.load import load_config, resolved_yaml, run_id
from rbstab.config.schema import Config
from rbstab.config.section import Section
from rbstab.experiment.certified import certificate_variables, proved_checks, verdict_of
from rbstab.experiment.proof import Proof
from rbstab.experiment.provenance import provenance
from rbstab.experiment.record import motion_warnings, record_of
from rbstab.integrate.engines import engine
from rbstab.integrate.problem import Progress
from rbstab.store.result import Result


def simulate(
    config: Config | str | Path | Mapping[str, Any],
    *,
    progress: Progress | None = None,
    proof: Proof | None = None,
) -> Result:
    """Integrates a config and returns its result, which is not written anywhere.

    Args:
        config: A config, or what `load_config` takes.
        progress: Called with the time reached, s, after every step.
        proof: What is proved of the config; without it the verdict is at best `consistent`.

    Returns:
        The result; `Result.status` says how the run ended, `Result.to_xarray` gives a dataset.

    Raises:
        ConfigError: The config is wrong.
        EngineMissingError: The engine's package is not installed.
    """
    if not isinstance(config, Section):
        config = load_config(config)
    integrate = engine(config.integration.engine)
    problem = problem_of(config)
    begin = time.perf_counter()
    trajectory = integrate(problem, progress)
    wall_time = time.perf_counter() - begin
    record = record_of(problem, trajectory)
    attributes: dict[str, str | int | float] = {
        "title": config.title,
        "variant": config.controller.variant,
        "status": str(trajectory.status),
        "status_detail": trajectory.detail,
        "warnings": "\n".join(
            [*config_warnings(config), *record.warnings, *motion_warnings(trajectory)]
        ),
        "verdict": str(verdict_of(record.checks, config, proof)),
        "run_id": run_id(config),
        "engine": config.integration.engine,
        "steps": trajectory.steps,
        "evaluations": trajectory.evaluations,
        "wall_time": wall_time,
        **provenance(config.integration.engine),
    }
    lines = certificate_variables([*record.checks, *proved_checks(config, proof)])
    return Result(record.variables | lines, attributes, resolved_yaml(config))
