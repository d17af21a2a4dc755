"""Many motions of one structure at once: compiled Taylor integration in SIMD batches.

Each lane of a batch has its own parameters, its own state and its own steps; what it computes does
not depend on its neighbours, to the last bit.
"""

from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.integrate.compiled_map import SIMD, evaluated
from rbstab.integrate.heyoka_engine import (
    parameter_values,
    scaled_audit,
    state_symbols,
    symbols_of,
)
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import AUDIT_SIZE, System

MOST_STEPS = 20_000
"""Steps of a batch, after which a lane that is not done is taken out of it."""

DONE = hy.taylor_outcome.time_limit
"""heyoka's word for the end of the grid."""


class Motions(NamedTuple):
    """Motions of m members at n samples.

    states has shape (m, states, n), in the system's coordinates; lyapunov_change (m, n), J, is
    ∫v' dt; steps (m,) are accepted steps. done (m,) tells which members were followed to the end
    (what stands in the rows of others means nothing).
    """

    states: Array
    lyapunov_change: Array
    steps: Array
    done: Array


class Ensemble:
    """The compiled equations of a structure, for many members.

    Args:
        system: Any system of the structure.
        tolerance: heyoka's tolerance.
        times: The samples, shape (n,), s.
        varies: Which parameters differ between members, shape (parameters,); by default all. The
            others are those of `system`, compiled in: zeros and products of constants cost nothing.
    """

    def __init__(
        self, system: System, tolerance: float, times: Array, varies: Array | None = None
    ) -> None:
        values = parameter_values(system)
        varies = np.ones(len(values), dtype=bool) if varies is None else varies
        places = np.cumsum(varies) - 1
        self.open = np.flatnonzero(varies)

        def symbol(index: int) -> Any:
            constant = hy.expression(float(values[index]))
            return hy.par[int(places[index])] if varies[index] else constant

        symbolic, _, _ = symbols_of(system, symbol)
        self.size = system.size
        self.times = times
        self.batch = SIMD
        y = state_symbols(system.size + AUDIT_SIZE)
        self.symbolic, self.symbols = symbolic, y
        rates = scaled_audit(symbolic.audited_rates(y), hy.par[len(self.open)])
        self.integrator = hy.taylor_adaptive_batch(
            list(zip(y, rates, strict=True)),
            state=np.zeros((len(y), self.batch)),
            tol=tolerance,
        )
        self.grid = np.repeat(times[:, np.newaxis], self.batch, axis=1)
        seen = symbolic.observe(y[: system.size])
        motion = seen.motion
        energies = [hy.expression(0.0) + entry for entry in seen.energy.tolist()]
        vectors = [motion.B @ motion.Omega, motion.X, motion.V, motion.E, motion.F]
        entries = [hy.expression(0.0) + entry for vector in vectors for entry in vector.tolist()]
        self.observed = hy.cfunc([*entries, sum(energies)], vars=list(y[: system.size]))
        self.energies = hy.cfunc(energies, vars=list(y[: system.size]))

    def scales(self, parameters: Array, starts: Array) -> Array:
        """The size of the energies at the start of each member, shape (m,), J; 1 J for none.

        Args:
            parameters: Shape (parameters, m), in the order of `parameter_values`.
            starts: Shape (states, m).
        """
        with np.errstate(all="ignore"):
            given = parameters[self.open][: self.energies.nparams]
            size = np.abs(evaluated(self.energies, starts, given)).sum(axis=0)
        return np.where((size > 0) & (size < np.inf), size, 1.0)

    def run(self, parameters: Array, starts: Array) -> Motions:
        """Follows members over the samples.

        Args:
            parameters: Shape (parameters, m).
            starts: Shape (states, m).
        """
        members = starts.shape[1]
        scales = self.scales(parameters, starts)
        rows = _Rows(
            np.vstack([parameters[self.open], scales]),
            np.vstack([starts, np.zeros((AUDIT_SIZE, members))]),
            np.empty((members, self.size + AUDIT_SIZE, len(self.times))),
            np.zeros(members, dtype=int),
            np.zeros(members, dtype=bool),
        )
        for first in range(0, members, self.batch):
            lanes = np.arange(first, min(first + self.batch, members))
            self._follow(lanes, rows)
            # What ends one lane can end the others, which are sound: alone, a lane is only itself.
            if len(lanes) > 1:
                for lane in lanes[~rows.done[lanes]].tolist():
                    self._follow(np.array([lane]), rows)
        change = rows.states[:, -AUDIT_SIZE] * scales[:, np.newaxis]
        return Motions(rows.states[:, : self.size], change, rows.steps, rows.done)

    def _follow(self, lanes: Array, rows: "_Rows") -> None:
        """One batch, of at most `batch` members."""
        integrator = self.integrator
        # A batch is always full: its last lanes repeat one.
        filled = np.concatenate([lanes, np.repeat(lanes[-1:], self.batch - len(lanes))])
        integrator.set_time(float(self.times[0]))
        integrator.pars[:] = rows.given[: len(integrator.pars), filled]
        integrator.state[:] = rows.begun[:, filled]
        _, found = integrator.propagate_grid(self.grid, max_steps=MOST_STEPS)
        rows.states[lanes] = found.transpose(2, 1, 0)[: len(lanes)]
        outcomes = integrator.propagate_res[: len(lanes)]
        rows.steps[lanes] = [taken for _, _, _, taken in outcomes]
        # What is not finite once stays so.
        finite = np.isfinite(found[-1, :, : len(lanes)]).all(axis=0)
        rows.done[lanes] = finite & [outcome == DONE for outcome, _, _, _ in outcomes]

    def observe(self, parameters: Array, motions: Motions) -> Array:
        """Θ̇, X, V, E, F and the sum of all energies, shape (m, 16, n).

        Args:
            parameters: Shape (parameters, m).
            motions: What `run` returned.
        """
        members, _, samples = motions.states.shape
        found = np.empty((members, 16, samples))
        count = self.observed.nparams
        given = np.empty((count, samples))
        chosen = parameters[self.open][:count]
        for member in range(members):
            given[:] = chosen[:, member, np.newaxis]
            self.observed(
                np.ascontiguousarray(motions.states[member]), pars=given, outputs=found[member]
            )
        return found


class _Rows(NamedTuple):
    """What a run reads, by columns (parameters and start), and fills, by rows."""

    given: Array
    begun: Array
    states: Array
    steps: Array
    done: Array


def parameters_and_start(system: System, start: Array) -> Array:
    """The numbers that one member is made of: its parameters, then its state at the start."""
    return np.concatenate([parameter_values(system), start])
