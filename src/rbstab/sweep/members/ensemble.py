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

import numpy as np

from rbstab.analysis.approached_state import is_unstable, lyapunov_zero, rises
from rbstab.analysis.configuration import as_at_rest, configurations
from rbstab.analysis.descents.descent import numerical_hessian
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.analysis.settling import value_round_off
from rbstab.config.build import problem_of
from rbstab.config.numbers import is_of_initial_state
from rbstab.elements.motors import Lagged
from rbstab.integrate.heyoka.compiled_map import SIMD
from rbstab.integrate.heyoka.engine import integrate
from rbstab.integrate.heyoka.ensemble import CHANGE_ROW, Ensemble, Motions
from rbstab.integrate.heyoka.observed import Observed
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA
from rbstab.sweep.members.approached_states import (
    ApproachedStates,
    RestStatesOfMembers,
    SharedState,
)
from rbstab.sweep.members.binding import Binding
from rbstab.sweep.members.engine import MemberEngine, Shard, failed_shard
from rbstab.sweep.members.ensemble_extremes import EnsembleExtremes
from rbstab.sweep.members.outcome import STATUSES, outcome_columns, outcome_of
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.members.traces import TIME
from rbstab.sweep.plan.plan import Plan
from rbstab.systems.modes import has_modes
from rbstab.systems.quantities import BY_NAME, PEAKS, Quantity, observed_in, total_energy

STATES_IN_MEMORY = 512 * 201
"""States in memory at once, at samples and at the ends of steps (25 MB). With fewer, more time is
spent between numpy's functions; with more, a tenth more outside of the processor's cache."""

ENDS_EXPECTED = 1000
"""The ends of the steps of a member that are expected before some were integrated."""

TOTAL = Quantity(
    *("total_energy", "-", "J", ("time",), "sum of all energies"),
    formula=lambda seen: total_energy(seen.energy.tolist()),
)
"""v, and the energy at rest."""

Values = dict[str, Array]
"""The values of some members from `Plan.values`."""


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
        self.plan, self.single_runs = plan, single_runs
        self.variant_engines = {
            variant: _VariantEngine(plan, variant)
            for variant in plan.variants
            if _can_run_in_batches(plan.initial_value_problems[variant])
            and not _varies_passivity(plan, variant)
        }

    def compute(self, start: int, stop: int) -> Shard:
        """Integrate the members from number `start` up to `stop`."""
        values = self.plan.values(start, stop)
        columns, traces = shard = failed_shard(self.plan, start, stop, outcome_columns(self.plan))
        kept = self.plan.keep.selected(start, stop)
        places = np.cumsum(kept) - 1
        pending = np.ones(stop - start, dtype=bool)
        for engine, rows in self._chunks(values, kept):
            chosen = {key: column[rows] for key, column in values.items()}
            is_kept = bool(kept[rows[0]])
            outcome, pending[rows], motions = engine.outcome(chosen, sampled=is_kept)
            _copy(columns, rows, outcome)
            if traces is not None and is_kept:
                _copy(traces, places[rows], motions)
        for row in np.flatnonzero(pending).tolist():
            single = self.single_runs.compute(start + row, start + row + 1)
            _copy(columns, np.array([row]), single.outcome)
            if traces is not None and single.traces is not None:
                _copy(traces, places[[row]], single.traces)
        return shard

    def _chunks(self, values: Values, kept: Array) -> Iterator[tuple["_VariantEngine", Array]]:
        """Yield the rows of members that run together, with the engine of their variant."""
        variants = values.get("controller.variant", np.array(list(self.plan.variants[:1])))
        for variant, engine in self.variant_engines.items():
            for is_kept in (False, True):
                rows = np.flatnonzero((variants == variant) & (kept == is_kept))
                if len(rows):
                    rows = rows[
                        engine.order({key: entries[rows] for key, entries in values.items()})
                    ]
                first = 0
                while first < len(rows):
                    # A motion that is kept needs more memory.
                    states = engine.ends + (len(engine.problem.times) if is_kept else 0)
                    size = max(SIMD, STATES_IN_MEMORY // states // SIMD * SIMD)
                    yield engine, rows[first : first + size]
                    first += size


def _copy(target: dict[str, Array], rows: Array, source: dict[str, Array]) -> None:
    """Copy arrays along members into those rows of the target that they have there."""
    for name in (source.keys() & target.keys()) - {TIME}:
        target[name][rows] = source[name]


def _can_run_in_batches(problem: Problem) -> bool:
    """Whether nothing interrupts the steps of a problem: no switch, projection or breakpoint."""
    return not (
        problem.switching or problem.project or problem.schedule.names or has_modes(problem.system)
    )


def _varies_passivity(plan: Plan, variant: str) -> bool:
    """Whether gains vary beside motors with a lag, which may be passive in some members alone."""
    elements = plan.initial_value_problems[variant].system.elements
    varied = {key.path[0] for key in plan.varied_keys_of(variant)}
    lags = any(isinstance(element, Lagged) for element in elements)
    return lags and not varied.isdisjoint({"controller", "elements"})


class _VariantEngine:
    """The batch engine of one variant, which has one set of equations."""

    def __init__(self, plan: Plan, variant: str) -> None:
        self.binding = Binding(plan, variant)
        self.problem = problem = self.binding.problem
        self.ensemble = ensemble = Ensemble(
            *(problem.system, problem.rtol, problem.times, self.binding.varies),
            quaternion=problem.quaternion,
        )
        self.extremes = EnsembleExtremes(ensemble)
        self.ends = ENDS_EXPECTED
        self.approached = ApproachedStates(problem.system, self._shared_rest_state())
        quantities = observed_in(problem.system)
        finals = {
            name: quantity for name, quantity in quantities.items() if quantity.end is not None
        }
        others = {
            name: quantity
            for name, quantity in quantities.items()
            if quantity.trace and name not in finals
        }
        observed = partial(Observed, ensemble.compiled, ensemble.symbolic)
        # v is compiled with peaks and their rates, as along the steps.
        peaks = {name: BY_NAME[name] for name in PEAKS}
        rates = {f"{n} rate": peaks[n]._replace(formula=peak.rate) for n, peak in PEAKS.items()}
        self.at_ends = observed(finals, peaks | rates | {TOTAL.name: TOTAL})
        self.in_traces = observed(others) if plan.keep.count(plan.members) else None

    def _shared_rest_state(self) -> SharedState | None:
        """Return the rest state nearest to the unloaded position, if all members share it."""
        varied = [key.path for key in self.binding.varied_keys]
        base = self.binding.base
        varies_load = any(path[0] == "gravity" for path in varied)
        loaded = any(base.gravity) or varies_load or bool(base.elements)
        at_rest = configurations(as_at_rest(self.problem.system))
        with np.errstate(all="ignore"):
            if all(map(is_of_initial_state, varied)):
                nearest = nearest_rest_state(self.problem.system)
                q = at_rest.configuration(nearest.motion, nearest.element_states)
                is_rest, shared = nearest.rests_in_range, SharedState(q, nearest.energy)
            else:
                # Without a load it is the unloaded position, where no energy is stored. Elements of
                # the config may pull there.
                q, is_rest, shared = at_rest.unloaded, not loaded, SharedState(None, 0.0)
            # A rest state that is unstable, or may be one of a family, is not shared: near it are
            # others.
            return shared if is_rest and rises(numerical_hessian(at_rest.gradient, q)) else None

    def order(self, values: Values) -> Array:
        """Return the order in which members are integrated, shape (m,): by their energy."""
        # A batch takes as many steps as its slowest member. Members of like energy take like
        # numbers of steps. The result of a member does not depend on the others in its batch.
        sizes = self.ensemble.energy_sizes(*self.binding.parameters_and_starts(values))
        return np.asarray(sizes.argsort(kind="stable"))

    def outcome(
        self, values: Values, *, sampled: bool
    ) -> tuple[dict[str, Array], Array, dict[str, Array]]:
        """Integrate members; return columns, whether each must run alone, and kept motions."""
        ensemble = self.ensemble
        parameters, starts = self.binding.parameters_and_starts(values)
        motions = ensemble.run(parameters, starts, sampled=sampled)
        self.ends = int(motions.steps.mean()) + 1
        times = self.problem.times[[0, -1]]
        quantities = self.at_ends.along(parameters, motions.boundary, times)
        # Members that were not integrated to the end are computed by single runs.
        last = np.where(motions.done, motions.boundary[: starts.shape[0], :, -1], np.nan)
        rest = self._rest_states(values, parameters, last, quantities["position"][:, -1].T)
        quantities |= {
            "time": times,
            "lyapunov": quantities[TOTAL.name] - rest.energy[:, np.newaxis],
            "energy_at_rest": rest.energy,
            "rest_orientation": rest.orientation,
            "rest_unstable": rest.unstable,
        }
        round_off = value_round_off(partial(ensemble.energies, parameters), starts)
        with np.errstate(all="ignore"):
            extremes, residuals = self.extremes.find(
                motions,
                quantities["orientation"][:, -1] - rest.orientation,
                *(rest.energy, round_off),
            )
            columns = outcome_of(quantities, extremes) | residuals
        columns["status"] = np.full(len(round_off), STATUSES.index(RunStatus.COMPLETED))
        columns["steps"] = motions.steps
        needs_single_run = ~motions.done | (motions.steps > self.problem.step_limit)
        for k in np.flatnonzero(self._may_have_left_range(columns) & ~needs_single_run).tolist():
            status = integrate(self._problem(values, k)).status
            needs_single_run[k] = status is not RunStatus.COMPLETED
        return columns, needs_single_run, self._along(motions, rest.energy)

    def _along(self, motions: Motions, rest_energy: Array) -> dict[str, Array]:
        """Return the quantities of traces of members; nothing if their motions are not kept."""
        if self.in_traces is None or motions.samples is None:
            return {}
        along = motions.parameters, motions.samples, self.problem.times
        quantities = self.at_ends.along(*along) | self.in_traces.along(*along)
        audits = motions.samples[self.problem.system.size :]
        v, change = quantities[TOTAL.name] - rest_energy[:, np.newaxis], audits[CHANGE_ROW]
        quantities |= {"lyapunov": v, "lyapunov_change": change}
        quantities["energy_residual"] = v - v[:, :1] - change
        return quantities | ({"supplied_energy": audits[0]} if self.extremes.supplies else {})

    def _rest_states(
        self, values: Values, parameters: Array, last: Array, X: Array
    ) -> RestStatesOfMembers:
        """Return the rest states at which v of each member is zero."""
        own_states = last[self.problem.system.coordinates.size :]
        pose = [last[THETA]] if self.approached.configurations.held else [last[THETA], X]
        rest = self.approached.find(parameters, np.concatenate([*pose, own_states]))
        for k in np.flatnonzero(~rest.approached & np.isfinite(last).all(axis=0)).tolist():
            system = self._problem(values, k).system
            motion = system.motion(last[: system.coordinates.size, k])
            with np.errstate(all="ignore"):
                zero = lyapunov_zero(system, motion, own_states[:, k], nearest_rest_state(system))
            rest.energy[k] = zero.rest.energy
            # NaN where no rest state is known that the member approaches.
            rest.orientation[k] = zero.rest.motion.Theta if zero.approached else np.nan
            rest.unstable[k] = is_unstable(system, zero.rest)
        return rest

    def _problem(self, values: Values, k: int) -> Problem:
        """Return the initial value problem of member k of these values."""
        row = {key: column[k] for key, column in values.items() if key != "controller.variant"}
        return problem_of(self.binding.config_of(row))

    def _may_have_left_range(self, columns: dict[str, Array]) -> Array:
        """Whether |θ2| may have reached the end of the range between steps, shape (m,)."""
        farthest = columns["peak_orientation"][:, 1] + columns["peak_orientation_error"]
        return ~(farthest < math.acos(self.problem.range_bound)) & (not self.problem.quaternion)
