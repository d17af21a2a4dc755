"""The engine that single runs use by default: SciPy's integrators, stepped by hand.

One-step methods are made to step exactly onto the samples, because SciPy's dense output is some
twenty times less accurate than its steps (and for Radau of lower order). LSODA, which would lose
its history at every restart, is sampled by its own interpolant, which has the order of its steps.
"""

import time
import warnings
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.integrate
from scipy.optimize import brentq

from rbstab.integrate.problem import Problem, Progress, Trajectory, trajectory
from rbstab.integrate.scipy_flow import ScipyFlow
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.implicit import plain_stepper
from rbstab.integrate.switching.laws import drive_sliding
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.constraint import projected_state
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array

NEEDS_JACOBIAN = ("Radau", "LSODA")
INTERPOLATED = ("LSODA",)

NOT_FINITE_IN_A_ROW = 1000
"""Evaluations without a finite rate after which a step will not recover; a step that shrinks from
1 s to round-off makes about 300."""

LOOKS_PER_STEP = 16
"""Points at which a step that may have left the range inside is looked at."""


def integrate(problem: Problem, progress: Progress | None = None) -> Trajectory:
    """Integrates a problem with the method of its name (see `Engine`)."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        # Overflow and failed steps become statuses; LSODA also says them as warnings.
        warnings.simplefilter("ignore")
        switching = problem.switching
        if switching is not None:
            return drive_sliding(
                problem,
                switching,
                lambda given: ScipyFlow(given, switching),
                lambda: plain_stepper(problem.system),
                progress,
            )
        return _Run(problem, progress).result()


class _Stop(Exception):
    """The run ends here, for a named reason."""

    def __init__(self, status: RunStatus, reason: str) -> None:
        super().__init__(reason)
        self.status = status


class _Run:
    """One integration: its budget, its steps and its samples."""

    def __init__(self, problem: Problem, progress: Progress | None) -> None:
        self.problem = problem
        self.progress = progress
        self.deadline = time.monotonic() + problem.time_limit
        self.largest_angle = float(np.arccos(problem.range_bound))
        self.t = float(problem.times[0])
        self.y = problem.audited_start()
        self.step_size: float | None = None
        self.samples = [(self.t, self.y)]
        self.steps = 0
        self.evaluations = 0
        self.not_finite = 0

    def result(self) -> Trajectory:
        status, reason = RunStatus.COMPLETED, ""
        try:
            self._check_start()
            self._follow()
        except _Stop as stop:
            status, reason = stop.status, f"{stop} at t = {self.t:.9g} s"
            if self.t > self.samples[-1][0]:
                self.samples.append((self.t, self.y))
        return trajectory(self.samples, status, reason, self.steps, self.evaluations)

    def rates(self, _t: float, y: Array) -> Array:
        """The rates, under the budget that no integrator watches while it is inside a step."""
        self.evaluations += 1
        if time.monotonic() > self.deadline:
            limit = self.problem.time_limit
            raise _Stop(RunStatus.TIME_LIMIT, f"stopped after {limit:g} s of wall time")
        rates = self.problem.system.audited_rates(y)
        self.not_finite = 0 if np.isfinite(rates).all() else self.not_finite + 1
        if self.not_finite > NOT_FINITE_IN_A_ROW:
            raise _Stop(RunStatus.DIVERGED, "the rates stopped being finite")
        return rates

    def rates_jacobian(self, _t: float, y: Array) -> Array:
        """The Jacobian of the rates, for implicit methods."""
        self.evaluations += len(y)
        return jacobian(self.problem.system.audited_rates, y)

    def _check_start(self) -> None:
        if not (np.isfinite(self.y).all() and np.isfinite(self.rates(self.t, self.y)).all()):
            raise _Stop(RunStatus.DIVERGED, "the rates are not finite")
        if regularity(self.y[0:3]) <= self.problem.range_bound:
            raise self._range_left()

    def _follow(self) -> None:
        times = self.problem.times.tolist()
        if self.problem.method in INTERPOLATED:
            for solver in self._steps_to(times[-1]):
                self._interpolate(solver.dense_output(), solver.t)
            return
        for end in times[1:]:
            for _ in self._steps_to(end):
                pass
            self.samples.append((end, self.y))

    def _steps_to(self, end: float) -> Iterator[Any]:
        """The solver before each step's state is taken over, until `end` is reached."""
        while self.t < end:
            solver = self._guarded(self._solver, end)
            while solver.status == "running":
                self._step(solver)
                yield solver
                self._accept(solver)
                if self.problem.project:
                    break

    def _solver(self, end: float) -> Any:
        problem = self.problem
        options: dict[str, Any] = {"rtol": problem.rtol, "atol": problem.atol}
        if self.step_size is not None:
            options["first_step"] = min(self.step_size, end - self.t)
        if problem.method in NEEDS_JACOBIAN:
            options["jac"] = self.rates_jacobian
        method = getattr(scipy.integrate, problem.method)
        return method(self.rates, self.t, self.y, end, **options)

    def _step(self, solver: Any) -> None:
        if self.steps >= self.problem.step_limit:
            raise _Stop(RunStatus.STEP_LIMIT, f"stopped after {self.steps} steps")
        message = self._guarded(solver.step)
        if solver.status == "failed":
            if self.not_finite:
                raise _Stop(RunStatus.DIVERGED, "the rates stopped being finite")
            raise _Stop(RunStatus.SOLVER_FAILURE, f"{self.problem.method}: {message}")
        if not np.isfinite(solver.y).all():
            raise _Stop(RunStatus.DIVERGED, "the state stopped being finite")
        if solver.t <= self.t:
            # LSODA can go on like this until a limit.
            raise _Stop(RunStatus.SOLVER_FAILURE, f"{self.problem.method}: a step of no length")
        self.steps += 1
        self._check_range(solver)

    def _guarded(self, action: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return action(*arguments)
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            # Implicit methods factorise matrices, and refuse those with infinities in them.
            raise _Stop(RunStatus.SOLVER_FAILURE, f"{self.problem.method}: {error}") from error

    def _accept(self, solver: Any) -> None:
        proposal = float(getattr(solver, "h_abs", solver.step_size))
        if solver.status == "finished" and self.step_size is not None:
            # This step was cut short to end on a sample; the method would go on with what it
            # proposed before.
            proposal = max(proposal, self.step_size)
        self.step_size = proposal
        self.t, self.y = float(solver.t), self._projected(solver.y)
        if self.progress is not None:
            self.progress(self.t)

    def _check_range(self, solver: Any) -> None:
        """Stops where cos θ2 fell to its bound within the last step, also if it came back."""
        y_old, y_new = self.y, solver.y
        farthest = max(abs(y_old[1]), abs(y_new[1]))
        speed = max(np.linalg.norm(y_old[3:6]), np.linalg.norm(y_new[3:6]))
        # |θ̇2| <= |Ω|, for the second row of B has unit length: so far inside, a step cannot have
        # reached the border.
        if farthest + speed * (solver.t - solver.t_old) < self.largest_angle:
            return
        path = solver.dense_output()

        def beyond(t: float) -> float:
            return self.problem.range_bound - float(regularity(path(t)[0:3]))

        looks = np.linspace(solver.t_old, solver.t, LOOKS_PER_STEP + 1).tolist()
        for before, after in pairwise(looks):
            if beyond(after) >= 0:
                # A projection, or the interpolant's own error, can put the start beyond the bound.
                outside = beyond(before) >= 0
                stop = before if outside else brentq(beyond, before, after, xtol=1e-15)
                if self.problem.method in INTERPOLATED:
                    self._interpolate(path, stop)
                self.t, self.y = stop, path(stop)
                raise self._range_left()

    def _range_left(self) -> _Stop:
        bound = self.problem.range_bound
        return _Stop(RunStatus.RANGE_LEFT, f"cos θ2 fell to {bound:g}")

    def _interpolate(self, path: Callable[[float], Array], until: float) -> None:
        times = self.problem.times
        inside = times[(times > self.t) & (times <= until)].tolist()
        self.samples += [(t, path(t)) for t in inside]

    def _projected(self, y: Array) -> Array:
        if not self.problem.project:
            return y
        system = self.problem.system
        return np.concatenate([projected_state(system.body, system.anchor, y[:12]), y[12:]])
