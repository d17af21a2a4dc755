"""Integration of many members of one structure: compiled Taylor integration in SIMD batches."""

from io import BytesIO
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compiled_map import SIMD
from rbstab.integrate.heyoka.observed import OfMembers
from rbstab.integrate.heyoka.symbols import (
    fitting_scales,
    parameter_values,
    scaled_audit,
    scales_of,
    state_symbols,
    symbols_of,
)
from rbstab.integrate.in_quaternions import LONGEST_TURN, in_quaternions
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA
from rbstab.systems.coordinates import QuaternionCoordinates
from rbstab.systems.system import CONTACT_WORK, System

# Sweeps have their own threads. heyoka's own threads would only wait and use processor time.
hy.set_nthreads(1)

CHANGE_ROW = -1
"""The row of ∫v' dt in audited states of members. ε, the audit state after it in a system, is left
out: no member in a batch has a law that needs it, and it takes a tenth of the time."""

COMPLETED = hy.taylor_outcome.time_limit
"""heyoka's name for the end of the samples."""

MAX_STEPS = 20_000
"""The maximum number of steps of a batch."""


class Motions(NamedTuple):
    """The motions of m members. Those of a member that is not done are meaningless.

    Attributes:
        parameters: Their parameters, shape (parameters, m).
        ends: For each member the times and the audited states of the integrator at the ends of its
            steps, shape (1 + states, ends); audit states in units of their scales.
        scales: The scales of the audit states, shape (m,), J.
        angles: Θ there, with θ1 and θ3 continued, for all members one after the other, shape
            (3, ends), rad; empty without quaternions.
        steps: Accepted steps, shape (m,).
        done: Whether a member reached its end, shape (m,).
        boundary: The audited states with Θ at the start and at the end, shape (states, m, 2).
        samples: The same at all samples, shape (states, m, n); None if none are taken.
    """

    parameters: Array
    ends: list[Array]
    scales: Array
    angles: Array
    steps: Array
    done: Array
    boundary: Array
    samples: Array | None


class Ensemble:
    """The compiled equations of a structure, integrated for many members.

    The result of a member does not depend on the other members, to the last bit. The `par[]` of the
    integrator are the parameters that differ between members, and the scales of their audit states:
    the sums of their absolute energies at the start, J, as heyoka's error is relative to the
    largest state.

    Args:
        system: Any system of the structure.
        tolerance: heyoka's tolerance.
        times: The samples, shape (n,), s.
        varies: Which parameters differ between members, shape (parameters,); by default all. The
            others are compiled in, with the values of `system`: zeros and products of constants
            then cost nothing.
        quaternion: Whether a quaternion is integrated in place of Θ.

    Attributes:
        symbolic: The system of symbols.
        moving: The one that is integrated: in quaternions, or the same.
        q: The coordinates with a quaternion that the integrator has; None if it has none.
        audited_rates: The rates of the integrated states, with those of audit states in W.
        open_indices: The indices of the parameters that differ between members.
    """

    def __init__(
        self,
        system: System,
        tolerance: float,
        times: Array,
        varies: Array | None = None,
        *,
        quaternion: bool = False,
    ) -> None:
        values = parameter_values(system)
        varies = np.ones(len(values), dtype=bool) if varies is None else varies
        numbers = np.cumsum(varies) - 1
        self.open_indices = np.flatnonzero(varies)

        def symbol(index: int) -> Any:
            constant = hy.expression(float(values[index]))
            return hy.par[int(numbers[index])] if varies[index] else constant

        self.times = times
        self.symbolic, _, _ = symbols_of(system, symbol)
        self.moving = self.symbolic
        self.q: QuaternionCoordinates | None = None
        if quaternion:
            self.moving, self.q = in_quaternions(self.symbolic)
        self.size = self.moving.size
        y = state_symbols(self.moving.audited_size + CONTACT_WORK)
        self.audited_rates = self.moving.audited_rates(y, hy.time)[:CONTACT_WORK]
        rates = scaled_audit(self.audited_rates, self.size, hy.par[len(self.open_indices)])
        self._integrator = hy.taylor_adaptive_batch(
            list(zip(y, rates, strict=True)),
            state=np.zeros((len(y), SIMD)),
            tol=tolerance,
            # A member that ends there is not done, and so runs again alone.
            t_events=[hy.t_event_batch(event) for event in self.moving.clearances(y)],
        )
        # Views of the integrator's memory: getting them takes as long as a step.
        self._pars, self._state = self._integrator.pars, self._integrator.state
        self._views = [memoryview(view).cast("B") for view in (self._integrator.time, self._state)]
        self._ends = BytesIO()
        self._energies = self.compiled(self.symbolic, lambda seen: seen.energy.tolist())

    def compiled(self, system: System, formula: Any) -> OfMembers:
        """Return numbers of an `Observation` as a compiled function, for all members.

        Args:
            system: `symbolic`, for states with Θ, or `moving`.
            formula: Returns the numbers.
        """
        y = state_symbols(system.size)
        return OfMembers(formula(system.observe(y, hy.time)), y, self.open_indices)

    def energies(self, parameters: Array, states: Array) -> Array:
        """Return the energy of each part of each member, shape (parts, m), J.

        Args:
            parameters: Shape (parameters, m).
            states: With Θ, shape (states, m).
        """
        members = np.arange(states.shape[1])
        return self._energies.at(parameters, states, np.zeros(len(members)), members)

    def energy_sizes(self, parameters: Array, states: Array) -> Array:
        """Return the sum of the absolute energies of each member, shape (m,), J."""
        with np.errstate(all="ignore"):
            # Row by row: numpy sums the parts of a single member in another order.
            return np.asarray(sum(np.abs(self.energies(parameters, states))))

    def run(self, parameters: Array, starts: Array, *, sampled: bool = True) -> Motions:
        """Integrate members.

        Args:
            parameters: Shape (parameters, m).
            starts: The initial states with Θ, shape (states, m).
            sampled: Whether samples are taken. They change no step.
        """
        sizes = self.energy_sizes(parameters, starts)
        scales = scales_of(sizes)
        moving = starts if self.q is None else self.q.from_angles(starts)
        run = _Batches(self, self.times if sampled else self.times[[0, -1]])
        run.integrate(parameters, moving, scales, np.arange(starts.shape[1]))
        if self.symbolic.supplies:
            audits = np.array([np.abs(ends[1 + self.size :, -1]).max() for ends in run.ends])
            fitting = fitting_scales(sizes + audits * scales, scales)
            misfits = np.flatnonzero((fitting != scales) & run.done)
            scales[misfits] = fitting[misfits]
            run.integrate(parameters, moving, scales, misfits)
        return self._motions(parameters, run, starts[THETA], scales, sampled)

    def _motions(
        self, parameters: Array, run: "_Batches", Theta: Array, scales: Array, sampled: bool
    ) -> Motions:
        """Return motions with Θ and with audit states in J."""
        audits, samples = slice(self.size, None), run.samples
        samples[audits] *= scales[:, np.newaxis]
        angles = np.empty((3, 0))
        if self.q is not None:
            size, count, members = self.q.size, len(run.times), np.arange(len(run.ends))
            counts = [ends.shape[1] for ends in run.ends]
            y = [samples[:size].reshape(size, -1), *(ends[1 : 1 + size] for ends in run.ends)]
            times = [np.tile(run.times, len(members)), *(ends[0] for ends in run.ends)]
            of = np.append(np.repeat(members, count), np.repeat(members, counts))
            along, turns = self.q.angles_along(
                np.concatenate(y, axis=1), np.concatenate(times), Theta, of
            )
            samples[THETA] = along[:, : -sum(counts)].reshape(3, -1, count)
            angles = along[:, -sum(counts) :]
            # A member whose steps do not tell how it turns past θ2 = ±90° is not done.
            run.done &= turns <= LONGEST_TURN
            samples = np.delete(samples, size - 1, axis=0)
        boundary = samples[..., [0, -1]]
        return Motions(
            *(parameters, run.ends, scales, angles, run.steps, run.done, boundary),
            samples if sampled else None,
        )

    def step_again(
        self, parameters: Array, scale: float, start: Array, times: Array
    ) -> Array | None:
        """Return the audited states of the integrator within a step, shape (states, n).

        They are those of its Taylor polynomials; None if the step does not reach its end again.

        Args:
            parameters: The parameters of the member, shape (parameters,).
            scale: The scale of its audit states, J.
            start: The audited state at the begin of the step, shape (states,).
            times: The times, the first at the begin and the last at the end, shape (n,), s.
        """
        pars = np.append(parameters[self.open_indices], scale)
        lanes = (np.repeat(row[:, np.newaxis], SIMD, axis=1) for row in (pars, start, times))
        samples, results, _ = self.integrate_batch(*lanes)
        return samples[..., 0].T if results[0][0] == COMPLETED else None

    def integrate_batch(self, pars: Array, starts: Array, grid: Array) -> tuple[Array, ...]:
        """Integrate one batch.

        Args:
            pars: The values of heyoka's parameters, shape (parameters, SIMD), or more rows.
            starts: The audited initial states, shape (states, SIMD).
            grid: The times of the samples, shape (n, SIMD), s.

        Returns:
            The samples, shape (n, states, SIMD), what heyoka says of each lane, and the times and
            states at the ends of steps, shape (1 + states, SIMD, ends).
        """
        self._integrator.set_time(grid[0, 0])
        self._pars[:] = pars[: len(self._pars)]  # heyoka has none after the last that is used.
        self._state[:] = starts
        self._ends.seek(0)
        self._write_end(self._integrator)
        _, samples = self._integrator.propagate_grid(
            grid, max_steps=MAX_STEPS, callback=self._write_end
        )
        ends = np.frombuffer(self._ends.getbuffer(), count=self._ends.tell() // 8)
        ends = ends.reshape(-1, len(self._state) + 1, SIMD).transpose(1, 2, 0).copy()
        return samples, self._integrator.propagate_res, ends

    def _write_end(self, _: Any) -> bool:
        """Keep the time and the state at the end of a step."""
        for view in self._views:
            self._ends.write(view)
        return True


class _Batches:
    """The integration of members, one batch after the other."""

    def __init__(self, ensemble: Ensemble, times: Array) -> None:
        # The samples are at `times`, shape (n,), s.
        self._ensemble, self.times = ensemble, times
        self._grid = np.repeat(times[:, np.newaxis], SIMD, axis=1)
        self.ends: list[Array] = []

    def integrate(self, parameters: Array, starts: Array, scales: Array, rows: Array) -> None:
        """Integrate some of the members, in the same order as before."""
        if not self.ends:
            members, states = starts.shape[1], self._ensemble.moving.audited_size + CONTACT_WORK
            self.ends = [np.empty(0)] * members
            self.samples = np.empty((states, members, len(self.times)))
            self.steps, self.done = np.zeros(members, dtype=int), np.zeros(members, dtype=bool)
            audits = np.zeros((states - len(starts), members))
            self._starts = np.vstack([starts, audits])
        self._pars = np.vstack([parameters[self._ensemble.open_indices], scales])
        for first in range(0, len(rows), SIMD):
            self._batch(rows[first : first + SIMD])
        self._check_finite(rows)
        # One failing lane can stop the whole batch. So each unfinished member runs again, in a
        # batch that contains only this member.
        for row in rows[~self.done[rows]]:
            self._batch(np.array([row]))
        self._check_finite(rows)

    def _check_finite(self, rows: Array) -> None:
        """A state that became infinite or NaN stays so: the last one is enough."""
        self.done[rows] &= np.isfinite(self.samples[:, rows, -1]).all(axis=0)

    def _batch(self, rows: Array) -> None:
        """Integrate one batch; the last member also fills the lanes that are left."""
        lanes = rows[np.minimum(np.arange(SIMD), len(rows) - 1)]
        samples, results, ends = self._ensemble.integrate_batch(
            self._pars[:, lanes], self._starts[:, lanes], self._grid
        )
        self.samples[:, rows] = samples.transpose(1, 2, 0)[:, : len(rows)]
        for lane, row in enumerate(rows.tolist()):
            outcome, _, _, self.steps[row] = results[lane]
            self.ends[row] = ends[:, lane, : self.steps[row] + 1]
            self.done[row] = outcome == COMPLETED
