"""The smooth flow between switches by SciPy's DOP853: slow, and independent of the compiled one."""

from typing import Any

import numpy as np
import scipy.integrate
from scipy.optimize import brentq

from rbstab.integrate.problem import Problem, Switching
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.driver import Hit, Reached
from rbstab.integrate.switching.modes import connector_of, system_under, thresholds
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

LOOKS_PER_STEP = 16
"""Points of a step at which its thresholds are looked at."""

RETURN_SHARE = 1.2
"""How long a step may be, in flights of the axis that is next to come back to the surface."""


class ScipyFlow:
    """Flows of one problem by DOP853, its events located on its dense output."""

    def __init__(self, problem: Problem, switching: Switching) -> None:
        self.problem = problem
        self.switching = switching
        self.steps = 0
        self.evaluations = 0

    def advance(self, start: Reached, end: float, log: SwitchLog) -> Reached:
        """From a state to the next hit, or to a time (see `Flow`)."""
        system = system_under(self.problem.system, start.modes)
        watch = _Thresholds(system, start, self.switching, self.problem.range_bound)
        problem, now = self.problem, start
        while now.time < end:
            longest = min(end - now.time, _next_return(system, now.state))
            solver = scipy.integrate.DOP853(
                lambda _t, y: system.audited_rates(y),
                now.time,
                now.state,
                now.time + longest if now.time + longest < end else end,
                rtol=problem.rtol,
                atol=problem.atol,
            )
            while solver.status == "running":
                solver.step()
                self.steps += 1
                if solver.status == "failed" or not np.isfinite(solver.y).all():
                    status = RunStatus.SOLVER_FAILURE
                    return now._replace(hits=(), status=status)
                found = watch.first(solver)
                now = now._replace(time=float(solver.t), state=solver.y, hits=())
                if found is not None:
                    self.evaluations += solver.nfev
                    return now._replace(**found)
            self.evaluations += solver.nfev
        return now


class _Thresholds:
    """What ends a mode, as functions of the state that are positive beyond their threshold."""

    def __init__(
        self, system: System, start: Reached, switching: Switching, range_bound: float
    ) -> None:
        self.system = system
        self.connector = connector_of(system)
        self.range_bound = range_bound
        self.up, self.down = thresholds(system, start.modes, switching)
        self.held = np.array(start.modes.held)

    def beyond(self, y: Array) -> Array:
        """How far each quantity is beyond its threshold, shape (13,), in the order of `_hit`."""
        motion = self.system.motion(y[:12])
        s = self.connector.surface(motion.E, motion.F)
        reaction = np.full(3, 0.0)
        if self.held.any():
            reaction = self.held * self.system.observe(y[:12]).contact_force
        K_s = self.connector.K_s
        leaving = self.range_bound - regularity(motion.Theta)
        sides = [s - self.up, self.down - s, reaction - K_s, -reaction - K_s]
        return np.append(np.concatenate(sides), leaving)

    def first(self, solver: scipy.integrate.DOP853) -> dict[str, Any] | None:
        """The changes of a `Reached` at the first threshold that a step crossed, if any."""
        path = solver.dense_output()
        before = solver.t_old
        for after in np.linspace(solver.t_old, solver.t, LOOKS_PER_STEP + 1)[1:].tolist():
            beyond = self.beyond(path(after)) > 0
            if beyond.any():
                crossings = [
                    (self._locate(path, before, after, index), index)
                    for index in np.flatnonzero(beyond).tolist()
                ]
                time, index = min(crossings)
                hit = _hit(index)
                if hit is None:
                    return {"time": time, "state": path(time), "status": RunStatus.RANGE_LEFT}
                return {"time": time, "state": path(time), "hits": (hit,)}
            before = after
        return None

    def _locate(self, path: Any, before: float, after: float, index: int) -> float:
        def distance(t: float) -> float:
            return float(self.beyond(path(t))[index])

        # A threshold that is crossed from the very start of a step is crossed there.
        if distance(before) > 0:
            return before
        return float(brentq(distance, before, after, xtol=1e-16, rtol=9e-16))


def _hit(index: int) -> Hit | None:
    if index == 12:
        return None
    return Hit(index % 3, 1.0 if index % 6 < 3 else -1.0, release=index >= 6)


def _next_return(system: System, y: Array) -> float:
    """About when the first axis is back on s = E, if each keeps its acceleration, s."""
    connector = connector_of(system)
    if connector.rate_weight:
        return np.inf
    rates = system.rates(y[:12])
    E, F, acceleration = y[6:9], y[9:12], rates[9:12]
    with np.errstate(all="ignore"):
        # The later root of E + Fτ + ½ aτ² = 0 where the axis is pulled back.
        root = np.sqrt(F * F - 2.0 * acceleration * E)
        times = (np.abs(F) + root) / np.abs(acceleration)
    valid = times[np.isfinite(times) & (times > 0)]
    return RETURN_SHARE * float(valid.min()) if valid.size else np.inf
