"""Many motions of one structure at once: compiled Taylor integration in SIMD batches.

Each lane of a batch has its own parameters, its own state and its own steps; what it computes does
not depend on its neighbours, to the last bit.
"""

from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compiled_map import SIMD, evaluated
from rbstab.integrate.heyoka.symbols import (
    parameter_values,
    scaled_audit,
    state_symbols,
    symbols_of,
)
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import AUDIT_SIZE, System

MAX_STEPS = 20_000
"""Steps of a batch, after which a lane that is not done is taken out of it."""

# Sweeps have threads of their own; heyoka's would only wait beside them, and not idly.
hy.set_nthreads(1)

DONE = hy.taylor_outcome.time_limit
"""heyoka's word for the end of the grid."""


class Motions(NamedTuple):
    """Motions of m members at n samples.

    lanes has shape (states, whole batches, n): the states, and behind those of the last member
    what fills its batch. lyapunov_change (m, n), J, is ∫v' dt; steps (m,) are accepted steps. done
    (m,) tells which members were followed to the end (the numbers of others mean nothing).

    The states stand until the ensemble runs again. Their memory is used anew, for asking the
    system for more costs as much as evaluating them.
    """

    lanes: Array
    lyapunov_change: Array
    steps: Array
    done: Array

    @property
    def states(self) -> Array:
        """The states in the system's coordinates, shape (states, m, n)."""
        return self.lanes[:, : len(self.steps)]


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
        self._memory: dict[str, Array] = {}

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
        # Whole batches: the last lanes repeat the last member.
        full = np.minimum(np.arange(-(-members // self.batch) * self.batch), members - 1)
        shape = (self.size + AUDIT_SIZE, len(full), len(self.times))
        lanes = _Lanes(
            np.vstack([parameters[self.open], scales])[:, full],
            np.vstack([starts, np.zeros((AUDIT_SIZE, members))])[:, full],
            self._room("states", shape),
            np.zeros(len(full), dtype=int),
            np.zeros(len(full), dtype=bool),
        )
        for first in range(0, len(full), self.batch):
            batch = slice(first, first + self.batch)
            self._follow(batch, lanes)
            # What ends one lane can end the others, which are sound: alone, a lane is only itself.
            for lane in range(first, min(first + self.batch, members)):
                if not lanes.done[lane]:
                    self._follow(slice(lane, lane + 1), lanes)
        change = lanes.states[-AUDIT_SIZE, :members] * scales[:, np.newaxis]
        steps, done = lanes.steps[:members], lanes.done[:members]
        return Motions(lanes.states[: self.size], change, steps, done)

    def _follow(self, chosen: slice, lanes: "_Lanes") -> None:
        """One batch, of all its lanes or of one member in all of them."""
        integrator = self.integrator
        integrator.set_time(float(self.times[0]))
        integrator.pars[:] = lanes.given[: len(integrator.pars), chosen]
        integrator.state[:] = lanes.begun[:, chosen]
        _, found = integrator.propagate_grid(self.grid, max_steps=MAX_STEPS)
        used = chosen.stop - chosen.start
        lanes.states[:, chosen] = found.transpose(1, 2, 0)[:, :used]
        outcomes = integrator.propagate_res[:used]
        lanes.steps[chosen] = [taken for _, _, _, taken in outcomes]
        # What is not finite once stays so.
        finite = np.isfinite(found[-1, :, :used]).all(axis=0)
        lanes.done[chosen] = finite & [outcome == DONE for outcome, _, _, _ in outcomes]

    def observe(self, parameters: Array, motions: Motions) -> Array:
        """Θ̇, X, V, E, F and the sum of all energies, shape (16, m, n); it stands until the next.

        Args:
            parameters: Shape (parameters, m).
            motions: What `run` returned.
        """
        # Whole batches are whole vectors of the processor; see `evaluated`.
        size, full, samples = motions.lanes.shape
        found = self._room("observed", (16, full * samples))
        chosen = parameters[self.open][: self.observed.nparams]
        self.observed(
            motions.lanes.reshape(size, full * samples),
            pars=self._along(chosen, full, samples),
            outputs=found,
        )
        return found.reshape(16, full, samples)[:, : len(motions.steps)]

    def _room(self, name: str, shape: tuple[int, ...]) -> Array:
        """Memory of a shape, the same at each call."""
        size = int(np.prod(shape))
        if name not in self._memory or self._memory[name].size < size:
            self._memory[name] = np.empty(size)
        return self._memory[name][:size].reshape(shape)

    def _along(self, chosen: Array, full: int, samples: int) -> Array:
        """Parameters, one for each member, for each of its samples."""
        found = self._room("given", (len(chosen), full, samples))
        found[:, : chosen.shape[1]] = chosen[:, :, np.newaxis]
        found[:, chosen.shape[1] :] = chosen[:, -1:, np.newaxis]
        return found.reshape(len(chosen), full * samples)


class _Lanes(NamedTuple):
    """What a run reads and fills; members stand along the last axis, in `states` the middle one."""

    given: Array
    begun: Array
    states: Array
    steps: Array
    done: Array


def parameters_and_start(system: System, start: Array) -> Array:
    """The numbers that one member is made of: its parameters, then its state at the start."""
    return np.concatenate([parameter_values(system), start])
