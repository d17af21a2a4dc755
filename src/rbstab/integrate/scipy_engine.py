"""The default engine of single runs: SciPy's integrators, driven step by step.

One-step methods end a step exactly on each sample, because SciPy's dense output is about twenty
times less accurate than its steps (and for Radau of lower order). LSODA would lose its history at
every restart, so its samples are interpolated. Its interpolant has the order of its steps. A step
also ends on each breakpoint of the inputs, where their next legs begin.

A step in which a mode switches is repeated so that it ends at the switch. The time of the switch is
then corrected by the margin at the end of the repeated step. So the order of the method holds
through all switches.
"""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.integrate

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.driven_run import DrivenRun
from rbstab.integrate.events import Event, first_event
from rbstab.integrate.implicit import ImplicitRun
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.status import RunStatus, StopRun
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.integrate.switching.trust import integrate_trusted
from rbstab.mechanics.constraint import projected_state
from rbstab.mechanics.derivatives import derivative_along, jacobian
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY, OMEGA, PITCH
from rbstab.systems.system import System

MAX_NON_FINITE_IN_A_ROW = 1000
"""A run stops after this many evaluations in a row without finite rates. A step that shrinks from
1 s to round-off makes about 300."""

NEEDS_JACOBIAN = ("Radau", "LSODA")
INTERPOLATED = ("LSODA",)

MAX_CORRECTIONS = 4
"""The most repetitions of a step that ends at a switch. Two are enough, unless the margin falls so
slowly that its round-off hides the time."""

DECREASE = 0.5
"""A correction of the time that is not smaller than the last one times this is round-off."""


def integrate(
    problem: Problem, progress: Progress | None = None, deadline: Deadline | None = None
) -> Trajectory:
    """Integrate a problem with its method (an `Engine`).

    Args:
        problem: The problem.
        progress: As `Engine`.
        deadline: As `Engine`.
    """
    deadline = deadline or Deadline(problem.time_limit)

    def run(given: Problem, told: Progress | None) -> Trajectory:
        implicit = given.switching is not None and given.switching.step
        return (ImplicitRun if implicit else ScipyRun)(given, told, deadline).result()

    with warnings.catch_warnings(), np.errstate(all="ignore"):
        # Overflow and failed steps become statuses, so the warnings (LSODA's too) are not needed.
        warnings.simplefilter("ignore")
        return integrate_trusted(problem, run, progress, deadline)


class ScipyRun(DrivenRun):
    """One integration.

    Args:
        problem: The problem; the method is a one-step method if elements of its system switch.
        progress: Called after every step.
        deadline: The deadline of the run.
    """

    def __init__(self, problem: Problem, progress: Progress | None, deadline: Deadline) -> None:
        super().__init__(problem, progress, deadline)
        self.step_size: float | None = None
        self._non_finite = 0
        self._clearances = StraightLine(System.clearances, problem.system)
        self._projected = StraightLine(_projected, problem.system) if problem.project else None
        self._interpolates = problem.method in INTERPOLATED and not problem.breakpoints()
        self._largest_angle = float(np.arccos(problem.range_bound))

    def stops(self) -> list[float]:
        """Return the times on which a step must end, s."""
        if self._interpolates:
            return self.times[-1:]
        return sorted({*self.problem.breakpoints(), *self.times[1:]})

    def follow_to(self, stop: float) -> None:
        """Step to a time, s, or through the first event before it."""
        solver = self._call_solver(self._new_solver, stop)
        while solver.status == "running":
            self._step(solver)
            event = self._first_event(solver)
            if event is not None:
                self._end_at(event, solver)
                return
            self._accept(solver)
            if self.problem.project:
                return

    def _new_solver(self, end: float) -> Any:
        problem = self.problem
        options: dict[str, Any] = {"rtol": problem.rtol, "atol": problem.atol}
        if self.step_size is not None:
            options["first_step"] = min(self.step_size, end - self.t)
        if problem.method in NEEDS_JACOBIAN:
            options["jac"] = self._jacobian
        method = getattr(scipy.integrate, problem.method)
        return method(self._rates, self.t, self.y, end, **options)

    def _rates(self, t: float, y: Array) -> Array:
        """Return the audited rates. The run may end here: SciPy can repeat a step for ever."""
        self._evaluate(1)
        rates = self.phase.audited_rates.finite_value(y, t)
        if rates is not None:
            self._non_finite = 0
            return rates
        rates = self.phase.audited_rates.by_numpy(y, t)
        self._non_finite = 0 if np.isfinite(rates).all() else self._non_finite + 1
        if self._non_finite > MAX_NON_FINITE_IN_A_ROW:
            raise StopRun(RunStatus.DIVERGED, "the rates stopped being finite")
        return rates

    def _jacobian(self, t: float, y: Array) -> Array:
        """Return the Jacobian of the rates, for implicit methods."""
        self._evaluate(len(y))
        return jacobian(lambda z: self.phase.audited_rates(z, t), y)

    def _evaluate(self, count: int) -> None:
        self.evaluations += count
        self.check_deadline()

    def _step(self, solver: Any) -> None:
        self.check_limits()
        message = self._call_solver(solver.step)
        if solver.status == "failed":
            if self._non_finite:
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
        if self._interpolates:
            self._interpolate(solver.dense_output(), solver.t)
        self.t, self.y = float(solver.t), solver.y
        if self._projected is not None:
            self.y = self._projected(self.y)
        elif solver.status == "finished":
            # The next step is made by a new solver, so the state may be moved.
            self.y = self.phase.on_stop(self.y)
        self.keep_end()
        if self.progress is not None:
            self.progress(self.t)

    def _interpolate(self, path: Callable[[float], Array], until: float) -> None:
        times = self.problem.times
        for t in times[(times > self.t) & (times <= until)].tolist():
            # One step may span all samples.
            self.check_deadline()
            self.add_sample(t, path(t))

    # Events: the margins of modes, the distances of θ2 from both ends of the range, the clearances.

    def _first_event(self, solver: Any) -> Event | None:
        """Return the first event of the last step, or None."""
        ends, states = (self.t, float(solver.t)), (self.y, solver.y)
        only_lengths = not len(self.phase.signs) and not self._may_leave(ends, states)
        if only_lengths and not self.owners:
            return None
        falls, rises = slopes = tuple(map(self._event_rates, states, ends))
        # A length is smallest inside the step if it falls at the start and rises at the end.
        if only_lengths and not ((falls < 0) & (rises >= 0))[2:].any():
            return None
        return first_event(self._events, solver.dense_output(), ends, states, slopes)

    def _may_leave(self, ends: tuple[float, float], states: tuple[Array, Array]) -> bool:
        """Whether cos θ2 may have fallen to its bound in a step; the test is cheap and cautious."""
        # |θ̇2| <= |Ω|, because the second row of B has unit length. So a step with both ends far
        # enough inside the range cannot have reached the bound.
        angle = max(abs(y[PITCH]) for y in states)
        speed = max(np.linalg.norm(y[OMEGA]) for y in states)
        return not angle + speed * (ends[1] - ends[0]) < self._largest_angle

    def _events(self, y: Array, t: float) -> Array:
        pitch, most = y[PITCH], self._largest_angle
        margins, lengths = self.phase.margins(y, t), self._clearances(y)
        return np.concatenate([margins, [most - pitch, most + pitch], lengths])

    def _event_rates(self, y: Array, t: float) -> Array:
        rates = self.phase.audited_rates(y, t)
        margins = self.phase.margin_rates(y, t, rates)
        lengths = derivative_along(self._clearances, y, rates)
        return np.concatenate([margins, [-rates[PITCH], rates[PITCH]], lengths])

    def _end_at(self, event: Event, solver: Any) -> None:
        """Go to an event of the last step: the run ends there, or a mode switches."""
        number = event.number - len(self.phase.signs)
        if number < 0:
            self._step_to(event)
            coinciding = self.phase.coinciding(self.y, self.t).tolist()
            switched = sorted({event.number, *coinciding})
            self.cross(switched)
            return
        path = solver.dense_output()
        if self._interpolates:
            self._interpolate(path, event.time)
        self.t, self.y = event.time, path(event.time)
        raise self.end_of_range(number - 2)

    def _step_to(self, event: Event) -> None:
        """Make steps that end at a switch, instead of the step in which it was found."""
        target, last = event.time, np.inf
        for _ in range(MAX_CORRECTIONS):
            if target <= self.t:
                return
            solver = self._solver_at(target)
            margin = float(self.phase.margins(solver.y, solver.t)[event.number])
            rate = float(self.phase.margin_rates(solver.y, solver.t)[event.number])
            correction = -margin / rate if rate < 0 else 0.0
            small = abs(correction) <= float(np.spacing(target))
            inside = self.t < target + correction <= max(event.latest, target)
            if small or not inside or abs(correction) > DECREASE * last:
                break
            target, last = target + correction, abs(correction)
        self._accept(solver)

    def _solver_at(self, target: float) -> Any:
        """Return a solver that has arrived at a time; its last step is not accepted yet."""
        solver = self._call_solver(self._new_solver, target)
        self._step(solver)
        while solver.status == "running":
            # The first part of a step that was divided is before the switch.
            self._accept(solver)
            self._step(solver)
        return solver


def _projected(system: System, y: Array) -> Array:
    """Return an audited state whose motion is projected onto the submanifold E = F = 0."""
    return np.concatenate([projected_state(system.body, system.anchor, y[BODY]), y[BODY.stop :]])
