"""An engine that integrates members one by one, as single runs."""

from collections.abc import Hashable
from dataclasses import replace

import numpy as np

from rbstab.analysis.approached_state import is_unstable
from rbstab.analysis.lyapunov import energy_scale
from rbstab.analysis.rest_state import RestState
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.analysis.run_extremes import extremes_of
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.config.sections.integration import MIN_SCIPY_RTOL
from rbstab.experiment.record import recorded, recording_time, rest_state_of, zero_of
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.engines import engine
from rbstab.integrate.problem import Problem, Trajectory
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.sweep.members.engine import Shard, failed_shard
from rbstab.sweep.members.outcome import (
    FINAL_PREFIX,
    LARGEST_PREFIX,
    STATUSES,
    finals_of,
    outcome_columns,
    outcome_of,
)
from rbstab.sweep.members.traces import TIME, copy_single_run
from rbstab.sweep.plan.plan import Plan
from rbstab.systems.parameters import parameters


class SingleRuns:
    """Integrates members one by one (a `MemberEngine`).

    Args:
        plan: The plan.
        name: The name of the engine; default the engine of the plan.
        with_largest: Whether the largest sample, by component, of each quantity whose final value
            is a column is one too. A motion that comes to rest ends with round-off, which is no
            scale for differences.

    Raises:
        EngineMissingError: The package of the engine is not installed.
    """

    def __init__(self, plan: Plan, name: str | None = None, *, with_largest: bool = False) -> None:
        self._plan, self._with_largest = plan, with_largest
        self._engine = name or plan.engine
        self._columns = outcome_columns(plan)
        if with_largest:
            self._columns |= {
                LARGEST_PREFIX + name.removeprefix(FINAL_PREFIX): column
                for name, column in self._columns.items()
                if name.startswith(FINAL_PREFIX)
            }
        self._last: tuple[Hashable, float, RestState] | None = None
        engine(self._engine)

    def compute(self, start: int, stop: int) -> Shard:
        """Integrate the members from number `start` up to `stop`."""
        columns, traces = shard = failed_shard(self._plan, start, stop, self._columns)
        kept = self._plan.keep.selected(start, stop)
        places = np.cumsum(kept) - 1
        for index in range(stop - start):
            # An error in one member must not stop the others; the member keeps its failed status.
            try:
                problem = self._problem(self._plan.config_of(start + index))
                deadline = Deadline(problem.time_limit)
                trajectory, quantities, outcome = self._run(problem, deadline)
            except Exception:  # noqa: S112
                continue
            columns["status"][index] = STATUSES.index(trajectory.status)
            columns["steps"][index] = min(trajectory.steps, np.iinfo(np.int32).max)
            for name, values in outcome.items():
                columns[name][index] = values[0]
            if traces is not None and kept[index] and TIME in quantities:
                copy_single_run(traces, int(places[index]), quantities)
        return shard

    def _problem(self, config: Config) -> Problem:
        # Columns do not contain trusted_until, so it is not computed.
        problem = replace(problem_of(config), diagnosed=False)
        if self._engine == "scipy":
            problem = replace(problem, rtol=max(problem.rtol, MIN_SCIPY_RTOL))
        return problem

    def _run(
        self, problem: Problem, deadline: Deadline
    ) -> tuple[Trajectory, dict[str, Array], dict[str, Array]]:
        """Return a motion, its quantities and its columns."""
        deadline.recording_time, nearest = self._of_system(problem)
        with np.errstate(all="ignore"):
            trajectory = engine(self._engine)(problem, None, deadline)
            try:
                zero = zero_of(problem, trajectory, nearest, deadline)
                record = recorded(problem, trajectory, zero.rest, deadline)
                if not zero.approached:
                    record.quantities["rest_orientation"] = np.full(3, np.nan)
                unstable = is_unstable(smooth_rest_system(problem), zero.rest)
                record.quantities["rest_unstable"] = np.array(unstable)
                return (*record, self._outcome(problem, deadline, *record))
            except Exception:
                # A motion that ended early keeps its status if it has no quantities or columns. One
                # that completed without them failed.
                if trajectory.status is RunStatus.COMPLETED:
                    raise
                return trajectory, {}, {}

    def _of_system(self, problem: Problem) -> tuple[float, RestState]:
        """Return the time to record a sample, and the nearest rest state; the last are kept."""
        values = [(name, array.tobytes()) for name, array in parameters(problem.system).items()]
        # Problems share them if only their starts, samples and tolerances differ.
        key = type(problem.system.coordinates), problem.switching, tuple(values)
        if self._last is None or self._last[0] != key:
            self._last = key, recording_time(problem), rest_state_of(problem)
        return self._last[1:]

    def _outcome(
        self,
        problem: Problem,
        deadline: Deadline,
        trajectory: Trajectory,
        quantities: dict[str, Array],
    ) -> dict[str, Array]:
        # The quantities of one member.
        batch = {name: array[np.newaxis] for name, array in quantities.items() if name != TIME}
        extremes = extremes_of(problem, trajectory, quantities, deadline)
        columns = outcome_of(batch | {TIME: quantities[TIME]}, extremes)
        v, supplied = batch["lyapunov"], batch.get("supplied_energy")
        columns["energy_residual"] = np.abs(batch["energy_residual"]).max(axis=1)
        columns["energy_scale"] = energy_scale(v, batch["energy_round_off"], supplied)
        if self._with_largest:
            for name, values in finals_of(batch).items():
                columns[LARGEST_PREFIX + name] = np.abs(values).max(axis=1)
        return columns
