"""A trajectory and its derivative along one direction of the parameters and the initial state.

The parameters are p + s q, and the initial state is y(0) + s z(0). The derivative
z = ∂y/∂s at s = 0 obeys the variational equation ż = (∂f/∂y) z + (∂f/∂p) q, which heyoka derives
(`var_ode_sys`). Both p and q are set at run time, so one compilation serves every direction of
every system of a structure. The caller computes q and z(0) from the change of the config.

Where elements switch, the equations change on the way. The driver of switches follows the motion
once (`course`). Between two of its switches modes are parameters, and at each of them z
jumps (`switching.saltation`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.compile_cache import compiled_once
from rbstab.integrate.heyoka.symbols import (
    energy_scale,
    parameter_values,
    set_motion,
    set_parameters,
    state_symbols,
    symbols_of,
)
from rbstab.integrate.problem import Problem
from rbstab.integrate.run import check_start, range_left
from rbstab.integrate.status import RunStatus, StopRun
from rbstab.integrate.switching.course import Course, Transition
from rbstab.integrate.switching.saltation import (
    after_breakpoint,
    tangent_at_start,
    through_transition,
)
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA
from rbstab.systems.modes import modes_of, with_modes
from rbstab.systems.parameters import parameters, structure
from rbstab.systems.schedule import BEGIN, Schedule
from rbstab.systems.system import System

TOLERANCE = 1e-15
"""Smaller than the tolerance of a run, so that derivatives much smaller than the states are also
accurate."""


@dataclass(frozen=True, eq=False)
class Tangent:
    """The direction of the derivative: how a problem changes with s.

    Args:
        system: The system, in any modes and with any legs. Its parameters have the imaginary part
            h q, with h = `derivatives.STEP`.
        start: z(0), shape (states,).
        rest_energy: The derivative by s of the stored energy of the rest state, J.
        schedule: The legs of the inputs that are made of them, with imaginary parts likewise.
    """

    system: System
    start: Array
    rest_energy: float
    schedule: Schedule

    def like(self, system: System, time: float) -> System:
        """Return the system of this direction in the modes of a system, with the legs of a time."""
        return self.schedule.system_at(with_modes(self.system, modes_of(system)), time)

    def delays_at(self, time: float) -> dict[str, float]:
        """Return the derivative of a breakpoint by s for each input whose leg begins there."""
        begins = zip(self.schedule.names, self.schedule.legs_at(time)[:, BEGIN], strict=True)
        return {name: float(t.imag) / STEP for name, t in begins if t.real == time}


class Passage(NamedTuple):
    """A transition on the way.

    Attributes:
        delay: The derivative of its time by s, s; NaN at a breakpoint of several inputs that do not
            change together for other s.
        energy: The sum of all energies just before it, J.
        energy_slope: The derivative of this number by s, J.
        impact: Whether it is an impact.
    """

    delay: float
    energy: float
    energy_slope: float
    impact: bool


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
        power_zeros: The times at which v' = 0, s, if elements supply power; else empty.
        status: The status of the run.
        detail: Why and when the run stopped early, as text; else empty.
        passages: What is known of the transitions by their times, s: of impacts, and if inputs
            supply power of all.
    """

    times: Array
    states: Array
    tangents: Array
    lyapunov_integral: Array
    lyapunov_integral_tangent: Array
    turning_times: tuple[Array, ...]
    crossings: Array
    power_zeros: Array
    status: RunStatus
    detail: str
    passages: dict[float, Passage] = field(default_factory=dict)


class Levels(NamedTuple):
    """Energies of a run.

    Attributes:
        rest_energy: The stored energy of the rest state, at which v = 0, J.
        threshold: The value of v whose crossings are recorded, J.
    """

    rest_energy: float
    threshold: float = 0.0


class VariationalSystem:
    """The compiled equations of one structure, with their derivative along any direction.

    Compact mode compiles in 2 s instead of 40 s, and runs three times slower (about 10 ms).

    Args:
        system: Any system of the structure.
    """

    def __init__(self, system: System) -> None:
        self.size, self.count = system.size, parameter_values(system).size
        self.zeros: tuple[list[float], ...] = tuple([] for _ in range(6))
        # After all p and q: s, and what a run sets (`_Run._parameters`).
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
        observation = symbolic.observe(y, hy.time)
        crossings, *turning_times, power_zeros = self.zeros
        events = [(observation.energy.sum() - energy, crossings)]
        if not symbolic.coordinates.holds_contact:  # else E and F are always zero
            E, F = observation.motion.E, observation.motion.F
            events += zip((*F, E @ F), turning_times, strict=True)
        if symbolic.supplies:
            power = observation.supplied.sum() - observation.dissipation.sum()
            events.append((power, power_zeros))
        return [
            hy.nt_event(expression, callback=_append_time(zeros)) for expression, zeros in events
        ]

    def integrate(
        self,
        problem: Problem,
        course: Course,
        times: Array,
        levels: Levels,
        tangent: Tangent | None = None,
    ) -> VariationalTrajectory:
        """Integrate a problem and its derivative.

        Args:
            problem: The problem; its own samples and tolerances are not used.
            course: The systems of its motion.
            times: The samples, shape (n,), s, ascending, the first at the problem's start.
            levels: The energies from which v counts, and whose crossings are recorded.
            tangent: The direction; None for a zero derivative.

        Raises:
            NotDifferentiableError: The motion has no derivative along the tangent.
        """
        for zeros in self.zeros:
            zeros.clear()
        return _Run(self, problem, course, levels, tangent).result(times)


class _Run:
    """One integration of a problem and its derivative; see `VariationalSystem.integrate`."""

    def __init__(
        self,
        compiled: VariationalSystem,
        problem: Problem,
        course: Course,
        levels: Levels,
        tangent: Tangent | None,
    ) -> None:
        self.compiled, self.integrator, self.size = compiled, compiled.integrator, compiled.size
        self.problem, self.course, self.levels, self.tangent = problem, course, levels, tangent
        self.scale = energy_scale(problem)
        self.deadline = Deadline(problem.time_limit)
        self.passages: dict[float, Passage] = {}
        self.rows = [np.zeros((0, 2 * (self.size + 1)))]
        self.steps, self.reached = 0, float(problem.times[0])

    def result(self, times: Array) -> VariationalTrajectory:
        """Integrate, and return the trajectory at samples, s, ascending, the first at the start."""
        status, detail = RunStatus.COMPLETED, ""
        try:
            check_start(self.problem)
            self._begin()
            self._follow(times)
        except StopRun as stop:
            status, detail = stop.status, f"{stop} at t = {self.reached:.9g} s"
        samples = np.concatenate(self.rows)
        if len(samples) == len(times):
            # A limit reached in the last step does not count.
            status, detail = RunStatus.COMPLETED, ""
        values, derivative = np.split(samples, 2, axis=1)
        crossings, *turning_times, power_zeros = (
            np.unique(zero_times) for zero_times in self.compiled.zeros
        )
        return VariationalTrajectory(
            times[: len(samples)],
            values[:, :-1],
            derivative[:, :-1],
            values[:, -1] * self.scale,
            derivative[:, -1] * self.scale,
            tuple(turning_times),
            crossings,
            power_zeros,
            status,
            detail,
            self.passages,
        )

    def _begin(self) -> None:
        """Set the start and its derivative. ∫v dt and its derivative start at zero."""
        first, begin, start = self.course.first, self.reached, self.problem.start
        z = np.zeros(self.size)
        if self.tangent is not None:
            shifted = self.tangent.like(first, begin)
            z = tangent_at_start(first, shifted, start, self.tangent.start, begin)
            # A load that begins at the start begins later for other s.
            before = self.problem.schedule.system_at(first, np.nextafter(begin, -np.inf))
            change = Transition(begin, (), before, first)
            z = after_breakpoint(change, self.tangent.delays_at(begin), start, z)
        set_motion(self.integrator, begin, np.concatenate([start, [0.0], z, [0.0]]))

    def _follow(self, times: Array) -> None:
        """Integrate from transition to transition. A sample at one belongs to what begins there."""
        transitions = [
            transition for transition in self.course.transitions if transition.time < times[-1]
        ]
        edges = [
            float(times[0]),
            *(transition.time for transition in transitions),
            float(times[-1]),
        ]
        firsts = [*times.searchsorted(edges[:-1]).tolist(), len(times)]
        shifted = self.course.first
        for number, (low, high) in enumerate(pairwise(edges)):
            if number:
                self._pass(transitions[number - 1], shifted)
            system = self.course.systems[number]
            shifted = system if self.tangent is None else self.tangent.like(system, low)
            set_parameters(self.integrator, self._parameters(system, shifted))
            if low < high:
                self._follow_to(high, times[firsts[number] : firsts[number + 1]])

    def _follow_to(self, end: float, wanted: Array) -> None:
        """Integrate to a time, s, with some samples on the way."""
        limit = self.problem.step_limit
        too_long = StopRun(RunStatus.STEP_LIMIT, f"stopped after {limit} steps")
        if self.steps >= limit:
            # heyoka takes a limit of zero for none.
            raise too_long
        grid = np.unique([self.integrator.time, *wanted, end])
        outcome, _, _, steps, _, states = self.integrator.propagate_grid(
            grid, max_steps=limit - self.steps, callback=lambda _: not self.deadline.expired()
        )
        self.steps, self.reached = self.steps + steps, self.integrator.time
        self.rows.append(states[np.isin(grid[: len(states)], wanted)])
        if outcome == hy.taylor_outcome.step_limit:
            raise too_long
        if outcome == hy.taylor_outcome.err_nf_state:
            raise StopRun(RunStatus.DIVERGED, "the state stopped being finite")
        if outcome == hy.taylor_outcome.cb_stop:
            raise StopRun(RunStatus.TIME_LIMIT, self.deadline.reason)
        if outcome != hy.taylor_outcome.time_limit:
            raise range_left(self.problem)

    def _parameters(self, system: System, shifted: System) -> Array:
        """Return the values of `par[]` for a system: p, q and s, then those of the run."""
        q = np.concatenate([np.imag(np.ravel(value)) for value in parameters(shifted).values()])
        rest_slope = 0.0 if self.tangent is None else self.tangent.rest_energy
        settings = [0.0, self.levels.rest_energy, rest_slope, self.scale]
        settings += [self.problem.range_bound, self.levels.threshold]
        return np.concatenate([parameter_values(system), q / STEP, settings])

    def _pass(self, transition: Transition, shifted: System) -> None:
        """Go through a transition, at which state and derivative may jump."""
        # `shifted` is the system before it, shifted along the tangent.
        before, time, states = transition.before, transition.time, self.integrator.state
        # Each ends with ∫v dt.
        values, derivatives = states[: self.size + 1], states[self.size + 1 :]
        y, z = values[:-1].copy(), derivatives[:-1].copy()
        if transition.modes:
            passed = through_transition(transition, shifted, y, z)
            values[:-1], derivatives[:-1], delay = passed
        else:
            delays = {} if self.tangent is None else self.tangent.delays_at(time)
            derivatives[:-1] = after_breakpoint(transition, delays, y, z)
            different = set(delays.values()) or {0.0}
            delay = different.pop() if len(different) == 1 else np.nan
        if not transition.impact and not before.supplies:
            return
        observed = shifted.observe(y + 1j * STEP * z, time)
        energy, power = observed.energy.sum(), (observed.supplied - observed.dissipation).sum()
        change = float(energy.imag) / STEP + float(power.real) * delay
        # Another element may switch at the time of an impact, and after it.
        if transition.impact or time not in self.passages:
            self.passages[time] = Passage(delay, float(energy.real), change, transition.impact)
        if transition.impact:
            left = transition.after.observe(values[:-1], time).energy.sum()
            derivatives[-1] += (energy.real - left) / self.scale * delay
            level = self.levels.threshold + self.levels.rest_energy
            if energy.real >= level > left:
                self.compiled.zeros[0].append(time)


def _append_time(zeros: list[float]) -> Callable[[Any, float, int], None]:
    def append_time(_integrator: Any, time: float, _direction: int) -> None:
        zeros.append(time)

    return append_time


def variational_system(system: System) -> VariationalSystem:
    """Return the variational equations of a system's structure, compiled once in each thread."""
    key = VariationalSystem, structure(system)
    return compiled_once(key, lambda: VariationalSystem(system))
