"""The extrema of members that are integrated in batches, and when they settle."""

import numpy as np

from rbstab.analysis.extrema import Steps, along, farthest_from_zero, last_above
from rbstab.analysis.lyapunov import energy_scale
from rbstab.analysis.run_extremes import (
    PARTS_IN_QUATERNIONS,
    SETTLED_DISTANCE,
    SQUARE,
    THETA_ROWS,
    VALUE,
    Extremes,
    leave_open,
    pitch_of_sine,
    watched_at,
)
from rbstab.analysis.settling import settling_times
from rbstab.integrate.heyoka.compiled_map import SIMD
from rbstab.integrate.heyoka.ensemble import CHANGE_ROW, Ensemble, Motions
from rbstab.integrate.heyoka.observed import OfMembers
from rbstab.integrate.heyoka.symbols import state_symbols
from rbstab.mechanics.attitude import half_sine_squared_rate
from rbstab.mechanics.numbers import Array, Number
from rbstab.systems.quantities import BY_NAME, PEAKS, total_energy, values_of
from rbstab.systems.system import Observation


class EnsembleExtremes:
    """What is watched along the steps of a structure and its rates, compiled.

    Args:
        ensemble: The ensemble of the structure.
    """

    def __init__(self, ensemble: Ensemble) -> None:
        self.ensemble, self.supplies = ensemble, ensemble.moving.supplies
        self.watched = ensemble.compiled(ensemble.moving, _watched_with_rates)
        y, rates = state_symbols(ensemble.size), ensemble.audited_rates[: ensemble.size]
        self.rates = OfMembers(rates, y, ensemble.open_indices)

    def find(
        self,
        motions: Motions,
        from_rest: Array,
        rest_energy: Array,
        round_off: Array,
    ) -> tuple[Extremes, dict[str, Array]]:
        """Return the extremes of members, and their columns of the energy residual.

        Args:
            motions: The motions of the members.
            from_rest: Θ at the end minus Θ of the rest state, shape (m, 3), rad.
            rest_energy: The energy of that state, shape (m,), J.
            round_off: The energy below which v is round-off, shape (m,), J.
        """
        member_steps = _StepsOfMembers(self, motions, rest_energy)
        steps, supplies = member_steps.steps(), self.supplies
        extrema = farthest_from_zero(steps)
        if self.ensemble.q is not None:
            extrema = pitch_of_sine(extrema)
        largest = extrema.value[VALUE]
        settling = settling_times(steps, VALUE, largest, from_rest, round_off, supplied=supplies)
        near = last_above(steps, SQUARE, np.full(len(steps.first), SETTLED_DISTANCE**2))
        v = steps.values[0][VALUE]
        residual = v - v[steps.first][member_steps.member] - member_steps.audits[CHANGE_ROW]
        residual, *sizes = (
            np.maximum.reduceat(np.abs(row), steps.first)
            for row in (residual, v, *member_steps.audits[:supplies])
        )
        sizes = [size[:, np.newaxis] for size in sizes]
        columns = {
            "energy_residual": residual,
            "energy_scale": energy_scale(sizes[0], round_off, *sizes[1:]),
        }
        return Extremes(extrema, settling, near), columns


def _watched_with_rates(seen: Observation) -> list[Number]:
    """Return what is watched at a state, and then its rates."""
    motion, rates = seen.motion, [peak.rate(seen) for peak in PEAKS.values()]
    (v_rate,) = values_of([BY_NAME["lyapunov_rate"]], seen)
    return [
        *watched_at(seen),
        total_energy(seen.energy.tolist()),
        *np.concatenate(rates).tolist(),
        2.0 * (motion.E @ motion.F),
        half_sine_squared_rate(motion.A, motion.Omega),
        v_rate,
    ]


class _StepsOfMembers:
    """The steps of members, one after the other."""

    def __init__(self, compiled: EnsembleExtremes, motions: Motions, rest_energy: Array) -> None:
        # The energies of the rest states have the shape (m,), J.
        self._compiled, self._motions, self._rest = compiled, motions, rest_energy
        self._parameters, self._q = motions.parameters, compiled.ensemble.q
        ends, angles = motions.ends, motions.angles
        counts = np.array([member_ends.shape[1] for member_ends in ends])
        # Complete SIMD vectors: the last member stays at its end.
        more = -counts.sum() % SIMD
        counts[-1] += more
        together = np.concatenate([*ends, np.repeat(ends[-1][:, -1:], more, axis=1)], axis=1)
        self._angles = np.concatenate([angles, np.repeat(angles[:, -1:], more, axis=1)], axis=1)
        size = compiled.ensemble.size
        self._times, self._audited = together[0], together[1:]
        self._states = self._audited[:size]
        # The member of each end, shape (n,).
        self.member = np.repeat(np.arange(len(counts)), counts)
        # The audit states at the ends, J.
        self.audits = self._audited[size:] * motions.scales[self.member]
        self._first = np.cumsum(counts) - counts
        self._last = self._first + counts - 1
        self._after = self._at_end(np.arange(len(self._times)))
        self._table = np.empty(0)
        self._lengths = self._times[self._after] - self._times

    def steps(self) -> Steps:
        """Return the steps; the last end of each member begins one of no length."""
        at_begin = self._observed(self._states, self._times, self.member)
        if self._q is not None:
            at_begin[0, THETA_ROWS][::2] = self._angles[::2]
        self._table = table = np.array([at_begin, self._at_end(at_begin)])
        if self._q is not None:
            leave_open(table, self._q, self._states, self._after, self._lengths, self._first)
        return Steps(
            *(self._first, self._times, self._lengths, table),
            *(self._derivatives, self._divide),
        )

    def _at_end(self, rows: Array) -> Array:
        """Return what is at the ends of steps, from what is at their begins."""
        ends = np.empty_like(rows)
        ends[..., :-1] = rows[..., 1:]
        ends[..., self._last] = rows[..., self._last]
        return ends

    def _derivatives(self, quantity: Array, step: Array) -> Array:
        """Return second and third derivatives at both ends of steps (see `Steps`)."""
        chosen, inverse = np.unique(step, return_inverse=True)
        both, of = np.append(chosen, self._after[chosen]), np.tile(self.member[chosen], 2)
        derivatives = along(
            lambda y, t: self._observed(y, t, of),
            lambda y, t: self._compiled.rates.at(self._parameters, y, t, of),
            self._states[:, both],
            self._times[both],
            np.tile(self._lengths[chosen], 2),
        ).reshape(2, VALUE + 1, 2, -1)
        return np.moveaxis(derivatives, 2, 0)[:, :, quantity, inverse]

    def _divide(self, step: int) -> Steps | None:
        """Return a step as shorter ones, from its Taylor polynomials; None if it has no length."""
        begin, end, of = self._times[step], self._times[self._after[step]], self.member[[step]]
        if begin == end:
            return None
        motions, times = self._motions, np.linspace(begin, end, PARTS_IN_QUATERNIONS + 1)
        parameters, scales = motions.parameters[:, of], motions.scales[of]
        ensemble, start = self._compiled.ensemble, self._audited[:, step]
        audited = ensemble.step_again(parameters[:, 0], scales[0], start, times)
        if audited is None:
            return None
        angles = motions.angles
        if self._q is not None:
            alone = np.zeros(len(times), dtype=int)
            angles, _ = self._q.angles_along(audited, times, self._angles[:, [step]], alone)
        ends = [np.vstack([times, audited])]
        part = motions._replace(parameters=parameters, ends=ends, scales=scales, angles=angles)
        parts = _StepsOfMembers(self._compiled, part, self._rest[of])
        return parts.steps()._replace(divide=lambda _: None)

    def _observed(self, y: Array, t: Array, of: Array) -> Array:
        """Return what is watched and its rates at states of members, shape (2, q, p)."""
        observed = self._compiled.watched.at(self._parameters, y, t, of).reshape(2, VALUE + 1, -1)
        observed[0, VALUE] -= self._rest[of]
        if self._q is not None:
            observed[:, THETA_ROWS] = self._q.watched(y)
        return observed
