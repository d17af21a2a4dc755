"""The fast engine of members, which integrates them in compiled batches.

Members with switching, projection or breakpoints of inputs are single runs. A member is also
computed by a single run, which gives its status, if a batch does not integrate it to the end, or
not within the step limit, or if its steps do not tell how it turns past θ2 = ±90°.
θ2 of a member may come so close to the end of the range that its steps do not show whether the
member left the range. The engine then integrates this member again, outside the batch. If the
integration does not complete, the member is computed by a single run.
"""

import math
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from rbstab.analysis.approached_state import lyapunov_zero
from rbstab.analysis.configuration import configurations
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.analysis.settling import value_round_off
from rbstab.config.build import problem_of
from rbstab.config.numbers import is_of_initial_state
from rbstab.integrate.heyoka.compiled_map import SIMD
from rbstab.integrate.heyoka.engine import integrate
from rbstab.integrate.heyoka.ensemble.ensemble import Ensemble
from rbstab.integrate.heyoka.ensemble.forces import EnsembleForces
from rbstab.integrate.heyoka.ensemble.trajectories import (
    EnsembleTrajectories,
    ObservedPositions,
    ObservedTrajectories,
)
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA
from rbstab.sweep.members.approached_states import (
    ApproachedStates,
    RestStatesOfMembers,
    SharedState,
)
from rbstab.sweep.members.binding import Binding
from rbstab.sweep.members.engine import MemberEngine, Shard, columns_of_failed
from rbstab.sweep.members.ensemble_extremes import EnsembleExtremes
from rbstab.sweep.members.identity import run_ids
from rbstab.sweep.members.outcome import STATUSES, MemberTrajectories, outcome_columns, outcome_of
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.members.traces import copy_traces, layout_of
from rbstab.sweep.plan.plan import Plan
from rbstab.systems.modes import has_modes

STATES_IN_MEMORY = 1024 * 201
"""States in memory at once, at samples and at the ends of steps (50 MB). With fewer, more time is
spent between numpy's functions."""

ENDS_EXPECTED = 1000
"""The ends of the steps of a member that are expected before some were integrated."""


def ensemble_engine(plan: Plan) -> MemberEngine:
    """Return the fast engine of a plan, for one thread."""
    return EnsembleEngine(plan, SingleRuns(plan, "heyoka"))


class EnsembleEngine:
    """Integrates members in batches (a `MemberEngine`).

    Args:
        plan: The plan.
        single_runs: The engine for members that must be run one by one.
    """

    def __init__(self, plan: Plan, single_runs: MemberEngine) -> None:
        self.plan = plan
        self.single_runs = single_runs
        self.layout = layout_of(plan)
        self.columns = outcome_columns(plan)
        self.variant_engines = {
            variant: _VariantEngine(plan, variant)
            for variant in plan.variants
            if _can_run_in_batches(plan.initial_value_problems[variant])
        }

    def compute(self, start: int, stop: int) -> Shard:
        """Integrate the members from number `start` up to `stop`."""
        values = self.plan.values(start, stop)
        members = stop - start
        columns = columns_of_failed(members, self.columns)
        columns["run_id"] = run_ids(self.plan, start, stop)
        selected = self.plan.keep.selected(start, stop)
        trace_rows = np.cumsum(selected) - 1
        traces = self.layout.empty(int(selected.sum())) if selected.any() else None
        pending = np.ones(members, dtype=bool)
        for engine, chunk in self._chunks(values, members, traces is not None):
            chunk_values = {key: column[chunk] for key, column in values.items()}
            with_trace = np.flatnonzero(selected[chunk])
            outcome, pending[chunk], batch_traces = engine.outcome(chunk_values, with_trace)
            if traces is not None:
                rows = trace_rows[chunk[with_trace]]
                copy_traces(traces, rows, batch_traces.of_all, with_trace)
                copy_traces(traces, rows, batch_traces.of_selected, np.arange(len(with_trace)))
            for name, column in outcome.items():
                columns[name][chunk] = column
        for row in np.flatnonzero(pending).tolist():
            member = start + row
            single = self.single_runs.compute(member, member + 1)
            for name, column in single.outcome.items():
                columns[name][row] = column[0]
            if traces is not None and single.traces is not None:
                for name in self.layout.names:
                    traces[name][trace_rows[row]] = single.traces[name][0]
        return Shard(columns, traces)

    def _chunks(
        self, values: dict[str, Array], members: int, keeps: bool
    ) -> Iterator[tuple["_VariantEngine", Array]]:
        """Yield each batch as the engine of its variant, and the rows of its members.

        Args:
            values: The values of the members.
            members: The number of members.
            keeps: Whether samples of members are kept.
        """
        variants = values.get("controller.variant")
        for variant, engine in self.variant_engines.items():
            of_variant = np.ones(members, bool) if variants is None else variants == variant
            rows = np.flatnonzero(of_variant)
            if len(rows):
                rows = rows[engine.order({key: column[rows] for key, column in values.items()})]
            first = 0
            while first < len(rows):
                states = engine.ends + (len(engine.problem.times) if keeps else 0)
                size = max(SIMD, STATES_IN_MEMORY // states // SIMD * SIMD)
                yield engine, rows[first : first + size]
                first += size


def _can_run_in_batches(problem: Problem) -> bool:
    """Whether nothing interrupts the steps of a problem: no switch, projection or breakpoint."""
    return not (
        problem.switching or problem.project or problem.schedule or has_modes(problem.system)
    )


class _BatchTraces(NamedTuple):
    """The quantities of traces by name, for all members or only for the members with a trace."""

    of_all: dict[str, Array]
    of_selected: dict[str, Array]


class _VariantEngine:
    """The batch engine of one variant, which has one set of equations."""

    def __init__(self, plan: Plan, variant: str) -> None:
        self.binding = Binding(plan, variant)
        self.problem = self.binding.problem
        problem, varies = self.problem, self.binding.varies
        self.ensemble = Ensemble(
            problem.system, problem.rtol, problem.times, varies, quaternion=problem.quaternion
        )
        self.extremes = EnsembleExtremes(self.ensemble)
        self.ends = ENDS_EXPECTED
        self.approached = ApproachedStates(problem.system, self._shared_rest_state())
        has_traces = plan.keep.count(plan.members)
        self.trace_names = layout_of(plan).names
        self.forces = EnsembleForces(self.ensemble) if has_traces else None

    def _shared_rest_state(self) -> SharedState | None:
        """Return the rest state nearest to the unloaded position, if all members share it."""
        varied = [key.path for key in self.binding.varied_keys]
        base = self.binding.base
        varies_load = any(path[0] == "gravity" for path in varied)
        loaded = any(base.gravity) or varies_load or bool(base.elements)
        if all(map(is_of_initial_state, varied)):
            with np.errstate(all="ignore"):
                nearest = nearest_rest_state(self.problem.system)
            q = configurations(self.problem.system).configuration(nearest.motion, nearest.own)
            return SharedState(q, nearest.energy) if nearest.found else None
        # Without a load it is the unloaded position, where no energy is stored. Elements of the
        # config may pull there.
        return None if loaded else SharedState(None, 0.0)

    def order(self, values: dict[str, Array]) -> Array:
        """Return the order in which members are integrated, shape (m,): by their energy.

        A batch takes as many steps as its slowest member. Members of like energy take like numbers
        of steps. The result of a member does not depend on the others in its batch.
        """
        parameters, starts = self.binding.parameters_and_starts(values)
        return np.asarray(self.ensemble.scales.at_start(parameters, starts).argsort(kind="stable"))

    def outcome(
        self, values: dict[str, Array], with_trace: Array
    ) -> tuple[dict[str, Array], Array, "_BatchTraces"]:
        """Integrate some members.

        Args:
            values: The values of the members from `Plan.values`.
            with_trace: The indices of the members with a trace.

        Returns:
            The columns of the members; whether each must be run as a single run; and the traces,
            which are only valid until the next call.
        """
        parameters, starts = self.binding.parameters_and_starts(values)
        sampled = bool(len(with_trace))
        trajectories = self.ensemble.run(parameters, starts, sampled=sampled)
        self.ends = int(trajectories.steps.mean()) + 1
        observed = self.ensemble.observer.observe(parameters, trajectories)
        # Members that were not integrated to the end are computed by single runs.
        last = np.where(trajectories.done, trajectories.states[..., -1], np.nan)
        positions = self.ensemble.observer.positions(
            parameters, trajectories, only_last=not sampled
        )
        rest = self._rest_states(values, parameters, last, positions.X[..., -1])
        energy = observed.energy - rest.energy[:, np.newaxis]
        residual = energy - energy[:, :1] - trajectories.lyapunov_change
        energies = partial(self.ensemble.scales.energies, parameters)
        round_off = value_round_off(energies, starts)
        members = self._members(
            trajectories, observed, positions, energy, residual, round_off, rest
        )
        with np.errstate(all="ignore"):
            extremes, residuals = self.extremes.find(
                parameters, trajectories, members, lambda k: self._problem(values, k).system
            )
            outcome = outcome_of(members, extremes) | residuals
            near = self._may_have_left_range(outcome) & (not self.problem.quaternion)
        outcome["status"] = np.full(len(near), STATUSES.index(RunStatus.COMPLETED))
        outcome["steps"] = trajectories.steps
        needs_single_run = ~trajectories.done | (trajectories.steps > self.problem.step_limit)
        for k in np.flatnonzero(near & ~needs_single_run).tolist():
            status = integrate(self._problem(values, k)).status
            needs_single_run[k] = status is not RunStatus.COMPLETED
        traces = self._traces(members, parameters, trajectories, with_trace)
        return outcome, needs_single_run, traces

    def _traces(
        self,
        members: MemberTrajectories,
        parameters: Array,
        trajectories: EnsembleTrajectories,
        rows: Array,
    ) -> "_BatchTraces":
        if self.forces is None or not len(rows):
            return _BatchTraces({}, {})
        available = vars(members) | members.own_states
        available |= {"lyapunov_change": trajectories.lyapunov_change}
        forces = self.forces.along(parameters, trajectories, rows)
        evaluated = {
            "contact_force": np.moveaxis(forces.contact_force, 0, 2),
            "lyapunov_rate": forces.lyapunov_rate,
        }
        names = [name for name in self.trace_names if name in available]
        return _BatchTraces({name: available[name] for name in names}, evaluated)

    def _rest_states(
        self, values: dict[str, Array], parameters: Array, last: Array, X: Array
    ) -> RestStatesOfMembers:
        """Return the rest states at which v of each member is zero.

        The orientation is NaN where none was found that the member approaches.
        """
        own = last[self.problem.system.coordinates.size :]
        pose = [last[THETA]] if self.approached.configurations.held else [last[THETA], X]
        rest = self.approached.find(parameters, np.concatenate([*pose, own]))
        for k in np.flatnonzero(~rest.found & np.isfinite(last).all(axis=0)).tolist():
            system = self._problem(values, k).system
            motion = system.motion(last[: system.coordinates.size, k])
            with np.errstate(all="ignore"):
                zero = lyapunov_zero(system, motion, own[:, k], nearest_rest_state(system))
            rest.energy[k] = zero.rest.energy
            rest.orientation[k] = zero.rest.motion.Theta if zero.approached else np.nan
        return rest

    def _problem(self, values: dict[str, Array], k: int) -> Problem:
        """Return the initial value problem of member k of these values."""
        row = {key: column[k] for key, column in values.items() if key != "controller.variant"}
        return problem_of(self.binding.config_of(row))

    def _members(  # noqa: PLR0913, PLR0917 (all that is known of the members)
        self,
        trajectories: EnsembleTrajectories,
        observed: ObservedTrajectories,
        positions: ObservedPositions,
        energy: Array,
        residual: Array,
        round_off: Array,
        rest: RestStatesOfMembers,
    ) -> MemberTrajectories:
        def along(rows: Array) -> Array:
            return np.moveaxis(rows, 0, 2)

        states, own_states = trajectories.states, self.problem.system.own_states
        return MemberTrajectories(
            time=self.problem.times[[0, -1]] if len(energy[0]) == 2 else self.problem.times,
            orientation=along(states[THETA]),
            angular_velocity=along(states[OMEGA]),
            position=along(positions.X),
            velocity=along(positions.V),
            contact_displacement=along(observed.E),
            contact_velocity=along(observed.F),
            lyapunov=energy,
            energy_residual=residual,
            energy_at_rest=rest.energy,
            energy_round_off=round_off,
            rest_orientation=rest.orientation,
            own_states={name: along(states[place]) for name, place in own_states.items()},
            supplied_energy=trajectories.supplied_energy,
        )

    def _may_have_left_range(self, outcome: dict[str, Array]) -> Array:
        """Whether |θ2| may have reached the end of the range between samples, shape (m,)."""
        farthest = outcome["peak_orientation"][:, 1] + outcome["peak_orientation_error"]
        return ~(farthest < math.acos(self.problem.range_bound))
