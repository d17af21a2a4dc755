"""The extrema of members that are integrated in batches, and when they settle."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rbstab.analysis.extrema import Steps, along, farthest_from_zero, last_above
from rbstab.analysis.lyapunov import energy_scale
from rbstab.analysis.run_extremes import (
    SETTLED_DISTANCE,
    SQUARE,
    THETA_ROWS,
    VALUE,
    Extremes,
    divided,
    leave_open,
    pitch_of_sine,
)
from rbstab.analysis.settling import settling_times
from rbstab.integrate.heyoka.compiled_map import SIMD, lanes_of
from rbstab.integrate.heyoka.ensemble.compiled import CHANGE_ROW
from rbstab.integrate.heyoka.ensemble.ensemble import Ensemble
from rbstab.integrate.heyoka.ensemble.trajectories import EnsembleTrajectories
from rbstab.integrate.heyoka.symbols import state_symbols
from rbstab.integrate.in_quaternions import in_quaternions
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.quaternion import beyond_ends
from rbstab.sweep.members.outcome import MemberTrajectories
from rbstab.systems.system import System


class EnsembleExtremes:
    """The compiled rates of a structure and what is watched along its steps.

    Args:
        ensemble: The ensemble of the structure.
    """

    def __init__(self, ensemble: Ensemble) -> None:
        self.structure = structure = ensemble.compiled
        size, audited = structure.size, structure.audited_rates
        observed = structure.moving.observe(state_symbols(size))
        motion = observed.motion
        E, F, Theta_rate = motion.E, motion.F, motion.B @ motion.Omega
        values = [*E, *motion.Theta, E @ E, sum(observed.energy.tolist())]
        slopes = [*F, *Theta_rate, 2.0 * (E @ F), audited[CHANGE_ROW]]
        self.watched = structure.function([*values, *slopes], size)
        self.rates = structure.function(audited[:size], size)

    def find(
        self,
        parameters: Array,
        trajectories: EnsembleTrajectories,
        members: MemberTrajectories,
        system_of: Callable[[int], System],
    ) -> tuple[Extremes, dict[str, Array]]:
        """Return the extremes of members, and their columns of the energy residual.

        Args:
            parameters: Shape (parameters, m).
            trajectories: The trajectories of the members.
            members: Their quantities.
            system_of: Returns the system of a member.
        """
        found = _StepsOfMembers(self, parameters, trajectories, members, system_of)
        steps, is_driven = found.steps(), trajectories.supplied_energy is not None
        extrema = farthest_from_zero(steps)
        if self.structure.q is not None:
            extrema = pitch_of_sine(extrema)
        settling = settling_times(
            steps,
            VALUE,
            extrema.value[VALUE],
            members.orientation[:, -1] - members.rest_orientation,
            members.energy_round_off,
            supplied=is_driven,
        )
        level = np.full(len(steps.first), SETTLED_DISTANCE**2)
        audits = found.audits * trajectories.scales[found.member]
        v = steps.values[0][VALUE]
        residual = v - v[steps.first][found.member] - audits[CHANGE_ROW]
        largest = [
            np.maximum.reduceat(np.abs(row), steps.first)[:, np.newaxis]
            for row in (residual, v, *(audits[:1] if is_driven else ()))
        ]
        scale = energy_scale(largest[1], members.energy_round_off, *largest[2:])
        columns = {"energy_residual": largest[0][:, 0], "energy_scale": scale}
        return Extremes(extrema, settling, last_above(steps, SQUARE, level)), columns


class _StepsOfMembers:
    """The steps of members, one after the other.

    Args:
        compiled: The compiled functions.
        parameters: Shape (parameters, m).
        trajectories: The trajectories of the members.
        members: The quantities of the members.
        system_of: Returns the system of a member.

    Attributes:
        member: The member of each end, shape (n,).
        audits: The audit states at the ends, as the integrator scales them.
    """

    def __init__(
        self,
        compiled: EnsembleExtremes,
        parameters: Array,
        trajectories: EnsembleTrajectories,
        members: MemberTrajectories,
        system_of: Callable[[int], System],
    ) -> None:
        self._compiled, self._parameters, self._system_of = compiled, parameters, system_of
        self._rest = members.energy_at_rest
        ends = list(trajectories.ends)
        if trajectories.angles:
            # As last rows: they are cut and repeated as the states are.
            ends = [np.concatenate(pair) for pair in zip(ends, trajectories.angles, strict=True)]
        counts = np.array([one.shape[1] for one in ends])
        # Complete SIMD vectors: the last member stays at its end.
        more = -counts.sum() % SIMD
        counts[-1] += more
        together = np.concatenate([*ends, np.repeat(ends[-1][:, -1:], more, axis=1)], axis=1)
        size = compiled.structure.size
        self._times, self._states = together[0], together[1 : 1 + size]
        audited = compiled.structure.audited_size
        self.audits, self._angles = together[1 + size : 1 + audited], together[1 + audited :]
        self.member = np.repeat(np.arange(len(counts)), counts)
        self._first = np.cumsum(counts) - counts
        self._last = self._first + counts - 1
        self._after = self._at_end(np.arange(len(self._times)))
        self._table = np.empty(0)
        self._lengths = self._times[self._after] - self._times

    def steps(self) -> Steps:
        """Return the steps; the last end of each member begins one of no length."""
        at_begin = self._observed(self._states, self._times, self.member)
        q = self._compiled.structure.q
        if q is not None:
            at_begin[0, THETA_ROWS][::2] = self._angles[::2]
        self._table = table = np.array([at_begin, self._at_end(at_begin)])
        if q is not None:
            motion = self._states[[q.size - 1, *range(6)]]
            beyond = beyond_ends(motion, self._at_end(motion), self._lengths)
            leave_open(table, beyond, self._first, self.member)
        return Steps(
            self._first,
            self._times,
            self._lengths,
            table,
            self._derivatives,
            self._divide,
        )

    def _at_end(self, rows: Array) -> Array:
        """Return what is at the ends of steps, from what is at their begins."""
        found = np.empty_like(rows)
        found[..., :-1] = rows[..., 1:]
        found[..., self._last] = rows[..., self._last]
        return found

    def _derivatives(self, quantity: Array, step: Array) -> Array:
        """Return second and third derivatives at both ends of steps (see `Steps`)."""
        chosen, inverse = np.unique(step, return_inverse=True)
        both, of = np.append(chosen, self._after[chosen]), np.tile(self.member[chosen], 2)
        found = along(
            lambda y, t: self._observed(y, t, of),
            lambda y, t: self._evaluated(self._compiled.rates, y, t, of),
            self._states[:, both],
            self._times[both],
            np.tile(self._lengths[chosen], 2),
        ).reshape(2, VALUE + 1, 2, -1)
        return np.moveaxis(found, 2, 0)[:, :, quantity, inverse]

    def _divide(self, step: int) -> Steps | None:
        member = int(self.member[step])
        system, q = self._system_of(member), self._compiled.structure.q
        if q is not None:
            system, _ = in_quaternions(system)
        start = np.zeros(system.audited_size)
        start[: system.size] = self._states[:, step]
        times = float(self._times[step]), float(self._times[self._after[step]])
        Theta = self._table[0, 0, THETA_ROWS, step]
        return divided(system, times, start, float(self._rest[member]), Theta)

    def _observed(self, y: Array, t: Array, of: Array) -> Array:
        """Return the values and rates of what is watched at states of members, shape (2, 8, p)."""
        found = self._evaluated(self._compiled.watched, y, t, of).reshape(2, VALUE + 1, -1)
        found[0, VALUE] -= self._rest[of]
        if self._compiled.structure.q is not None:
            found[:, THETA_ROWS] = self._compiled.structure.q.watched(y)
        return found

    def _evaluated(self, compiled: Any, y: Array, t: Array, of: Array) -> Array:
        """Return a compiled function at states of members, shape (outputs, p).

        Complete SIMD vectors give a state the same bits at each place.
        """
        if len(of) % SIMD:
            full = lanes_of(len(of))
            return self._evaluated(compiled, y[:, full], t[full], of[full])[:, : len(of)]
        structure = self._compiled.structure
        pars = structure.open_parameters(self._parameters, compiled)[:, of]
        y, pars = (np.ascontiguousarray(rows) for rows in (y, pars))
        return np.asarray(compiled(y, pars=pars, **({"time": t} if structure.timed else {})))
