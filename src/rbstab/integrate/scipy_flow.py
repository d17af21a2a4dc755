"""Integration between switches with SciPy's DOP853: slow, but independent of heyoka.

It finds and locates events as `modes/first_switch.py` does, but for three differences, which suit a
sliding connector alone:

- The state at an event is that of the dense output. `modes/scipy_modes.py` repeats the step, so
  that it ends at the event. A chatter has an event in four of five steps, and each would be made
  twice.
- Only the signs at the tests within a step are looked at, so a pass through a threshold and back
  between two tests is not seen. There are twice as many tests, and on s = E a step ends soon after
  the next axis has returned to its surface.
- Of several events the first is taken interval by interval. The end of the range is one of them.
"""

from typing import Any

import numpy as np
import scipy.integrate

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.event_time import event_time
from rbstab.integrate.problem import Problem, Switching
from rbstab.integrate.range_exit import TESTS_PER_STEP, exit_inside, may_leave
from rbstab.integrate.status import RunStatus
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.integrate.switching.driver import DriverState, SwitchEvent
from rbstab.integrate.switching.modes import Modes, connector_of, system_for_modes, thresholds
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.integrate.watched_rates import StopRun, WatchedRates, audited_rates_of
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY, E_OF_W, F_OF_W
from rbstab.systems.system import AUDIT_SIZE, System

RANGE_END = 12
"""The index of the event function of the range; see `_switch_event`."""

RETURN_TIME_FACTOR = 1.2
"""The longest integration in one call, relative to the time until an axis returns to E = 0."""


class ScipyFlow:
    """The flow of one problem, by DOP853 (a `Flow`). Events are located on the dense output.

    Args:
        problem: The problem; its system contains the sliding connector.
        switching: The rules for its modes.
        deadline: The deadline of the run; default one that starts now.
    """

    def __init__(
        self, problem: Problem, switching: Switching, deadline: Deadline | None = None
    ) -> None:
        self.problem = problem
        self.switching = switching
        self.steps = 0
        self._rates = WatchedRates(problem.system, deadline or Deadline(problem.time_limit))
        self._known_modes: dict[Modes, _EventFunctions] = {}

    @property
    def evaluations(self) -> int:
        """Evaluations of the rates so far."""
        return self._rates.evaluations

    def advance(self, start: DriverState, end: float, log: SwitchLog) -> DriverState:
        """Integrate to the next event, or to a time (see `Flow`)."""
        problem, current = self.problem, start
        event_functions = self._event_functions_of(start.modes)
        self._rates.audited_rates = event_functions.audited_rates
        try:
            while current.time < end:
                solver = self._new_solver(event_functions.system, current, end)
                while solver.status == "running":
                    if self.steps >= problem.step_limit:
                        return current
                    self._step(solver)
                    changes = event_functions.first_event(solver)
                    current = current._replace(time=float(solver.t), state=solver.y, events=())
                    if changes is not None:
                        return current._replace(**changes)
        except StopRun as stop:
            return current._replace(events=(), status=stop.status, reason=str(stop))
        return current

    def _event_functions_of(self, modes: Modes) -> "_EventFunctions":
        """Return the event functions of modes; they are made once, for modes return often."""
        if modes not in self._known_modes:
            self._known_modes[modes] = _EventFunctions(
                self.problem.system, modes, self.switching, self.problem.range_bound
            )
        return self._known_modes[modes]

    def _new_solver(self, system: System, current: DriverState, end: float) -> Any:
        problem = self.problem
        max_length = min(end - current.time, self._time_to_next_return(system, current.state))
        return scipy.integrate.DOP853(
            self._rates,
            current.time,
            current.state,
            current.time + max_length if current.time + max_length < end else end,
            rtol=problem.rtol,
            atol=problem.atol,
        )

    def _time_to_next_return(self, system: System, y: Array) -> float:
        """Return the seconds until the first axis returns to E = 0, at constant acceleration."""
        connector = connector_of(system)
        if connector.rate_weight:
            return np.inf
        rates = self._rates.audited_rates(y)
        E, F, acceleration = y[E_OF_W], y[F_OF_W], rates[F_OF_W]
        with np.errstate(all="ignore"):
            # The later root of E + Fτ + ½ aτ² = 0, for an axis that accelerates towards E = 0.
            root = np.sqrt(F * F - 2.0 * acceleration * E)
            times = (np.abs(F) + root) / np.abs(acceleration)
        valid = times[np.isfinite(times) & (times > 0)]
        return RETURN_TIME_FACTOR * float(valid.min()) if valid.size else np.inf

    def _step(self, solver: Any) -> None:
        solver.step()
        self.steps += 1
        if solver.status == "failed" and not self._rates.non_finite_count:
            raise StopRun(RunStatus.SOLVER_FAILURE, "its step became too small")
        if solver.status == "failed" or not np.isfinite(solver.y).all():
            raise StopRun(RunStatus.DIVERGED, "the state stopped being finite")


class _EventFunctions:
    """The smooth system for given modes, with the event functions that end these modes.

    Each event function is positive beyond its threshold.
    """

    def __init__(
        self, system: System, modes: Modes, switching: Switching, range_bound: float
    ) -> None:
        self.system = system_for_modes(system, modes)
        self.audited_rates = audited_rates_of(self.system)
        self.upper, self.lower = thresholds(system, modes, switching)
        self.K_s = connector_of(system).K_s
        self.held = np.array(modes.held)
        self.range_bound = range_bound
        levels = _levels_with_force if modes.any_held else _levels
        self.levels = StraightLine(levels, self.system, system.size + AUDIT_SIZE)

    def values(self, states: Array) -> Array:
        """Return the event functions at states, shape (n, 13), in the order of `_switch_event`.

        Args:
            states: Audited states, shape (n, states).
        """
        levels = np.array([self.levels(state) for state in states])
        s, cosine, force = levels[:, :3], levels[:, 3:4], self.held * levels[:, 4:]
        K_s = self.K_s
        values = (s - self.upper, self.lower - s, force - K_s, -force - K_s)
        return np.hstack([*values, self.range_bound - cosine])

    def first_event(self, solver: scipy.integrate.DOP853) -> dict[str, Any] | None:
        """Return the changes of a `DriverState` at the first event of a step, or None."""
        path = solver.dense_output()
        length = solver.t - solver.t_old
        is_near_end = may_leave(solver.y_old, solver.y, length, self.range_bound)
        before = solver.t_old
        times = np.linspace(solver.t_old, solver.t, TESTS_PER_STEP + 1)[1:]
        past = self.values(path(times).T) > 0
        if not (is_near_end or past.any()):
            return None
        for after, is_past in zip(times.tolist(), past, strict=True):
            crossings = [
                (self._locate(path, before, after, index), index)
                for index in np.flatnonzero(is_past).tolist()
            ]
            if is_near_end and not is_past[RANGE_END]:
                leaves = exit_inside(path, before, after, self.range_bound)
                crossings += [(leaves, RANGE_END)] if leaves is not None else []
            if crossings:
                time, index = min(crossings)
                event = _switch_event(index)
                if event is None:
                    return {"time": time, "state": path(time), "status": RunStatus.RANGE_LEFT}
                return {"time": time, "state": path(time), "events": (event,)}
            before = after
        return None

    def _locate(self, path: Any, before: float, after: float, index: int) -> float:
        def value(t: float) -> float:
            return float(self.values(path(t)[np.newaxis])[0, index])

        return event_time(value, before, after)


def _switch_event(index: int) -> SwitchEvent | None:
    if index == RANGE_END:
        return None
    return SwitchEvent(index % 3, 1.0 if index % 6 < 3 else -1.0, release=index >= 6)


def _levels(system: System, y: Array) -> Array:
    """Return s and cos θ2, and zeros for the force of held axes; shape (7,)."""
    motion = system.motion(y[BODY])
    s = connector_of(system).surface(motion.E, motion.F)
    return np.concatenate([s, [regularity(motion.Theta)], ZERO])


def _levels_with_force(system: System, y: Array) -> Array:
    """Return s, cos θ2 and Λ; shape (7,)."""
    return np.concatenate([_levels(system, y)[:4], system.observe(y).contact_force])
