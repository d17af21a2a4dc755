"""The smooth flow between switches by the compiled engine."""

from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.chatter import bouncing_energy
from rbstab.integrate.filippov import COINCIDENT
from rbstab.integrate.following import Hit, Reached
from rbstab.integrate.heyoka_engine import (
    energy_scale,
    parameter_values,
    scaled_audit,
    state_symbols,
    symbols_of,
)
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switch_log import SwitchLog
from rbstab.integrate.switching import (
    FAR,
    ROUND_OFF,
    Switching,
    connector_of,
    system_under,
    thresholds,
)
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import AUDIT_SIZE, System

COOLDOWN = 1e-10
"""s: a crossing that is found again this soon after itself is the same. heyoka's own choice is
longer than the bounces that a chatter comes to."""

CLEARANCE = 1e-12
"""By which part of its last flight (of the layer's width) an axis is set off its threshold after a
crossing: a root at the very start of a step makes heyoka's root isolation fail."""

SHORTEST_STEP = 1e-18
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
        self.compiled: dict[bool, _Switched] = {}
        self.weak: _WeakChatter | None = None
        if self.on_position and switching.sticks:
            self.weak = _WeakChatter(problem.system, switching.stick_energy)

    @property
    def evaluations(self) -> int:
        """Taylor expansions, one for each step."""
        return self.steps

    def advance(self, start: Reached, end: float, log: SwitchLog) -> Reached:
        """From a state to the next hit that has to be decided, or to a time (see `Flow`)."""
        held = start.modes.any_held
        if held not in self.compiled:
            system = system_under(self.problem.system, start.modes)
            self.compiled[held] = _Switched(system, self.problem.rtol, held=held)
        # With an axis held, a crossing makes its equivalent force jump, which has to be judged.
        flips = self.on_position and not self.switching.layered and not held
        run = _Run(
            self.compiled[held],
            self.problem,
            self.switching,
            start,
            log,
            flips=flips,
            weak=self.weak,
            scale=self.scale,
        )
        reached = run.to(end)
        self.steps += run.steps
        return reached


class _Switched:
    """The audited equations in W, compiled, with events at the thresholds of every axis."""

    def __init__(self, system: System, tolerance: float, *, held: bool) -> None:
        symbolic, self.offsets, first = symbols_of(system)
        y = state_symbols(12 + AUDIT_SIZE)
        up, down, uses_up, uses_down = (
            [hy.par[first + 3 * kind + axis] for axis in range(3)] for kind in range(4)
        )
        bound, scale = hy.par[first + 12], hy.par[first + 13]
        connector = connector_of(symbolic)
        motion = symbolic.motion(y)
        s = connector.surface(motion.E, motion.F)
        self.sink = _Sink()
        events = [self._event(regularity(y[0:3]) - bound, None)]
        # heyoka counts event functions among the states when it chooses its steps, so they must not
        # be large: one that is not used is 1, and forces are in units of their bounds.
        for axis in range(3):
            above = uses_up[axis] * (s[axis] - up[axis]) + (1.0 - uses_up[axis])
            below = uses_down[axis] * (s[axis] - down[axis]) + (1.0 - uses_down[axis])
            events.append(self._event(above, Hit(axis, 1.0, release=False)))
            events.append(self._event(below, Hit(axis, -1.0, release=False)))
        if held:
            force = symbolic.observe(y).contact_force * symbolic.coordinates.held  # type: ignore[attr-defined]
            load = force / connector.K_s
            for axis in range(3):
                events.append(self._event(load[axis] - 1.0, Hit(axis, 1.0, release=True)))
                events.append(self._event(load[axis] + 1.0, Hit(axis, -1.0, release=True)))
        self.integrator = hy.taylor_adaptive(
            list(zip(y, scaled_audit(symbolic.audited_rates(y), scale), strict=True)),
            state=[0.0] * len(y),
            tol=tolerance,
            t_events=events,
            # With the equivalent force the code is so large that LLVM would need 20 s for it; there
            # are few events to be fast for.
            compact_mode=held,
        )

    def _event(self, quantity: Any, hit: Hit | None) -> Any:
        directions = hy.event_direction
        rising = (
            directions.positive if hit is not None and hit.direction > 0 else directions.negative
        )
        return hy.t_event(
            quantity, callback=_Callback(self.sink, hit), direction=rising, cooldown=COOLDOWN
        )


class _WeakChatter:
    """Whether the chatter energy e is below a bound, compiled.

    It is asked at every switch inside a run, so that neither how often it is asked nor the bound
    change the motion that is followed: pausing there would, by its last digits.
    """

    def __init__(self, system: System, bound: float) -> None:
        self.bound, self.K_s = bound, connector_of(system).K_s
        symbolic, _, _ = symbols_of(system)
        y = state_symbols(12)
        self.bouncing = hy.cfunc([bouncing_energy(symbolic, y)], vars=list(y))
        self.values = parameter_values(system)[: self.bouncing.nparams]

    def __call__(self, state: Array) -> bool:
        resting = self.K_s @ np.abs(state[6:9])
        if resting >= self.bound:
            return False
        return bool(self.bouncing(state[:12], pars=self.values)[0] + resting < self.bound)


class _Sink:
    """Where the events of an integrator report to: the run that uses it at the moment."""

    run: "_Run"


class _Callback:
    """What heyoka calls at an event. heyoka copies its callbacks; copies share the sink."""

    def __init__(self, sink: _Sink, hit: Hit | None) -> None:
        self.sink = sink
        self.hit = hit

    def __deepcopy__(self, _memo: Any) -> "_Callback":
        return self

    def __call__(self, integrator: Any, _direction: int) -> bool:
        return self.sink.run.at_event(integrator, self.hit)


class _Run:
    """One use of a compiled integrator, from one state to a hit or a time.

    With `flips`, crossings of s = E do not end it: the axis changes sides and the motion goes on
    without leaving compiled code for long.
    """

    def __init__(  # noqa: PLR0913 (what one run is made of)
        self,
        switched: _Switched,
        problem: Problem,
        switching: Switching,
        start: Reached,
        log: SwitchLog,
        *,
        flips: bool,
        weak: "_WeakChatter | None",
        scale: float,
    ) -> None:
        self.integrator = switched.integrator
        self.mode = slice(
            switched.offsets["connector.mode"], switched.offsets["connector.mode"] + 3
        )
        self.log, self.flips, self.weak = log, flips, weak
        system = system_under(problem.system, start.modes)
        connector = connector_of(system)
        self.connector = connector
        self.nudge = CLEARANCE * float(connector.layer_width) if switching.layered else 0.0
        self.modes = start.modes
        self.up, self.down = thresholds(system, start.modes, switching)
        ends = np.concatenate([self.up, self.down])
        if flips:
            # Both directions of a crossing count, for the sides change inside the run.
            ends[np.tile(np.array(start.modes.held) == 0.0, 2)] = 0.0
        used = np.abs(ends) < FAR
        self.scale = scale
        extra = [np.where(used, ends, 0.0), used, [problem.range_bound, scale]]
        values = np.concatenate([parameter_values(system), *extra])
        self.integrator.pars[:] = values[: len(self.integrator.pars)]
        self.integrator.time = start.time
        self.integrator.state[:] = self._scaled(start.state, 1.0 / scale)
        self.integrator.reset_cooldowns()
        self.hits: list[Hit] = []
        self.left_range = self.missed = False
        self.steps = 0
        switched.sink.run = self

    def to(self, end: float) -> Reached:
        """Integrates to a hit, to a time, or for `STEPS_AT_ONCE` steps."""
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
                if largest < SHORTEST_STEP:
                    return self._saved_with(RunStatus.SOLVER_FAILURE)
            elif largest == np.inf or self.hits or outcome != hy.taylor_outcome.step_limit:
                return self._reached(outcome)
            else:
                # Past what was missed the steps grow again.
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
