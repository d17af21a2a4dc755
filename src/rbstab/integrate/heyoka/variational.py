"""A trajectory and its derivative along one direction of the parameters and the initial state.

The parameters are p + s q, and the initial state is y(0) + s z(0). The derivative
z = ∂y/∂s at s = 0 obeys the variational equation ż = (∂f/∂y) z + (∂f/∂p) q, which heyoka derives
(`var_ode_sys`). Both p and q are set at run time, so one compilation serves every direction of
every system of a structure. The caller computes q and z(0) from the change of the config.

Where elements switch, the equations change on the way. The driver of switches follows the motion
once (`heyoka.course`). Between two of its switches modes are parameters, and at each of them z
jumps (`switching.saltation`).
"""

import threading
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.engine import (
    GRID_END,
    StepCallback,
    initial_status,
    status_of,
    stop_reason,
)
from rbstab.integrate.heyoka.integrator_state import set_motion, set_parameters
from rbstab.integrate.heyoka.symbols import (
    energy_scale,
    parameter_values,
    state_symbols,
    symbols_of,
)
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.course import Course
from rbstab.integrate.switching.saltation import tangent_after, tangent_at_start
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA
from rbstab.systems.modes import modes_of, with_modes
from rbstab.systems.parameters import parameters, structure
from rbstab.systems.system import System

TOLERANCE = 1e-15
"""Smaller than the tolerance of a run, so that derivatives much smaller than the states are also
accurate."""


@dataclass(frozen=True, eq=False)
class Tangent:
    """The direction of the derivative: how a problem changes with s.

    Args:
        system: The system, in any modes. Its parameters have the imaginary part h q, with
            h = `derivatives.STEP`.
        start: z(0), shape (states,).
        rest_energy: The derivative by s of the stored energy of the rest state, J.
    """

    system: System
    start: Array
    rest_energy: float

    def in_modes_of(self, system: System) -> System:
        """Return the system of this direction in the modes of another one."""
        return with_modes(self.system, modes_of(system))

    def parameters_in_modes_of(self, system: System) -> Array:
        """Return q in the modes of a system, in the order of `parameter_values`."""
        values = parameters(self.in_modes_of(system)).values()
        return np.concatenate([np.imag(np.ravel(value)) for value in values]) / STEP


@dataclass(frozen=True, eq=False)
class VariationalTrajectory:
    """A trajectory with its derivative along a tangent, up to the last computed sample.

    Args:
        times: Shape (n,), s.
        states: y, shape (n, states).
        tangents: z = ∂y/∂s, shape (n, states).
        lyapunov_integral: ∫v dt, shape (n,), J s.
        lyapunov_integral_tangent: Its derivative by s, shape (n,), J s.
        turning_times: The times at which F_1, F_2, F_3 and E'F are zero, four arrays, s. They are
            empty if the contact point is held.
        crossings: The times at which v crosses its threshold, s.
        status: The status of the run.
        detail: Why and when the run stopped early, as text; else empty.
    """

    times: Array
    states: Array
    tangents: Array
    lyapunov_integral: Array
    lyapunov_integral_tangent: Array
    turning_times: tuple[Array, ...]
    crossings: Array
    status: RunStatus
    detail: str


class VariationalSystem:
    """The compiled equations of one structure, with their derivative along any direction.

    Compact mode compiles in 2 s instead of 40 s, and runs three times slower (about 10 ms).

    Args:
        system: Any system of the structure.
    """

    def __init__(self, system: System) -> None:
        self.size, self.count = system.size, parameter_values(system).size
        self.zeros: tuple[list[float], ...] = tuple([] for _ in range(5))
        # After all p and q: s, and the numbers of `_parameters` in the same order.
        s, rest, rest_slope, scale, bound, level = (hy.par[2 * self.count + k] for k in range(6))
        symbolic, _, _ = symbols_of(system)
        perturbed, _, _ = symbols_of(system, lambda k: hy.par[k] + s * hy.par[self.count + k])
        y = state_symbols(self.size + 1)
        value = perturbed.observe(y).energy.sum() - (rest + s * rest_slope)
        rates = [*perturbed.rates(y, hy.time), value / scale]
        equations = hy.var_ode_sys(list(zip(y, rates, strict=True)), [s], 1).sys
        self.integrator = hy.taylor_adaptive(
            equations,
            state=[0.0] * len(equations),
            tol=TOLERANCE,
            t_events=[hy.t_event(regularity(y[THETA]) - bound)],
            nt_events=self._events(symbolic, y, rest + level),
            compact_mode=True,
        )

    def _events(self, symbolic: System, y: Array, energy: Any) -> list[Any]:
        observation = symbolic.observe(y)
        event_functions = [observation.energy.sum() - energy]
        if not symbolic.coordinates.holds_contact:  # else E and F are always zero
            E, F = observation.motion.E, observation.motion.F
            event_functions += [*F, E @ F]
        return [
            hy.nt_event(expression, callback=_append_time(zeros))
            for expression, zeros in zip(event_functions, self.zeros, strict=False)
        ]

    def integrate(
        self,
        problem: Problem,
        course: Course,
        times: Array,
        rest_energy: float = 0.0,
        threshold: float = 0.0,
        tangent: Tangent | None = None,
    ) -> VariationalTrajectory:
        """Integrate a problem and its derivative.

        Args:
            problem: The problem; its own samples and tolerances are not used.
            course: The systems of its motion.
            times: The samples, shape (n,), s, ascending, the first at the problem's start.
            rest_energy: The stored energy of the rest state, at which v = 0, J.
            threshold: The value of v whose crossings are recorded, J.
            tangent: The direction; None for a zero derivative.

        Raises:
            NotDifferentiableError: The motion has no derivative along the tangent.
        """
        scale = energy_scale(problem)
        status = initial_status(problem)
        samples = np.zeros((0, 2 * (self.size + 1)))
        if status is None:
            rest_slope = 0.0 if tangent is None else tangent.rest_energy
            numbers = [rest_energy, rest_slope, scale, problem.range_bound, threshold]
            self._begin(problem, course.first, tangent)
            status, samples = self._follow(problem, course, times, numbers, tangent)
        detail = ""
        if status is not RunStatus.COMPLETED:
            stop = self.integrator.time if len(samples) else float(times[0])
            detail = f"{stop_reason(status, problem)} at t = {stop:.9g} s"
        return self._trajectory(times[: len(samples)], samples, scale, status, detail)

    def _begin(self, problem: Problem, first: System, tangent: Tangent | None) -> None:
        """Set the initial state, and clear the last run."""
        z = np.zeros(self.size)
        if tangent is not None:
            shifted, begin = tangent.in_modes_of(first), float(problem.times[0])
            z = tangent_at_start(first, shifted, problem.start, tangent.start, begin)
        # ∫v dt and its derivative start at zero.
        start = np.concatenate([problem.start, [0.0], z, [0.0]])
        set_motion(self.integrator, problem.times[0], start)
        for zeros in self.zeros:
            zeros.clear()

    def _follow(
        self,
        problem: Problem,
        course: Course,
        times: Array,
        numbers: list[float],
        tangent: Tangent | None,
    ) -> tuple[RunStatus, Array]:
        """Integrate from transition to transition, and return the status and the samples.

        Args:
            problem: The problem.
            course: The systems of its motion.
            times: The samples, s.
            numbers: The last of the parameters (`_parameters`).
            tangent: The direction; None for a zero derivative.
        """
        integrator, callback, steps = self.integrator, StepCallback(problem, None), 0
        transitions = [one for one in course.transitions if one.time < times[-1]]
        edges = [float(times[0]), *(one.time for one in transitions), float(times[-1])]
        rows = [*times.searchsorted(edges[:-1]).tolist(), len(times)]
        samples, systems = [np.zeros((0, 2 * (self.size + 1)))], course.systems
        for leg, (begin, end) in enumerate(pairwise(edges)):
            set_parameters(integrator, self._parameters(systems[leg], numbers, tangent))
            wanted, is_last = times[rows[leg] : rows[leg + 1]].tolist(), leg == len(transitions)
            first = int(not wanted or wanted[0] != begin)
            grid = [*([begin] if first else []), *wanted, *([] if is_last else [end])]
            outcome, _, _, taken, _, found = integrator.propagate_grid(
                grid, max_steps=problem.step_limit - steps, callback=callback
            )
            steps += taken
            samples.append(found[first : first + len(wanted)])
            if is_last or outcome != GRID_END:
                break
            if steps >= problem.step_limit:
                callback.status = RunStatus.STEP_LIMIT
                break
            if tangent is not None:
                self._pass(course, leg, tangent)
        stored = np.concatenate(samples)
        if len(stored) == len(times):
            # A limit reached in the last step does not count.
            return RunStatus.COMPLETED, stored
        return callback.status or status_of(outcome), stored

    def _pass(self, course: Course, leg: int, tangent: Tangent) -> None:
        """Go through the transition at the end of a leg, where the derivative may jump."""
        transition, state = course.transitions[leg], self.integrator.state
        y, z = state[: self.size].copy(), slice(self.size + 1, 2 * self.size + 1)
        shifted = tangent.in_modes_of(transition.before)
        state[z] = tangent_after(transition, shifted, y, state[z].copy())

    def _parameters(
        self, system: System, numbers: list[float], tangent: Tangent | None
    ) -> Array:
        """Return the values of `par[]`: p, q and s, then the energies at rest and further numbers.

        Args:
            system: The system between two transitions.
            numbers: The stored energy of the rest state and its derivative, the energy scale, the
                range bound, and the value of v whose crossings are recorded.
            tangent: The direction; None for a zero derivative.
        """
        q = np.zeros(self.count) if tangent is None else tangent.parameters_in_modes_of(system)
        return np.concatenate([parameter_values(system), q, [0.0], numbers])

    def _trajectory(
        self, times: Array, samples: Array, scale: float, status: RunStatus, detail: str
    ) -> VariationalTrajectory:
        values, derivative = samples[:, : self.size + 1], samples[:, self.size + 1 :]
        crossings, *turning_times = (np.unique(zeros) for zeros in self.zeros)
        return VariationalTrajectory(
            times,
            values[:, :-1],
            derivative[:, :-1],
            values[:, -1] * scale,
            derivative[:, -1] * scale,
            tuple(turning_times),
            crossings,
            status,
            detail,
        )


def _append_time(zeros: list[float]) -> Callable[[Any, float, int], None]:
    def append_time(_integrator: Any, time: float, _direction: int) -> None:
        zeros.append(time)

    return append_time


_compiled = threading.local()


def variational_system(system: System) -> VariationalSystem:
    """Return the variational equations of a system's structure, compiled once in each thread."""
    cache: dict[Hashable, VariationalSystem] = _compiled.__dict__.setdefault("systems", {})
    key = structure(system)
    if key not in cache:
        cache[key] = VariationalSystem(system)
    return cache[key]
