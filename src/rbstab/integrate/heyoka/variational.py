"""The motion and its derivative along one direction of the parameters and the start.

A system's parameters p and start y(0) are moved to p + s q and y(0) + s z(0). The derivative
z = ∂y/∂s at s = 0 obeys the variational equation ż = (∂f/∂y) z + (∂f/∂p) q, which heyoka derives
(`var_ode_sys`). Both p and q are open, so one compilation serves every direction of every system of
a structure, and what a config's quantities do to p and y(0) stays outside.
"""

import threading
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.engine import STATUSES, Watch, reason, status_at_start
from rbstab.integrate.heyoka.symbols import (
    energy_scale,
    parameter_values,
    state_symbols,
    symbols_of,
)
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.systems.parameters import structure
from rbstab.systems.system import System

TOLERANCE = 1e-15
"""Finer than a run's: a derivative that is small beside the motion is to be exact as well."""


@dataclass(frozen=True, eq=False)
class Tangent:
    """How a problem moves with s.

    Args:
        parameters: q, in the order of `parameter_values`.
        start: z(0), shape (states,).
        rest_energy: The derivative of the stored energy of the rest state, J.
    """

    parameters: Array
    start: Array
    rest_energy: float


@dataclass(frozen=True, eq=False)
class Course:
    """A motion with its derivative along a tangent, at the samples that were reached.

    Args:
        times: Shape (n,), s.
        states: y, shape (n, states).
        tangents: z = ∂y/∂s, shape (n, states).
        lyapunov_integral: ∫v dt, shape (n,), J s.
        lyapunov_integral_tangent: Its derivative in s, shape (n,), J s.
        turnings: The times at which F_1, F_2, F_3 and E'F are zero, where the contact point is not
            held; four arrays, s.
        crossings: The times at which v crosses its threshold, s.
        status: How the run ended.
        detail: The same in words.
    """

    times: Array
    states: Array
    tangents: Array
    lyapunov_integral: Array
    lyapunov_integral_tangent: Array
    turnings: tuple[Array, ...]
    crossings: Array
    status: RunStatus
    detail: str


class VariationalSystem:
    """The equations of one structure with their derivative along an open direction, compiled.

    Compact mode: it compiles in 2 s instead of 40 s, and runs three times slower (some 10 ms).

    Args:
        system: Any system of the structure.
    """

    def __init__(self, system: System) -> None:
        self.size, self.count = system.size, parameter_values(system).size
        self.zeros: tuple[list[float], ...] = tuple([] for _ in range(5))
        # Behind all p and q: s, and what `_set` puts there in the same order.
        s, rest, rest_slope, scale, bound, level = (hy.par[2 * self.count + k] for k in range(6))
        symbolic, _, _ = symbols_of(system)
        moved, _, _ = symbols_of(system, lambda k: hy.par[k] + s * hy.par[self.count + k])
        y = state_symbols(self.size + 1)
        value = moved.observe(y).energy.sum() - (rest + s * rest_slope)
        rates = [*moved.rates(y), value / scale]
        equations = hy.var_ode_sys(list(zip(y, rates, strict=True)), [s], 1).sys
        self.integrator = hy.taylor_adaptive(
            equations,
            state=[0.0] * len(equations),
            tol=TOLERANCE,
            t_events=[hy.t_event(regularity(y[0:3]) - bound)],
            nt_events=self._events(symbolic, y, rest + level),
            compact_mode=True,
        )

    def _events(self, symbolic: System, y: Array, energy: Any) -> list[Any]:
        observation = symbolic.observe(y)
        watched = [observation.energy.sum() - energy]
        if not symbolic.coordinates.holds_contact:  # else E and F are zero at all times
            E, F = observation.motion.E, observation.motion.F
            watched += [*F, E @ F]
        return [
            hy.nt_event(expression, callback=_note(zeros))
            for expression, zeros in zip(watched, self.zeros, strict=False)
        ]

    def follow(
        self,
        problem: Problem,
        times: Array,
        rest_energy: float = 0.0,
        threshold: float = 0.0,
        tangent: Tangent | None = None,
    ) -> Course:
        """The motion of a problem and its derivative.

        Args:
            problem: The problem; its own samples and tolerances are not used.
            times: The samples, shape (n,), s, ascending, the first at the problem's start.
            rest_energy: The stored energy of the rest state, from which v counts, J.
            threshold: The value of v whose crossings are noted, J.
            tangent: The direction; none for the motion alone.
        """
        scale = energy_scale(problem)
        if tangent is None:
            tangent = Tangent(np.zeros(self.count), np.zeros(self.size), 0.0)
        status = status_at_start(problem)
        samples = np.zeros((0, 2 * (self.size + 1)))
        if status is None:
            self._set(problem, tangent, [rest_energy, tangent.rest_energy, scale], threshold)
            watch = Watch(problem, None)
            outcome, *_, samples = self.integrator.propagate_grid(
                times, max_steps=problem.step_limit, callback=watch
            )
            status = watch.status or STATUSES.get(outcome, RunStatus.RANGE_LEFT)
            if len(samples) == len(times):
                # A limit that was used up by the last step stopped nothing.
                status = RunStatus.COMPLETED
        detail = ""
        if status is not RunStatus.COMPLETED:
            stop = self.integrator.time if len(samples) else float(times[0])
            detail = f"{reason(status, problem)} at t = {stop:.9g} s"
        return self._course(times[: len(samples)], samples, scale, status, detail)

    def _course(
        self, times: Array, samples: Array, scale: float, status: RunStatus, detail: str
    ) -> Course:
        motion, derivative = samples[:, : self.size + 1], samples[:, self.size + 1 :]
        crossings, *turnings = (np.unique(zeros) for zeros in self.zeros)
        return Course(
            times,
            motion[:, :-1],
            derivative[:, :-1],
            motion[:, -1] * scale,
            derivative[:, -1] * scale,
            tuple(turnings),
            crossings,
            status,
            detail,
        )

    def _set(
        self, problem: Problem, tangent: Tangent, energies: list[float], threshold: float
    ) -> None:
        """Sets the parameters, the direction and the start, and forgets the last run."""
        integrator = self.integrator
        p, others = parameter_values(problem.system), [*energies, problem.range_bound, threshold]
        values = np.concatenate([p, tangent.parameters, [0.0], others])
        # Symbols behind the last one that the equations use are not there.
        integrator.pars[:] = values[: len(integrator.pars)]
        integrator.time = problem.times[0]
        # ∫v dt and its derivative start at zero.
        integrator.state[:] = np.concatenate([problem.start, [0.0], tangent.start, [0.0]])
        integrator.reset_cooldowns()
        for zeros in self.zeros:
            zeros.clear()


def _note(zeros: list[float]) -> Callable[[Any, float, int], None]:
    def note(_integrator: Any, time: float, _direction: int) -> None:
        zeros.append(time)

    return note


_compiled = threading.local()


def variational_system(system: System) -> VariationalSystem:
    """The compiled variational equations of a system's structure, made once in each thread."""
    cache: dict[Hashable, VariationalSystem] = _compiled.__dict__.setdefault("systems", {})
    key = structure(system)
    if key not in cache:
        cache[key] = VariationalSystem(system)
    return cache[key]
