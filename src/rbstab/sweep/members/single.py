"""Members one by one, each as the single run that it is."""

from dataclasses import replace

import numpy as np

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.config.build import problem_of
from rbstab.config.schema import MIN_SCIPY_RTOL, Config
from rbstab.experiment.record import quantities_of
from rbstab.experiment.switching_record import resting_system, works_without_potential
from rbstab.integrate.engines import engine
from rbstab.integrate.problem import Problem, Trajectory
from rbstab.mechanics.attitude import rate_matrix
from rbstab.mechanics.numbers import Array
from rbstab.sweep.members.engine import Shard, columns_of_failed
from rbstab.sweep.members.identity import run_ids
from rbstab.sweep.members.outcome import STATUSES, Traces, outcome_of
from rbstab.sweep.members.traces import TIME, layout_of, put_single
from rbstab.sweep.plan.plan import Plan


class SingleRuns:
    """An engine of members that follows each of them by itself.

    Args:
        plan: The plan.
        name: The engine, whatever the plan says; default that of each config.

    Raises:
        EngineMissingError: The package of an engine is not installed.
    """

    def __init__(self, plan: Plan, name: str | None = None) -> None:
        self._plan = plan
        self._engine = name or plan.engine
        self._layout = layout_of(plan)
        engine(self._engine)

    def compute(self, start: int, stop: int) -> Shard:
        """The members from number `start` up to `stop`."""
        found = columns_of_failed(stop - start)
        found["run_id"] = run_ids(self._plan, start, stop)
        chosen = self._plan.keep.traces(start, stop)
        places = np.cumsum(chosen) - 1
        traces = self._layout.blank(int(chosen.sum())) if chosen.any() else None
        for index in range(stop - start):
            # Whatever goes wrong with one member says nothing of the others; it keeps its status.
            try:
                problem = self._problem(self._plan.config_of(start + index))
                trajectory, quantities = self._follow(problem)
            except Exception:  # noqa: S112
                continue
            found["status"][index] = STATUSES.index(trajectory.status)
            found["steps"][index] = min(trajectory.steps, np.iinfo(np.int32).max)
            for name, values in _outcome(problem, quantities).items():
                found[name][index] = values[0]
            if traces is not None and chosen[index] and TIME in quantities:
                put_single(traces, int(places[index]), quantities)
        return Shard(found, traces)

    def _problem(self, config: Config) -> Problem:
        # What no column shows is not asked for: how far a motion that slides can be trusted.
        problem = replace(problem_of(config), diagnosed=False)
        if self._engine == "scipy":
            problem = replace(problem, rtol=max(problem.rtol, MIN_SCIPY_RTOL))
        return problem

    def _follow(self, problem: Problem) -> tuple[Trajectory, dict[str, Array]]:
        with np.errstate(all="ignore"):
            trajectory = engine(self._engine)(problem)
            try:
                rest = nearest_rest_state(resting_system(problem))
                return trajectory, quantities_of(problem, trajectory, rest.energy)
            except Exception:
                # The status is known.
                return trajectory, {}


def _outcome(problem: Problem, quantities: dict[str, Array]) -> dict[str, Array]:
    try:
        with np.errstate(all="ignore"):
            return outcome_of(traces_of(problem, quantities))
    except Exception:
        # What a motion of a single sample has not is left out.
        return {}


def traces_of(problem: Problem, quantities: dict[str, Array]) -> Traces:
    """The motion of a single run as that of one member."""

    def one(name: str) -> Array:
        return quantities[name][np.newaxis]

    Theta, Omega = quantities["orientation"], quantities["angular_velocity"]
    rates = np.array([rate_matrix(a) @ w for a, w in zip(Theta, Omega, strict=True)])
    return Traces(
        times=quantities["time"],
        Theta=one("orientation"),
        Theta_rate=rates[np.newaxis],
        Omega=one("angular_velocity"),
        X=one("position"),
        V=one("velocity"),
        E=one("contact_displacement"),
        F=one("contact_velocity"),
        own=one("connector_state") if "connector_state" in quantities else None,
        value=one("lyapunov"),
        residual=one("energy_residual"),
        work=one("contact_work") if works_without_potential(problem.system) else None,
    )
