"""Integration of many members of one structure: compiled Taylor integration in SIMD batches.

Each lane of a batch has its own parameters, state and steps. Its result does not depend on the
other lanes, to the last bit.
"""

from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.batch_grid import BatchGrid
from rbstab.integrate.heyoka.compiled_map import SIMD, evaluate_compiled
from rbstab.integrate.heyoka.symbols import (
    LARGEST_MISFIT,
    parameter_values,
    scaled_audit,
    state_symbols,
    symbols_of,
)
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import AUDIT_SIZE, LYAPUNOV_CHANGE, System

MAX_STEPS = 20_000
"""The maximum number of steps of a batch."""

# Sweeps have their own threads. heyoka's own threads would only wait and use processor time.
hy.set_nthreads(1)

GRID_COMPLETED = hy.taylor_outcome.time_limit
"""heyoka's name for the end of the grid."""


class EnsembleTrajectories(NamedTuple):
    """Trajectories of m members at n samples.

    The states at the samples of the ensemble are valid until it runs again. Their memory is reused,
    because allocating it costs as much as evaluating the states.

    Attributes:
        lanes: The states, shape (states, lanes, n). The lanes after the last member fill its batch.
        lyapunov_change: ∫v' dt, shape (m, n), J.
        steps: Accepted steps, shape (m,).
        done: Whether a member reached the last sample, shape (m,). The values of a member that did
            not are meaningless.
        first: The states at the ends of all parts of the first interval, shape (states, lanes,
            parts + 1), if the ensemble divides it and the samples are its own. Valid as the others.
        supplied_energy: ∫supplied dt, shape (m, n), J; None if no element supplies power.
    """

    lanes: Array
    lyapunov_change: Array
    steps: Array
    done: Array
    first: Array | None = None
    supplied_energy: Array | None = None

    @property
    def states(self) -> Array:
        """The states in the system's coordinates, shape (states, m, n)."""
        return self.lanes[:, : len(self.steps)]

    def in_first_interval(self, members: Array) -> "EnsembleTrajectories":
        """Return the trajectories of some members, shape (k,), in the divided first interval."""
        assert self.first is not None
        # Complete batches, as in `Ensemble.run`.
        full = np.minimum(np.arange(-(-len(members) // SIMD) * SIMD), len(members) - 1)
        lanes = np.take(self.first, members[full], axis=1)
        # Nobody asks for v within the first interval.
        change = np.full((len(members), lanes.shape[2]), np.nan)
        return EnsembleTrajectories(lanes, change, self.steps[members], self.done[members])


class ObservedTrajectories(NamedTuple):
    """The observed quantities of m members at n samples.

    Attributes:
        values: E and Θ, shape (6, m, n), m, inertial, and rad.
        rates: F = Ė and Θ̇ = BΩ, shape (6, m, n), m/s, inertial, and rad/s.
        energy: The sum of all energies, shape (m, n), J.
    """

    values: Array
    rates: Array
    energy: Array

    @property
    def E(self) -> Array:
        """E, shape (3, m, n), m, inertial."""
        return self.values[:3]

    @property
    def F(self) -> Array:
        """F, shape (3, m, n), m/s, inertial."""
        return self.rates[:3]

    @property
    def Theta_rate(self) -> Array:
        """Θ̇ = BΩ, shape (3, m, n), rad/s."""
        return self.rates[3:]


class ObservedPositions(NamedTuple):
    """X, m, and V, m/s, of m members at n samples, shape (3, m, n) each, inertial."""

    X: Array
    V: Array


OBSERVED_SIZE = 4 * 3 + 1
"""The number of values of `ObservedTrajectories` at one sample."""


class Ensemble:
    """The compiled equations of a structure, integrated for many members.

    Args:
        system: Any system of the structure.
        tolerance: heyoka's tolerance.
        times: The samples, shape (n,), s.
        varies: Which parameters differ between members, shape (parameters,); by default all. The
            others are compiled in, with the values of `system`: zeros and products of constants
            then cost nothing.
        parts: The parts of the first interval between samples; see `EnsembleTrajectories.first`.
    """

    def __init__(
        self,
        system: System,
        tolerance: float,
        times: Array,
        varies: Array | None = None,
        parts: int = 1,
    ) -> None:
        values = parameter_values(system)
        varies = np.ones(len(values), dtype=bool) if varies is None else varies
        symbol_indices = np.cumsum(varies) - 1
        self.open_indices = np.flatnonzero(varies)

        def symbol(index: int) -> Any:
            constant = hy.expression(float(values[index]))
            return hy.par[int(symbol_indices[index])] if varies[index] else constant

        symbolic, _, _ = symbols_of(system, symbol)
        self.size, self.audited_size = system.size, system.audited_size
        self.times = times
        self.batch = SIMD
        y = state_symbols(system.audited_size)
        self.symbolic, self.symbols, self.timed = symbolic, y, system.timed
        scale = hy.par[len(self.open_indices)]
        # The samples of a run count from its start, which may be any time of the motion.
        self.time = hy.time + hy.par[len(self.open_indices) + 1] if self.timed else hy.time
        rates = scaled_audit(symbolic.audited_rates(y, self.time), system.size, scale)
        self.integrator = hy.taylor_adaptive_batch(
            list(zip(y, rates, strict=True)),
            state=np.zeros((len(y), self.batch)),
            tol=tolerance,
            # A member that ends there is not done, and so runs again alone.
            t_events=[hy.t_event_batch(event) for event in symbolic.clearances(y)],
        )
        # Views of the integrator's memory: getting them takes as long as a step.
        self._pars, self._state = self.integrator.pars, self.integrator.state
        first = np.linspace(times[0], times[1], parts + 1)
        self.parts = parts
        self.grid = BatchGrid.of(np.concatenate([first[:-1], times[1:]]), self.batch)
        observation = symbolic.observe(y[: system.size])
        motion = observation.motion
        energies = [hy.expression(0.0) + entry for entry in observation.energy.tolist()]
        constant = hy.expression(0.0)

        def compiled(vectors: list[Array], *others: Any) -> Any:
            entries = [constant + entry for vector in vectors for entry in vector.tolist()]
            return hy.cfunc([*entries, *others], vars=list(y[: system.size]))

        along = [motion.E, motion.Theta, motion.F, motion.B @ motion.Omega]
        self.observed = compiled(along, sum(energies))
        self.positions = compiled([motion.X, motion.V])
        self.energies = hy.cfunc(energies, vars=list(y[: system.size]))
        self._buffers: dict[str, Array] = {}

    def scales(self, parameters: Array, starts: Array) -> Array:
        """Return the energy scale of each member at its start, shape (m,), J.

        It is 1 J if the energies are zero or not finite.

        Args:
            parameters: Shape (parameters, m), in the order of `parameter_values`.
            starts: Shape (states, m).
        """
        size = self._initial_energies(parameters, starts)
        return np.where((size > 0) & (size < np.inf), size, 1.0)

    def _initial_energies(self, parameters: Array, starts: Array) -> Array:
        """Return the sum of the absolute energies of each member at its start, shape (m,), J."""
        with np.errstate(all="ignore"):
            open_parameters = parameters[self.open_indices][: self.energies.nparams]
            energies = evaluate_compiled(self.energies, starts, open_parameters)
            return np.asarray(np.abs(energies).sum(axis=0))

    def run(
        self,
        parameters: Array,
        starts: Array,
        times: Array | None = None,
        begin: Array | None = None,
    ) -> EnsembleTrajectories:
        """Integrate members over the samples.

        Args:
            parameters: Shape (parameters, m).
            starts: The initial states, shape (states, m).
            times: Other samples, shape (n,), s. Trajectories at other samples stay valid. More
                samples between the same ends do not change a trajectory.
            begin: The time of the start of each member, shape (m,), s, which is added to the
                samples; default 0.
        """
        begin = np.zeros(starts.shape[1]) if begin is None else begin
        scales = self.scales(parameters, starts)
        found = self._run(parameters, starts, scales, times, begin)
        if self.audited_size > self.size + AUDIT_SIZE:
            self._repeat_misfits(found, parameters, starts, scales, times, begin)
        lanes = found.states
        change = lanes[LYAPUNOV_CHANGE, : starts.shape[1]] * scales[:, np.newaxis]
        members, supplied, first = slice(starts.shape[1]), None, None
        if self.audited_size > self.size + AUDIT_SIZE:
            supplied = lanes[self.size, members] * scales[:, np.newaxis]
        if times is None and self.parts > 1:
            first = found.first[: self.size]
        steps, done = found.steps[members], found.done[members]
        return EnsembleTrajectories(
            lanes[: self.size], change, steps, done, first=first, supplied_energy=supplied
        )

    def _repeat_misfits(  # noqa: PLR0913, PLR0917 (all that a run depends on)
        self,
        found: "_Lanes",
        parameters: Array,
        starts: Array,
        scales: Array,
        times: Array | None,
        begin: Array,
    ) -> None:
        """Integrate members again whose scale does not fit to what was supplied.

        See `symbols.fitting_scale`. The scales change in place.
        """
        members = len(scales)
        audits = np.abs(found.states[[self.size, LYAPUNOV_CHANGE], :members]).max(axis=(0, 2))
        initial = self._initial_energies(parameters, starts)
        sizes = initial + audits * scales
        misfits = (sizes > LARGEST_MISFIT * scales) | (sizes < scales / LARGEST_MISFIT)
        rows = np.flatnonzero(misfits & (sizes > 0) & np.isfinite(sizes) & found.done[:members])
        if not len(rows):
            return
        scales[rows] = sizes[rows]
        repeated = self._run(
            parameters[:, rows],
            starts[:, rows],
            scales[rows],
            times,
            begin[rows],
            reuse=False,
        )
        for name in ("states", "first", "steps", "done"):
            target, source = getattr(found, name), getattr(repeated, name)
            if name in {"states", "first"}:
                target[:, rows] = source[:, : len(rows)]
            else:
                target[rows] = source[: len(rows)]

    def _run(  # noqa: PLR0913 (all that a run depends on)
        self,
        parameters: Array,
        starts: Array,
        scales: Array,
        times: Array | None,
        begin: Array,
        *,
        reuse: bool = True,
    ) -> "_Lanes":
        """Integrate members with these energy scales; see `run`."""
        members = starts.shape[1]
        # Complete batches: the last lanes repeat the last member.
        full = np.minimum(np.arange(-(-members // self.batch) * self.batch), members - 1)
        grid = self.grid if times is None else BatchGrid.of(times, self.batch)
        parts = self.parts if times is None else 1
        shape = (self.audited_size, len(full), len(grid) - parts + 1)
        audits = np.zeros((self.audited_size - self.size, members))
        pars = np.vstack([parameters[self.open_indices], scales, begin])
        lanes = _Lanes(
            # heyoka has no `par[]` after the last one that the equations use.
            pars[: len(self.integrator.pars), full],
            np.vstack([starts, audits])[:, full],
            self._buffer("states", shape) if times is None and reuse else np.empty(shape),
            np.empty((self.audited_size, len(full), parts + 1)),
            np.zeros(len(full), dtype=int),
            np.zeros(len(full), dtype=bool),
            grid,
        )
        for first in range(0, len(full), self.batch):
            self._integrate_batch(slice(first, first + self.batch), lanes)
        self._check_finite(lanes)
        # One failing lane can stop the whole batch. So each unfinished member runs again, in a
        # batch that contains only this member.
        for lane in np.flatnonzero(~lanes.done[:members]).tolist():
            self._integrate_batch(slice(lane, lane + 1), lanes)
        self._check_finite(lanes)
        return lanes

    def _integrate_batch(self, chosen: slice, lanes: "_Lanes") -> None:
        """Integrate one batch: members in all its lanes, or one member in every lane."""
        integrator = self.integrator
        integrator.set_time(lanes.grid.entries[0])
        self._pars[:] = lanes.parameters[:, chosen]
        self._state[:] = lanes.starts[:, chosen]
        _, found = integrator.propagate_grid(lanes.grid, max_steps=MAX_STEPS)
        used = chosen.stop - chosen.start
        sampled = found.transpose(1, 2, 0)[:, :used]
        parts = lanes.first.shape[2] - 1
        lanes.states[:, chosen, 1:] = sampled[..., parts:]
        lanes.states[:, chosen, 0] = sampled[..., 0]
        if parts > 1:
            lanes.first[:, chosen] = sampled[..., : parts + 1]
        outcomes = integrator.propagate_res[:used]
        lanes.steps[chosen] = [taken for _, _, _, taken in outcomes]
        lanes.done[chosen] = [outcome == GRID_COMPLETED for outcome, _, _, _ in outcomes]

    @staticmethod
    def _check_finite(lanes: "_Lanes") -> None:
        """A state that became infinite or NaN stays so: the last sample is enough."""
        lanes.done[:] &= np.isfinite(lanes.states[..., -1]).all(axis=0)

    def observe(
        self, parameters: Array, trajectories: EnsembleTrajectories, *, reuse: bool = True
    ) -> ObservedTrajectories:
        """Return the observed quantities at the samples of a run.

        Args:
            parameters: Shape (parameters, m).
            trajectories: The result of `run`.
            reuse: Whether memory is reused. Then the result is valid until the next such call.
        """
        # Complete batches are complete SIMD vectors; see `evaluate_compiled`.
        size, full, samples = trajectories.lanes.shape
        shape = (OBSERVED_SIZE, full * samples)
        found = self._buffer("observed", shape) if reuse else np.empty(shape)
        chosen = parameters[self.open_indices][: self.observed.nparams]
        self.observed(
            trajectories.lanes.reshape(size, full * samples),
            pars=self._repeat_for_samples(chosen, full, samples),
            outputs=found,
        )
        rows = found.reshape(OBSERVED_SIZE, full, samples)[:, : len(trajectories.steps)]
        return ObservedTrajectories(rows[:6], rows[6:12], rows[12])

    def observe_positions(
        self, parameters: Array, trajectories: EnsembleTrajectories, *, only_last: bool
    ) -> ObservedPositions:
        """Return X and V at all samples of a run, or only at the last one (n = 1).

        Args:
            parameters: Shape (parameters, m).
            trajectories: The result of `run`.
            only_last: Whether the other samples are left out.
        """
        lanes = trajectories.lanes[..., -1:] if only_last else trajectories.lanes
        size, full, samples = lanes.shape
        chosen = parameters[self.open_indices][: self.positions.nparams]
        found = self.positions(
            np.ascontiguousarray(lanes.reshape(size, full * samples)),
            pars=self._repeat_for_samples(chosen, full, samples),
        )
        rows = found.reshape(6, full, samples)[:, : len(trajectories.steps)]
        return ObservedPositions(rows[:3], rows[3:])

    def _buffer(self, name: str, shape: tuple[int, ...]) -> Array:
        """Return an array of a shape; calls with the same name reuse its memory."""
        size = int(np.prod(shape))
        if name not in self._buffers or self._buffers[name].size < size:
            self._buffers[name] = np.empty(size)
        return self._buffers[name][:size].reshape(shape)

    def _repeat_for_samples(self, chosen: Array, full: int, samples: int) -> Array:
        """Repeat the parameters of each member for each of its samples."""
        found = self._buffer("parameters", (len(chosen), full, samples))
        found[:, : chosen.shape[1]] = chosen[:, :, np.newaxis]
        found[:, chosen.shape[1] :] = chosen[:, -1:, np.newaxis]
        return found.reshape(len(chosen), full * samples)


class _Lanes(NamedTuple):
    """Inputs and outputs of a run. The lanes are the last axis.

    In `states` and in those of the divided first interval they are the middle one.
    """

    parameters: Array
    starts: Array
    states: Array
    first: Array
    steps: Array
    done: Array
    grid: BatchGrid


def parameters_and_start(system: System, start: Array) -> Array:
    """Return the numbers that define a member: its parameters, then its initial state."""
    return np.concatenate([parameter_values(system), start])
