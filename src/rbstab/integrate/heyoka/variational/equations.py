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
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compile_cache import compiled_once
from rbstab.integrate.heyoka.symbols import (
    energy_scale,
    parameter_values,
    state_symbols,
    symbols_of,
)
from rbstab.integrate.heyoka.variational.run import Passage, Settings, Tangent, VariationalRun
from rbstab.integrate.problem import Problem
from rbstab.integrate.run import check_start
from rbstab.integrate.status import RunStatus, StopRun
from rbstab.integrate.switching.course import Course
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA
from rbstab.systems.parameters import structure
from rbstab.systems.system import System

TOLERANCE = 1e-15
"""Smaller than the tolerance of a run, so that derivatives much smaller than the states are also
accurate."""


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
        power_zeros: The times at which v' = 0, s, if inputs supply power; else empty.
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
        # After all p and q: s, and the `Settings`.
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
        rest_slope = 0.0 if tangent is None else tangent.rest_energy
        scale = energy_scale(problem)
        settings = Settings(
            levels.rest_energy, rest_slope, scale, problem.range_bound, levels.threshold
        )
        for zeros in self.zeros:
            zeros.clear()
        status, detail, run, rows = (
            RunStatus.COMPLETED,
            "",
            None,
            [np.zeros((0, 2 * self.size + 2))],
        )
        try:
            check_start(problem)
            run = VariationalRun(self, problem, course, settings, tangent)
            run.follow(times)
        except StopRun as stop:
            ended = self.integrator.time if run else float(times[0])
            status, detail = stop.status, f"{stop} at t = {ended:.9g} s"
        samples = np.concatenate(rows + (run.rows if run else []))
        if len(samples) == len(times):
            # A limit reached in the last step does not count.
            status, detail = RunStatus.COMPLETED, ""
        found = self._trajectory(times[: len(samples)], samples, scale, status, detail)
        return replace(found, passages=run.passages if run else {})

    def _trajectory(
        self, times: Array, samples: Array, scale: float, status: RunStatus, detail: str
    ) -> VariationalTrajectory:
        values, derivative = samples[:, : self.size + 1], samples[:, self.size + 1 :]
        crossings, *turning_times, power_zeros = (np.unique(zeros) for zeros in self.zeros)
        return VariationalTrajectory(
            times,
            values[:, :-1],
            derivative[:, :-1],
            values[:, -1] * scale,
            derivative[:, -1] * scale,
            tuple(turning_times),
            crossings,
            power_zeros,
            status,
            detail,
        )


def _append_time(zeros: list[float]) -> Callable[[Any, float, int], None]:
    def append_time(_integrator: Any, time: float, _direction: int) -> None:
        zeros.append(time)

    return append_time


def variational_system(system: System) -> VariationalSystem:
    """Return the variational equations of a system's structure, compiled once in each thread."""
    key = VariationalSystem, structure(system)
    return compiled_once(key, lambda: VariationalSystem(system))
