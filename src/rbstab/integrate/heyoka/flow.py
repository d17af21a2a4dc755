"""The smooth flow between switches by the compiled engine."""

from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.integrate.heyoka.switched_system import Switched, WeakChatter, switched_system
from rbstab.integrate.heyoka.symbols import energy_scale, parameter_values
from rbstab.integrate.problem import Problem, Switching
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.driver import Hit, Reached
from rbstab.integrate.switching.filippov import COINCIDENT
from rbstab.integrate.switching.modes import (
    FAR,
    ROUND_OFF,
    Modes,
    connector_of,
    system_under,
    thresholds,
)
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import AUDIT_SIZE

CLEARANCE = 1e-12
"""By which part of its last flight (of the layer's width) an axis is set off its threshold after a
crossing: a root at the very start of a step makes heyoka's root isolation fail."""

MIN_STEP = 1e-18
"""s: a crossing that is missed by a shorter step is not found at all."""

FINER = 16
"""By how much a step is cut that missed a crossing."""

STEPS_AT_ONCE = 20_000
"""Steps between two looks at the clock."""

TINY = 1e-15
"""m or m/s: by how much s may stand beyond its threshold at a hit, besides round-off."""


class HeyokaFlow:
    """Flows of one problem: one compiled integrator without held axes, one with.

    Args:
        problem: The problem; its system holds the sliding connector.
        switching: How its modes change.
    """

    def __init__(self, problem: Problem, switching: Switching) -> None:
        self.problem = problem
        self.switching = switching
        self.steps = 0
        self.on_position = connector_of(problem.system).rate_weight == 0.0
        self.scale = energy_scale(problem)
        self.legs: dict[Modes, _Leg] = {}
        self.weak: WeakChatter | None = None
        if self.on_position and switching.sticks:
            self.weak = WeakChatter(problem.system, switching.stick_energy)

    @property
    def evaluations(self) -> int:
        """Taylor expansions, one for each step."""
        return self.steps

    def advance(self, start: Reached, end: float, log: SwitchLog) -> Reached:
        """From a state to the next hit that has to be decided, or to a time (see `Flow`)."""
        if start.modes not in self.legs:
            self.legs[start.modes] = self._leg(start.modes)
        run = _Run(self.legs[start.modes], start, log)
        reached = run.to(end)
        self.steps += run.steps
        return reached

    def _leg(self, modes: Modes) -> "_Leg":
        problem, switching = self.problem, self.switching
        system = system_under(problem.system, modes)
        connector = connector_of(system)
        # With an axis held, a crossing makes its equivalent force jump, which has to be judged.
        flips = self.on_position and not switching.layered and not modes.any_held
        up, down = thresholds(system, modes, switching)
        ends = np.concatenate([up, down])
        if flips:
            # Both directions of a crossing count, for the sides change inside the run.
            ends[:] = 0.0
        used = np.abs(ends) < FAR
        extra = [np.where(used, ends, 0.0), used, [problem.range_bound, self.scale]]
        return _Leg(
            switched_system(system, problem.rtol),
            np.concatenate([parameter_values(system), *extra]),
            connector,
            CLEARANCE * float(connector.layer_width) if switching.layered else 0.0,
            flips,
            self.weak,
            up,
            down,
            self.scale,
        )


class _Leg(NamedTuple):
    """What a run under given modes is made of, whatever its start.

    values are those of the open parameters; up and down are the thresholds; see `_Run` for the
    rest.
    """

    switched: Switched
    values: Array
    connector: SlidingConnector
    nudge: float
    flips: bool
    weak: WeakChatter | None
    up: Array
    down: Array
    scale: float


class _Run:
    """One use of a compiled integrator, from one state to a hit or a time.

    Everything that the integrator remembers of another use is set anew. With `flips`, crossings of
    s = E do not end the run: the axis changes sides and the motion goes on without leaving compiled
    code for long.
    """

    def __init__(self, leg: _Leg, start: Reached, log: SwitchLog) -> None:
        self.integrator, self.sink = leg.switched.integrator, leg.switched.sink
        self.mode, self.log = leg.switched.mode, log
        self.connector, self.nudge, self.scale = leg.connector, leg.nudge, leg.scale
        self.flips, self.weak = leg.flips, leg.weak
        self.up, self.down = leg.up, leg.down
        self.modes = start.modes
        self.integrator.pars[:] = leg.values[: len(self.integrator.pars)]
        self.integrator.time = start.time
        self.integrator.state[:] = self._scaled(start.state, 1.0 / self.scale)
        self.integrator.reset_cooldowns()
        self.hits: list[Hit] = []
        self.left_range = self.missed = False
        self.steps = 0

    def to(self, end: float) -> Reached:
        """Integrates to a hit, to a time, or for `STEPS_AT_ONCE` steps."""
        self.sink.listener = self
        try:
            return self._to(end)
        finally:
            # What is compiled outlives its runs, which hold their logs.
            del self.sink.listener

    def _to(self, end: float) -> Reached:
        self._save()
        largest, whole = np.inf, np.inf
        while True:
            most = STEPS_AT_ONCE if largest == np.inf else 1
            outcome, _, _, steps, _, _ = self.integrator.propagate_until(
                end, max_steps=most, max_delta_t=largest, callback=self._after_step
            )
            self.steps += steps
            if self.missed:
                whole = abs(self.integrator.last_h)
                largest = self._go_back()
                if largest < MIN_STEP:
                    return self._saved_with(RunStatus.SOLVER_FAILURE)
            elif largest == np.inf or self.hits or outcome != hy.taylor_outcome.step_limit:
                return self._reached(outcome)
            elif self.integrator.last_h != 0.0:
                # Past what was missed the steps grow again. (An axis that starts on the surface
                # crosses it in a step of no length, which is past nothing.)
                largest = FINER * largest if FINER * largest < whole else np.inf

    def at_event(self, integrator: Any, hit: Hit | None) -> bool:
        """An event of the compiled integrator; false ends the run."""
        if hit is None:
            self.left_range = True
            return False
        if hit.release or not self.flips:
            self.hits.append(hit)
            if not hit.release:
                self._set_off(integrator, hit)
            return False
        modes, axis = integrator.pars[self.mode], hit.axis
        if modes[axis] == hit.direction:
            return True  # the crossing with which the axis entered this side, found once more
        time, state = integrator.time, integrator.state
        since = time - self.log.last_time
        goes_on = True
        for other in range(3):
            arriving = -modes[other] * state[9 + other]
            near = arriving > 0 and abs(state[6 + other]) <= COINCIDENT * since * arriving
            if other != axis and not near:
                continue
            # What crosses with it would be behind the start of the next step, and never be found.
            modes[other] = -modes[other]
            state[6 + other] = modes[other] * CLEARANCE * abs(state[9 + other]) * since
            goes_on = self.log.switch(time, other)
        if self.weak is None or self.log.total < self.log.look_from:
            return goes_on
        return goes_on and not self.weak(state)

    def _set_off(self, integrator: Any, hit: Hit) -> None:
        """Moves s a little past the threshold that it has just reached."""
        if self.connector.rate_weight:
            integrator.state[9 + hit.axis] += hit.direction * self.nudge
            return
        flight = abs(integrator.state[9 + hit.axis]) * (integrator.time - self.log.last_time)
        integrator.state[6 + hit.axis] += hit.direction * (self.nudge or CLEARANCE * flight)

    def _after_step(self, integrator: Any) -> bool:
        state = integrator.state
        if self.flips:
            modes = integrator.pars[self.mode]
            self.missed = (
                state[6] * modes[0] < 0 or state[7] * modes[1] < 0 or state[8] * modes[2] < 0
            )
        else:
            E, F = state[6:9], state[9:12]
            s = self.connector.surface(E, F)
            slack = ROUND_OFF * self.connector.surface(np.abs(E), np.abs(F)) + TINY
            beyond = (s > self.up + slack) | (s < self.down - slack)
            beyond[[hit.axis for hit in self.hits]] = False
            self.missed = bool(beyond.any())
        if not self.missed:
            self._save()
        return not self.missed

    def _save(self) -> None:
        integrator = self.integrator
        self.saved = (
            integrator.time,
            integrator.state.copy(),
            integrator.pars[self.mode].copy(),
            self.log.mark(),
        )

    def _go_back(self) -> float:
        """Undoes the step that missed a crossing; returns how long it may be at most."""
        integrator = self.integrator
        largest = abs(integrator.last_h) / FINER
        integrator.time, integrator.state[:], integrator.pars[self.mode], mark = self.saved
        self.log.back_to(mark)
        integrator.reset_cooldowns()
        self.missed = False
        self.hits.clear()
        return largest

    def _reached(self, outcome: Any) -> Reached:
        integrator = self.integrator
        status = None
        if self.left_range:
            status = RunStatus.RANGE_LEFT
        elif outcome == hy.taylor_outcome.err_nf_state:
            return self._saved_with(RunStatus.DIVERGED)
        modes = self.modes
        if self.flips:
            a, b, c = integrator.pars[self.mode].tolist()
            modes = modes._replace(mode=(a, b, c))
        state = self._scaled(integrator.state, self.scale)
        return Reached(integrator.time, state, modes, tuple(self.hits), status)

    def _saved_with(self, status: RunStatus) -> Reached:
        time, state, _, _ = self.saved
        return Reached(time, self._scaled(state, self.scale), self.modes, status=status)

    @staticmethod
    def _scaled(state: Array, factor: float) -> Array:
        """A copy of a state with its audit states in other units."""
        return np.concatenate([state[:-AUDIT_SIZE], state[-AUDIT_SIZE:] * factor])
