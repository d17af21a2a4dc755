"""One integration of smooth equations by SciPy's integrators, driven step by step.

One-step methods end a step exactly on each sample, because SciPy's dense output is about twenty
times less accurate than its steps (and for Radau of lower order). LSODA would lose its history at
every restart, so its samples are interpolated. Its interpolant has the order of its steps. A step
also ends on each breakpoint of the inputs, where their next legs begin.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import scipy.integrate

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.length_watch import LengthWatch
from rbstab.integrate.problem import Problem, Progress, Trajectory, trajectory
from rbstab.integrate.range_exit import excess, first_exit, may_leave
from rbstab.integrate.status import RunStatus
from rbstab.integrate.step_ends import StepEnds
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.integrate.watched_rates import StopRun, WatchedRates, audited_rates_of
from rbstab.integrate.zero_length import ended_at, zero_length
from rbstab.mechanics.constraint import projected_state
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY
from rbstab.systems.system import System

NEEDS_JACOBIAN = ("Radau", "LSODA")
INTERPOLATED = ("LSODA",)


class ScipyRun:
    """One integration: its limits, its steps and its samples.

    Args:
        problem: The problem.
        progress: Called after every step.
        deadline: The deadline of the run.
    """

    def __init__(self, problem: Problem, progress: Progress | None, deadline: Deadline) -> None:
        self.problem = problem
        self.progress = progress
        self.deadline = deadline
        self.system = problem.system_at_start()
        self.rates = WatchedRates(self.system, deadline)
        self.lengths = LengthWatch(problem.system, problem.system.audited_size)
        self.projected: StraightLine | None = None
        if problem.project:
            size = problem.system.audited_size
            self.projected = StraightLine(_projected, problem.system, size)
        self.breakpoints = frozenset(problem.breakpoints())
        self.reached_breakpoints: list[float] = []
        self.t = float(problem.times[0])
        self.y = problem.audited_start()
        self.step_size: float | None = None
        self.samples: list[tuple[float, Array]] = []
        self.systems: list[System] = []
        self.steps = 0
        self.ends = StepEnds()
        self.ends.add(self.t, self.y, self.system)
        self._add_sample(self.t, self.y)

    def result(self) -> Trajectory:
        """Integrate, and return the trajectory; warnings of SciPy are the caller's."""
        status, reason = RunStatus.COMPLETED, ""
        try:
            self._check_start()
            self._integrate()
        except StopRun as stop:
            if self.t > self.samples[-1][0]:
                self._add_sample(self.t, self.y)
            self.ends.add(self.t, self.y, self.system)
            status, reason = stop.status, f"{stop} at t = {self.samples[-1][0]:.9g} s"
        return trajectory(
            self.problem,
            self.samples,
            status,
            reason,
            self.steps,
            self.rates.evaluations,
            tuple(self.systems),
            self.reached_breakpoints,
            self.ends,
        )

    def _add_sample(self, t: float, y: Array) -> None:
        self.samples.append((t, y))
        self.deadline.samples = len(self.samples)

    def _check_start(self) -> None:
        name = ended_at(self.problem.system, self.y)
        if name is not None:
            raise zero_length(name)
        if not (np.isfinite(self.y).all() and np.isfinite(self.rates(self.t, self.y)).all()):
            raise StopRun(RunStatus.DIVERGED, "the rates are not finite")
        if excess(self.y, self.problem.range_bound) >= 0:
            raise self._range_left()

    def _integrate(self) -> None:
        times = self.problem.times.tolist()
        if self.problem.method in INTERPOLATED and not self.breakpoints:
            for solver in self._steps_to(times[-1]):
                self._interpolate(solver.dense_output(), solver.t)
            return
        samples = frozenset(times) if self.breakpoints else ()
        for end in sorted(self.breakpoints.union(times[1:])) if self.breakpoints else times[1:]:
            self._follow_to(end)
            if end in self.breakpoints:
                self.reached_breakpoints.append(end)
                self._begin_leg(end)
            if not samples or end in samples:
                self._add_sample(end, self.y)

    def _follow_to(self, end: float) -> None:
        for _ in self._steps_to(end):
            pass

    def _begin_leg(self, t: float) -> None:
        """Begin the legs of a breakpoint."""
        assert self.problem.schedule is not None
        self.system = self.problem.schedule.system_at(self.problem.system, t)
        self.rates.audited_rates = audited_rates_of(self.system)

    def _steps_to(self, end: float) -> Iterator[Any]:
        """Step until `end`; yield the solver after each step, before its state is accepted."""
        while self.t < end:
            solver = self._call_solver(self._new_solver, end)
            while solver.status == "running":
                self._step(solver)
                self._check_range(solver)
                yield solver
                self._accept(solver)
                if self.problem.project:
                    break

    def _new_solver(self, end: float) -> Any:
        problem = self.problem
        options: dict[str, Any] = {"rtol": problem.rtol, "atol": problem.atol}
        if self.step_size is not None:
            options["first_step"] = min(self.step_size, end - self.t)
        if problem.method in NEEDS_JACOBIAN:
            options["jac"] = self.rates.jacobian
        method = getattr(scipy.integrate, problem.method)
        return method(self.rates, self.t, self.y, end, **options)

    def _step(self, solver: Any) -> None:
        if self.steps >= self.problem.step_limit:
            raise StopRun(RunStatus.STEP_LIMIT, f"stopped after {self.steps} steps")
        message = self._call_solver(solver.step)
        if solver.status == "failed":
            if self.rates.non_finite_count:
                raise StopRun(RunStatus.DIVERGED, "the rates stopped being finite")
            raise StopRun(RunStatus.SOLVER_FAILURE, f"{self.problem.method}: {message}")
        if not np.isfinite(solver.y).all():
            raise StopRun(RunStatus.DIVERGED, "the state stopped being finite")
        if solver.t <= self.t:
            # LSODA can repeat this until a limit is reached.
            raise StopRun(RunStatus.SOLVER_FAILURE, f"{self.problem.method}: a step of zero length")
        self.steps += 1

    def _call_solver(self, action: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return action(*arguments)
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            # Implicit methods factorize matrices and reject those that contain infinities.
            raise StopRun(RunStatus.SOLVER_FAILURE, f"{self.problem.method}: {error}") from error

    def _accept(self, solver: Any) -> None:
        proposal = float(getattr(solver, "h_abs", solver.step_size))
        if solver.status == "finished" and self.step_size is not None:
            # This step was cut short to end on a sample. Continue with the step size that the
            # method proposed before.
            proposal = max(proposal, self.step_size)
        self.step_size = proposal
        self.t, self.y = float(solver.t), solver.y
        if self.projected is not None:
            self.y = self.projected(self.y)
        self.ends.add(self.t, self.y, self.system)
        if self.progress is not None:
            self.progress(self.t)

    def _check_range(self, solver: Any) -> None:
        """Stop the run if cos θ2 fell to its bound within the last step, even if it rose again."""
        self._check_lengths(solver)
        bound = self.problem.range_bound
        if not may_leave(self.y, solver.y, solver.t - solver.t_old, bound):
            return
        path = solver.dense_output()
        stop = first_exit(path, solver.t_old, solver.t, bound)
        if stop is not None:
            if self.problem.method in INTERPOLATED:
                self._interpolate(path, stop)
            self.t, self.y = stop, path(stop)
            raise self._range_left()

    def _check_lengths(self, solver: Any) -> None:
        """Stop the run if a spring lost its length within the last step."""
        if not self.lengths.owners:
            return
        rates = self.rates(solver.t, solver.y)
        times = solver.t_old, solver.t
        stop = self.lengths.stop_in_step(solver.dense_output, times, solver.y, rates)
        if stop is not None:
            path = solver.dense_output()
            if self.problem.method in INTERPOLATED:
                self._interpolate(path, stop[0])
            self.t, self.y = stop[0], path(stop[0])
            raise zero_length(stop[1])

    def _range_left(self) -> StopRun:
        bound = self.problem.range_bound
        return StopRun(RunStatus.RANGE_LEFT, f"cos θ2 fell to {bound:g}")

    def _interpolate(self, path: Callable[[float], Array], until: float) -> None:
        times = self.problem.times
        sample_times = times[(times > self.t) & (times <= until)].tolist()
        for t in sample_times:
            # One step may span all samples.
            if self.deadline.expired():
                raise StopRun(RunStatus.TIME_LIMIT, self.deadline.reason)
            self._add_sample(t, path(t))


def _projected(system: System, y: Array) -> Array:
    """Return an audited state whose motion is projected onto the submanifold E = F = 0."""
    return np.concatenate([projected_state(system.body, system.anchor, y[BODY]), y[BODY.stop :]])
