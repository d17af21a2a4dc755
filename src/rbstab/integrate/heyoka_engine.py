"""The compiled engine: Taylor integration by heyoka, the equations traced once per structure.

Every parameter of a system becomes a `par[]` of the compiled integrator, so one compilation serves
all systems of a structure. Its dense output is as accurate as its steps.
"""

import time
from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.compiled_once import compiled_once
from rbstab.integrate.laws import follow_sliding
from rbstab.integrate.problem import Problem, Progress, Trajectory, trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching import Switching
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.constraint import projected_state
from rbstab.mechanics.numbers import Array, cos_of, sin_of
from rbstab.systems.parameters import map_parameters, parameters, structure
from rbstab.systems.system import AUDIT_SIZE, System

sin_of.register(hy.expression, hy.sin)
cos_of.register(hy.expression, hy.cos)

# What heyoka would log (a step that is not a number) is a status here.
hy.set_logger_level_critical()

STATUSES = {
    hy.taylor_outcome.time_limit: RunStatus.COMPLETED,  # heyoka's word for the end of the grid
    hy.taylor_outcome.step_limit: RunStatus.STEP_LIMIT,
    hy.taylor_outcome.err_nf_state: RunStatus.DIVERGED,
}


def integrate(problem: Problem, progress: Progress | None = None) -> Trajectory:
    """Integrates a problem with heyoka; `rtol` is its one tolerance (see `Engine`)."""
    if problem.switching is not None:
        return _integrate_switching(problem, problem.switching, progress)
    start, first = problem.audited_start(), float(problem.times[0])
    status = status_at_start(problem)
    if status is not None:
        detail = f"{reason(status, problem)} at t = {first:.9g} s"
        return trajectory([(first, start)], status, detail, 0, 0)
    compiled = compiled_system(problem.system, problem.rtol)
    # The clock starts here: a compilation cannot be stopped, and is made once only.
    watch = Watch(problem, progress)
    outcome, steps, reached = compiled.run(problem, watch)
    status = watch.status or STATUSES.get(outcome, RunStatus.RANGE_LEFT)
    rows = list(zip(problem.times.tolist(), reached, strict=False)) or [(first, start)]
    if len(rows) == len(problem.times):
        # A limit that was used up by the last step stopped nothing.
        status = RunStatus.COMPLETED
    detail = ""
    if status is not RunStatus.COMPLETED:
        stop, state = compiled.reached()
        if np.isfinite(state).all() and stop > rows[-1][0]:
            rows.append((stop, state))
        detail = f"{reason(status, problem)} at t = {rows[-1][0]:.9g} s"
    return trajectory(rows, status, detail, steps, steps)


def _integrate_switching(
    problem: Problem, switching: Switching, progress: Progress | None
) -> Trajectory:
    # Imported late: both are built on what this module compiles with.
    from rbstab.integrate.heyoka_flow import HeyokaFlow
    from rbstab.integrate.heyoka_stepper import compiled_stepper

    with np.errstate(all="ignore"):
        return follow_sliding(
            problem,
            switching,
            lambda given: HeyokaFlow(given, switching),
            lambda: compiled_stepper(problem.system),
            progress,
        )


def open_symbol(index: int) -> Any:
    """The symbol of one open parameter."""
    return hy.par[index]


def symbols_of(
    system: System, symbol_of: Callable[[int], Any] = open_symbol
) -> tuple[System, dict[str, int], int]:
    """A system whose parameters are symbols, by default `par[]`.

    Args:
        system: Any system of the structure.
        symbol_of: What stands for the parameter of that index.

    Returns:
        The symbolic system, the index of each parameter's first symbol, and the number of symbols.
    """
    offsets: dict[str, int] = {}
    count = 0

    def symbol(name: str, value: Array) -> Array:
        nonlocal count
        offsets[name] = count
        symbols = [symbol_of(count + k) for k in range(value.size)]
        count += value.size
        return np.array(symbols, dtype=object).reshape(value.shape)

    return map_parameters(system, symbol), offsets, count


def state_symbols(size: int) -> Array:
    """The symbols of a state vector."""
    return np.array([hy.expression(f"y{k}") for k in range(size)], dtype=object)


def parameter_values(system: System) -> Array:
    """The values that belong to the symbols of `symbols_of`, in their order."""
    return np.concatenate([np.ravel(value) for value in parameters(system).values()])


def scaled_audit(rates: Array, scale: Any) -> Array:
    """Audited rates with those of the audit states in units of an energy.

    heyoka measures its error against the largest of all states. Audit states are energies, as large
    as the body is heavy: unscaled they would drown the error of the motion.
    """
    return np.concatenate([rates[:-AUDIT_SIZE], rates[-AUDIT_SIZE:] / scale])


class CompiledSystem:
    """The audited equations of one structure, compiled, with their parameters open.

    Args:
        system: Any system of the structure.
        tolerance: heyoka's tolerance, relative or absolute, whichever is larger for a state.
    """

    def __init__(self, system: System, tolerance: float) -> None:
        symbolic, self.names, count = symbols_of(system)
        y = state_symbols(system.size + AUDIT_SIZE)
        bound, self.scale = hy.par[count], 1.0
        leaving = regularity(y[0:3]) - bound
        rates = scaled_audit(symbolic.audited_rates(y), hy.par[count + 1])
        self.integrator = hy.taylor_adaptive(
            list(zip(y, rates, strict=True)),
            state=[0.0] * len(y),
            tol=tolerance,
            t_events=[hy.t_event(leaving)],
        )

    def run(self, problem: Problem, watch: "Watch") -> tuple[Any, int, Array]:
        """Integrates over the problem's samples.

        Returns:
            heyoka's outcome, the number of steps, and the samples reached, shape (n, states).
        """
        integrator = self.integrator
        self.scale = energy_scale(problem)
        extra = [problem.range_bound, self.scale]
        # Symbols behind the last one that the equations use are not there.
        values = np.concatenate([parameter_values(problem.system), extra])
        integrator.pars[:] = values[: len(integrator.pars)]
        integrator.time = problem.times[0]
        integrator.state[:] = problem.audited_start()
        integrator.reset_cooldowns()
        outcome, _, _, steps, _, samples = integrator.propagate_grid(
            problem.times, max_steps=problem.step_limit, callback=watch
        )
        return outcome, steps, self._in_joules(samples)

    def reached(self) -> tuple[float, Array]:
        """The time and the state where the last run ended."""
        return self.integrator.time, self._in_joules(self.integrator.state.copy())

    def _in_joules(self, states: Array) -> Array:
        states[..., -AUDIT_SIZE:] *= self.scale
        return states


def energy_scale(problem: Problem) -> float:
    """The size of the energies at the start, J; 1 J where there are none, or more than numbers."""
    with np.errstate(all="ignore"):
        size = float(np.abs(problem.system.observe(problem.start).energy).sum())
    return size if 0.0 < size < np.inf else 1.0


def compiled_system(system: System, tolerance: float) -> CompiledSystem:
    """The compiled equations of a system's structure, made once in each thread."""
    key = CompiledSystem, structure(system), tolerance
    return compiled_once(key, lambda: CompiledSystem(system, tolerance))


class Watch:
    """What is looked at after every step: the clock, the sub manifold, the progress."""

    def __init__(self, problem: Problem, progress: Progress | None) -> None:
        self.deadline = time.monotonic() + problem.time_limit
        self.system = problem.system if problem.project else None
        self.progress = progress
        self.status: RunStatus | None = None

    def __call__(self, integrator: Any) -> bool:
        """Whether the run goes on; heyoka asks after every step."""
        if self.system is not None:
            state = integrator.state
            state[:12] = projected_state(self.system.body, self.system.anchor, state[:12])
        if self.progress is not None:
            self.progress(integrator.time)
        if time.monotonic() > self.deadline:
            self.status = RunStatus.TIME_LIMIT
        return self.status is None


def status_at_start(problem: Problem) -> RunStatus | None:
    """How a run ends that cannot begin, or None."""
    start = problem.start
    with np.errstate(all="ignore"):
        rates = problem.system.audited_rates(problem.audited_start())
    if not (np.isfinite(start).all() and np.isfinite(rates).all()):
        return RunStatus.DIVERGED
    if regularity(start[0:3]) <= problem.range_bound:
        return RunStatus.RANGE_LEFT
    return None


def reason(status: RunStatus, problem: Problem) -> str:
    """Why a run stopped, in words."""
    return {
        RunStatus.RANGE_LEFT: f"cos θ2 fell to {problem.range_bound:g}",
        RunStatus.DIVERGED: "the state stopped being finite",
        RunStatus.STEP_LIMIT: f"stopped after {problem.step_limit} steps",
        RunStatus.TIME_LIMIT: f"stopped after {problem.time_limit:g} s of wall time",
    }[status]
