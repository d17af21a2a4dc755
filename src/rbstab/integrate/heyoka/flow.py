"""Integration between switches with the compiled engine."""

from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.integrator_state import (
    MIN_STEP,
    set_motion,
    set_parameters,
    shortened,
)
from rbstab.integrate.heyoka.switched_system import (
    CompiledSwitchedSystem,
    WeakChatter,
    compiled_modes,
)
from rbstab.integrate.heyoka.symbols import energy_scale
from rbstab.integrate.problem import Problem, Switching
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.driver import DriverState, SwitchEvent
from rbstab.integrate.switching.filippov import coincidence_distance
from rbstab.integrate.switching.modes import (
    ROUND_OFF,
    UNREACHABLE,
    Modes,
    connector_of,
    thresholds,
)
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import E_OF_W, F_OF_W
from rbstab.systems.system import AUDIT_SIZE

EVENT_OFFSET = 1e-12
"""After a crossing, s is moved this far past its threshold, because heyoka's root isolation fails
if a step starts on a root. It is relative to |F| times the time since the last crossing, or to the
width of the layer."""

MAX_STEPS_PER_CALL = 20_000
"""Steps after which `advance` returns to the driver, which checks all limits."""

MISSED_TOLERANCE = 1e-15
"""m or m/s: if s is further beyond its threshold after a step, besides round-off, the step missed a
crossing. It is smaller than that of `mode_run`: s is put past its threshold after each crossing,
where a margin of `mode_run` stays at zero, up to round-off. Crossings inside the run need no
tolerance at all, for the same reason."""


class HeyokaFlow:
    """The flow of one problem (a `Flow`), by two compiled integrators: with and without held axes.

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
        self.deadline = deadline or Deadline(problem.time_limit)
        self.steps = 0
        self.on_position = connector_of(problem.system).rate_weight == 0.0
        self.scale = energy_scale(problem)
        self.setups: dict[Modes, _ModeSetup] = {}
        self.weak_chatter: WeakChatter | None = None
        if self.on_position and switching.sticks:
            with self.deadline.paused():
                self.weak_chatter = WeakChatter(problem.system, switching.stick_energy)

    @property
    def evaluations(self) -> int:
        """The number of Taylor expansions, one for each step."""
        return self.steps

    def advance(self, start: DriverState, end: float, log: SwitchLog) -> DriverState:
        """Integrate to the next event that the driver must handle, or to a time (see `Flow`)."""
        if start.modes not in self.setups:
            with self.deadline.paused():
                self.setups[start.modes] = self._setup(start.modes)
        run = _Run(self.setups[start.modes], start, log, self.deadline)
        driver_state = run.integrate_to(end, self.problem.step_limit - self.steps)
        self.steps += run.steps
        return driver_state

    def _setup(self, modes: Modes) -> "_ModeSetup":
        problem, switching = self.problem, self.switching
        compiled = compiled_modes(problem.system, problem.rtol, modes)
        system, connector = compiled.system, connector_of(compiled.system)
        # If an axis is held, its equivalent force jumps at a crossing. The driver must check this
        # force, so the crossing must end the run.
        switches_inside = self.on_position and not switching.layered and not modes.any_held
        upper, lower = thresholds(system, modes, switching)
        levels = np.concatenate([upper, lower])
        if switches_inside:
            # Both directions of a crossing count, because the sides change inside the run.
            levels[:] = 0.0
        is_used = np.abs(levels) < UNREACHABLE
        extra = [np.where(is_used, levels, 0.0), is_used, [problem.range_bound, self.scale]]
        values = np.concatenate([compiled.values, *extra])
        to_joules, from_joules = np.ones((2, system.size + AUDIT_SIZE))
        to_joules[-AUDIT_SIZE:], from_joules[-AUDIT_SIZE:] = self.scale, 1.0 / self.scale
        return _ModeSetup(
            compiled.switched,
            values,
            connector,
            EVENT_OFFSET * float(connector.layer_width) if switching.layered else 0.0,
            switches_inside,
            self.weak_chatter,
            [
                (axis, float(upper[axis]), float(lower[axis]))
                for axis in np.flatnonzero(is_used[:3] | is_used[3:]).tolist()
            ],
            to_joules,
            from_joules,
        )


class _ModeSetup(NamedTuple):
    """The inputs of a run in given modes, apart from its start.

    values are the values of the open parameters. thresholds are the axes with thresholds of s, each
    with the upper and the lower one. to_joules and from_joules are the factors between the states
    of the integrator, with scaled audit states, and those of the driver. See `_Run` for the rest.
    """

    switched: CompiledSwitchedSystem
    values: Array
    connector: SlidingConnector
    layer_offset: float
    switches_inside: bool
    weak_chatter: WeakChatter | None
    thresholds: list[tuple[int, float, float]]
    to_joules: Array
    from_joules: Array


class _Run:
    """One run of a compiled integrator, from a state to an event or a time.

    All data of earlier runs are reset. With `switches_inside`, crossings of s = E do not end the
    run: the axis changes sides, and the compiled integration continues.
    """

    def __init__(
        self, setup: _ModeSetup, start: DriverState, log: SwitchLog, deadline: Deadline
    ) -> None:
        self.integrator, self.dispatcher = setup.switched.integrator, setup.switched.dispatcher
        self.mode, self.log, self.deadline = setup.switched.mode, log, deadline
        self.connector, self.layer_offset = setup.connector, setup.layer_offset
        self.switches_inside, self.weak_chatter = setup.switches_inside, setup.weak_chatter
        self.thresholds, self.to_joules = setup.thresholds, setup.to_joules
        self.modes = start.modes
        set_parameters(self.integrator, setup.values)
        set_motion(self.integrator, start.time, start.state * setup.from_joules)
        self.events: list[SwitchEvent] = []
        self.left_range = self.missed = self.out_of_time = False
        self.steps = 0

    def integrate_to(self, end: float, steps_left: int) -> DriverState:
        """Integrate to an event, to a time, to the deadline, or for a number of steps.

        Args:
            end: The time, s.
            steps_left: The maximum number of steps.
        """
        self.dispatcher.handler = self
        try:
            return self._integrate_to(end, steps_left)
        finally:
            # The integrator is cached: a reference to this run would keep its log in memory.
            del self.dispatcher.handler

    def _integrate_to(self, end: float, steps_left: int) -> DriverState:
        self._save_checkpoint()
        max_step = np.inf
        while self.steps < steps_left:
            max_steps = min(MAX_STEPS_PER_CALL, steps_left - self.steps)
            if max_step != np.inf:
                max_steps = 1
            outcome, _, _, steps, _, _ = self.integrator.propagate_until(
                end, max_steps=max_steps, max_delta_t=max_step, callback=self._after_step
            )
            self.steps += steps
            if self.missed:
                max_step = self._undo_step()
                if max_step < MIN_STEP:
                    return self._failed(RunStatus.SOLVER_FAILURE, "its step became too small")
            elif (
                max_step == np.inf
                or self.events
                or self.out_of_time
                or outcome != hy.taylor_outcome.step_limit
            ):
                return self._driver_state(outcome)
            elif self.integrator.last_h != 0.0:
                # The missed crossing is behind. Steps may have any length again at once (those of
                # `mode_run` grow), for only then the compiled loop goes on without a return to
                # Python. A step of zero length does not count: an axis that starts on the surface
                # crosses it in such a step.
                max_step = np.inf
        return self._driver_state(hy.taylor_outcome.step_limit)

    def at_event(self, integrator: Any, event: SwitchEvent | None) -> bool:
        """Handle an event of the compiled integrator; return False to end the run."""
        if event is None:
            self.left_range = True
            return False
        if event.release or not self.switches_inside:
            self.events.append(event)
            if not event.release:
                self._move_past_threshold(integrator, event)
            return False
        modes, axis = integrator.pars[self.mode], event.axis
        if modes[axis] == event.direction:
            return True  # heyoka has found the last crossing of this axis again
        time, state = integrator.time, integrator.state
        elapsed = time - self.log.last_time
        continues = True
        for other in range(3):
            arriving = -modes[other] * state[F_OF_W.start + other]
            crosses_too = arriving > 0 and abs(state[E_OF_W.start + other]) <= coincidence_distance(
                arriving, elapsed
            )
            if other != axis and not crosses_too:
                continue
            # All simultaneous crossings are handled here: the next step would start after them.
            modes[other] = -modes[other]
            state[E_OF_W.start + other] = (
                modes[other] * EVENT_OFFSET * abs(state[F_OF_W.start + other]) * elapsed
            )
            continues = self.log.add_switch(time, other)
        if self.weak_chatter is None or self.log.total < self.log.next_stick_test:
            return continues
        return continues and not self.weak_chatter(state)

    def _move_past_threshold(self, integrator: Any, event: SwitchEvent) -> None:
        """Move s slightly past the threshold that it has just reached."""
        if self.connector.rate_weight:
            integrator.state[F_OF_W.start + event.axis] += event.direction * self.layer_offset
            return
        # `at_event` sets E to the same offset, also that of axes that cross at the same time. The
        # products are rounded in another order there, which the bits of stored runs depend on.
        flight = abs(integrator.state[F_OF_W.start + event.axis]) * (
            integrator.time - self.log.last_time
        )
        integrator.state[E_OF_W.start + event.axis] += event.direction * (
            self.layer_offset or EVENT_OFFSET * flight
        )

    def _after_step(self, integrator: Any) -> bool:
        if self.switches_inside:
            modes, (x, y, z) = integrator.pars[self.mode], integrator.state[E_OF_W]
            self.missed = x * modes[0] < 0 or y * modes[1] < 0 or z * modes[2] < 0
        elif self.thresholds:
            self.missed = self._is_beyond_threshold(integrator.state.tolist())
        if not self.missed:
            self._save_checkpoint()
        self.out_of_time = self.deadline.expired()
        return not (self.missed or self.out_of_time)

    def _is_beyond_threshold(self, state: list[Any]) -> bool:
        """Return whether s of an axis without an event is beyond its thresholds.

        This runs after every step, so it uses floats: arrays of three would take longer.
        """
        surface, E, F = self.connector.surface, state[E_OF_W], state[F_OF_W]
        known = [event.axis for event in self.events]
        for axis, upper, lower in self.thresholds:
            s = surface(E[axis], F[axis])
            tolerance = ROUND_OFF * surface(abs(E[axis]), abs(F[axis])) + MISSED_TOLERANCE
            if (s > upper + tolerance or s < lower - tolerance) and axis not in known:
                return True
        return False

    def _save_checkpoint(self) -> None:
        integrator = self.integrator
        # Only crossings inside the run change the modes and the log.
        inside = None
        if self.switches_inside:
            inside = integrator.pars[self.mode].copy(), self.log.checkpoint()
        self.checkpoint = integrator.time, integrator.state.copy(), inside

    def _undo_step(self) -> float:
        """Undo a step that missed a crossing; return the maximum length of its repetition."""
        integrator = self.integrator
        max_step = shortened(integrator.last_h)
        time, state, inside = self.checkpoint
        set_motion(integrator, time, state)
        if inside is not None:
            integrator.pars[self.mode], log = inside
            self.log.restore(log)
        self.missed = False
        self.events.clear()
        return max_step

    def _driver_state(self, outcome: Any) -> DriverState:
        integrator = self.integrator
        status = None
        if self.left_range:
            status = RunStatus.RANGE_LEFT
        elif outcome == hy.taylor_outcome.err_nf_state:
            return self._failed(RunStatus.DIVERGED, "")
        modes = self.modes
        if self.switches_inside:
            a, b, c = integrator.pars[self.mode].tolist()
            modes = modes._replace(mode=(a, b, c))
        state = integrator.state * self.to_joules
        return DriverState(integrator.time, state, modes, tuple(self.events), status)

    def _failed(self, status: RunStatus, reason: str) -> DriverState:
        """Return the state after the last good step, with a status and its reason."""
        time, state, _ = self.checkpoint
        return DriverState(time, state * self.to_joules, self.modes, status=status, reason=reason)
