"""The compiled engine: Taylor integration by heyoka, compiled once per structure.

The parameters of a system become the `par[]` of the compiled integrator, apart from some zeros
(`compiled_zeros`). So one compilation serves all systems of a structure with the same zeros. The
dense output is as accurate as the steps.
"""

from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.compile_cache import compiled_once
from rbstab.integrate.heyoka.integrator_state import set_motion, set_parameters
from rbstab.integrate.heyoka.intervals import GRID_END, Intervals, propagate
from rbstab.integrate.heyoka.symbols import (
    compiled_zeros,
    energy_scale,
    fitting_scale,
    parameter_values,
    scaled_audit,
    state_symbols,
    symbols_of,
    symbols_with_zeros,
)
from rbstab.integrate.implicit.steps import Stepper
from rbstab.integrate.problem import Problem, Progress, Trajectory, trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.step_ends import StepEnds
from rbstab.integrate.switching.current_phase import CurrentPhase
from rbstab.integrate.switching.phases import switches
from rbstab.integrate.switching.sliding_connector import drive_by_modes, follows_modes
from rbstab.integrate.zero_length import ended_at, reason
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.constraint import projected_state
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY, THETA
from rbstab.systems.parameters import parameters, structure
from rbstab.systems.schedule import Schedule
from rbstab.systems.system import System

STATUSES = {
    GRID_END: RunStatus.COMPLETED,
    hy.taylor_outcome.step_limit: RunStatus.STEP_LIMIT,
    hy.taylor_outcome.err_nf_state: RunStatus.DIVERGED,
}


def integrate(
    problem: Problem, progress: Progress | None = None, deadline: Deadline | None = None
) -> Trajectory:
    """Integrate a problem with heyoka; `rtol` is its only tolerance (see `Engine`)."""
    deadline = deadline or Deadline(problem.time_limit)
    if follows_modes(problem):
        return drive_by_modes(
            problem, lambda p, told: _integrate_modes(p, told, deadline), progress, deadline
        )
    if problem.switching is not None:
        return _integrate_by_steps(problem, progress, deadline)
    return _integrate_modes(problem, progress, deadline)


def _integrate_modes(problem: Problem, progress: Progress | None, deadline: Deadline) -> Trajectory:
    """Integrate a problem whose elements may switch."""
    start, first = problem.audited_start(), float(problem.times[0])
    status = initial_status(problem)
    if status is not None:
        detail = f"{stop_reason(status, problem, start)} at t = {first:.9g} s"
        if switches(problem):
            with np.errstate(all="ignore"):
                return CurrentPhase(problem).ended_at_start(status, detail)
        return trajectory(problem, [(first, start)], status, detail, 0, 0)
    scale = energy_scale(problem)
    found = _integrate_smooth(problem, progress, deadline, scale)
    fitting = fitting_scale(problem, found, scale)
    return found if fitting == scale else _integrate_smooth(problem, progress, deadline, fitting)


def _integrate_smooth(
    problem: Problem, progress: Progress | None, deadline: Deadline, scale: float
) -> Trajectory:
    """Integrate equations that are smooth but for switches of modes and breakpoints of inputs."""
    if switches(problem):
        # Imported late: only elements that switch need it.
        from rbstab.integrate.heyoka.mode_run import HeyokaModeRun

        with np.errstate(all="ignore"):
            return HeyokaModeRun(problem, progress, deadline, scale=scale).result()
    with deadline.paused():
        compiled = compiled_system(problem.system, problem.rtol)
    callback = StepCallback(problem, progress, deadline)
    outcome, steps, samples = compiled.run(problem, callback, scale)
    status = callback.status or status_of(outcome)
    start = float(problem.times[0]), problem.audited_start()
    rows = list(zip(problem.times.tolist(), samples, strict=False)) or [start]
    if len(rows) == len(problem.times):
        # A limit reached in the last step does not count.
        status = RunStatus.COMPLETED
    detail = ""
    if status is not RunStatus.COMPLETED:
        stop, state = compiled.final_state()
        if np.isfinite(state).all() and stop > rows[-1][0]:
            rows.append((stop, state))
            callback.ends.add(stop, state, callback.system)
        detail = f"{stop_reason(status, problem, state)} at t = {rows[-1][0]:.9g} s"
    breakpoints = compiled.reached_breakpoints
    return trajectory(problem, rows, status, detail, steps, steps, (), breakpoints, callback.ends)


def _integrate_by_steps(
    problem: Problem, progress: Progress | None, deadline: Deadline
) -> Trajectory:
    # Imported late: only the implicit law needs them.
    from rbstab.integrate.heyoka.implicit_stepper import compiled_stepper
    from rbstab.integrate.implicit.integrate import integrate as integrate_by_steps

    def stepper() -> Stepper:
        with deadline.paused():
            return compiled_stepper(problem.system)

    with np.errstate(all="ignore"):
        return integrate_by_steps(problem, stepper, progress, deadline)


class CompiledSystem:
    """The compiled audited equations of one structure; each run sets the parameters.

    Args:
        system: Any system of the structure with the same zeros (`compiled_zeros`).
        tolerance: heyoka's tolerance: relative or absolute, whichever is larger for a state.
    """

    def __init__(self, system: System, tolerance: float) -> None:
        symbol_of = symbols_with_zeros(compiled_zeros(system))
        symbolic, self.names, count = symbols_of(system, symbol_of)
        y = state_symbols(system.audited_size)
        bound, self.scale, self.size = hy.par[count], 1.0, system.size
        self.reached_breakpoints: list[float] = []
        leaving = regularity(y[THETA]) - bound
        rates = symbolic.audited_rates(y, hy.time)
        rates = scaled_audit(rates, system.size, hy.par[count + 1])
        self.integrator = hy.taylor_adaptive(
            list(zip(y, rates, strict=True)),
            state=[0.0] * len(y),
            tol=tolerance,
            t_events=[hy.t_event(event) for event in (leaving, *symbolic.clearances(y))],
        )

    def run(
        self, problem: Problem, callback: "StepCallback", scale: float
    ) -> tuple[Any, int, Array]:
        """Integrate over the problem's samples.

        Args:
            problem: The problem.
            callback: Called after every step.
            scale: The energy scale, J.

        Returns:
            heyoka's outcome, the number of steps, and the computed samples, shape (n, states).
        """
        integrator = self.integrator
        self.scale, self.reached_breakpoints = scale, []
        extra = [problem.range_bound, self.scale]
        values = np.concatenate([parameter_values(problem.system_at_start()), extra])
        set_parameters(integrator, values)
        set_motion(integrator, problem.times[0], problem.audited_start())
        if problem.schedule is not None:
            outcome, steps, samples = self._follow_legs(problem, problem.schedule, callback)
        else:
            outcome, _, _, steps, _, samples = integrator.propagate_grid(
                problem.times, max_steps=problem.step_limit, callback=callback
            )
        return outcome, steps, self._in_joules(samples)

    def _follow_legs(
        self, problem: Problem, schedule: Schedule, callback: "StepCallback"
    ) -> tuple[Any, int, Array]:
        """Integrate from breakpoint to breakpoint, with the legs that begin there; see `run`."""
        places, breakpoints = schedule.places(self.names), problem.breakpoints()
        edges = [float(problem.times[0]), *breakpoints, float(problem.times[-1])]
        legs = schedule.legs[schedule.breakpoints.searchsorted(edges, side="right")]

        def begin(leg: int) -> None:
            self.integrator.pars[places] = legs[leg]
            callback.system = schedule.system_at(problem.system, edges[leg])

        def end(leg: int) -> None:
            self.reached_breakpoints.append(edges[leg + 1])

        intervals = Intervals(edges, problem.times, problem.step_limit)
        return propagate(self.integrator, intervals, callback, begin, end)

    def final_state(self) -> tuple[float, Array]:
        """Return the time and the state at the end of the last run."""
        return self.integrator.time, self._in_joules(self.integrator.state.copy())

    def _in_joules(self, states: Array) -> Array:
        states[..., self.size :] *= self.scale
        return states


def compiled_system(system: System, tolerance: float) -> CompiledSystem:
    """Return the equations of a system's structure and zeros, compiled once in each thread."""
    named = parameters(system)
    key = CompiledSystem, structure(system, named), compiled_zeros(system, named), tolerance
    return compiled_once(key, lambda: CompiledSystem(system, tolerance))


class StepCallback:
    """The callback after every step: deadline, projection, ends of steps and progress.

    Args:
        problem: The problem.
        progress: Called with the time of every step.
        deadline: The deadline of the run; default one that starts now.
    """

    def __init__(
        self, problem: Problem, progress: Progress | None, deadline: Deadline | None = None
    ) -> None:
        self.deadline = deadline or Deadline(problem.time_limit)
        self.times = problem.times
        self.system, self.projects = problem.system_at_start(), problem.project
        self.ends = StepEnds()
        self.ends.add(float(problem.times[0]), problem.audited_start(), self.system)
        self.progress = progress
        self.status: RunStatus | None = None

    def __call__(self, integrator: Any) -> bool:
        """Return whether the run continues; heyoka calls this after every step."""
        state = integrator.state
        if self.projects:
            state[BODY] = projected_state(self.system.body, self.system.anchor, state[BODY])
        self.ends.add(integrator.time, state.copy(), self.system)
        if self.progress is not None:
            self.progress(integrator.time)
        if self.deadline.recording_time:
            self.deadline.samples = int(self.times.searchsorted(integrator.time, side="right"))
        if self.deadline.expired():
            self.status = RunStatus.TIME_LIMIT
        return self.status is None


def initial_status(problem: Problem) -> RunStatus | None:
    """Return the status of a run that cannot start, or None if it can."""
    start = problem.start
    with np.errstate(all="ignore"):
        rates = problem.system_at_start().audited_rates(
            problem.audited_start(), float(problem.times[0])
        )
    if ended_at(problem.system, start) is not None:
        return RunStatus.ZERO_LENGTH
    if not (np.isfinite(start).all() and np.isfinite(rates).all()):
        return RunStatus.DIVERGED
    if regularity(start[THETA]) <= problem.range_bound:
        return RunStatus.RANGE_LEFT
    return None


def status_of(outcome: Any) -> RunStatus:
    """Return the status of a run that ended with an outcome of heyoka.

    Its first terminal event is the end of the range; the others are springs without length.
    """
    ended = RunStatus.RANGE_LEFT if -1 - outcome.value == 0 else RunStatus.ZERO_LENGTH
    return STATUSES.get(outcome, ended)


def stop_reason(status: RunStatus, problem: Problem, state: Array | None = None) -> str:
    """Return why a run stopped, as text; for a spring without length from the last state."""
    if status is RunStatus.ZERO_LENGTH and state is not None:
        nearest = int(np.argmin(problem.system.clearances(state)))
        return reason(problem.system.clearance_owners[nearest])
    return {
        RunStatus.RANGE_LEFT: f"cos θ2 fell to {problem.range_bound:g}",
        RunStatus.DIVERGED: "the state stopped being finite",
        RunStatus.STEP_LIMIT: f"stopped after {problem.step_limit} steps",
        RunStatus.TIME_LIMIT: f"stopped after {problem.time_limit:g} s of wall time",
    }[status]
