"""Integration of a sliding connector with exact switches, by Filippov's rules for the modes.

Between two switches the vector field is smooth, and an engine integrates it (a `Flow`). This module
chooses the modes after each switch. It is the same for both engines.
"""

from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Switching
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switch_trace import Transition
from rbstab.integrate.switching.chatter import chatter_energy, stick
from rbstab.integrate.switching.driver import DriverState, Sample, SwitchEvent, initial_driver_state
from rbstab.integrate.switching.modes import (
    ROUND_OFF,
    Modes,
    SurfaceDynamics,
    connector_of,
    modes_on_surface,
    system_for_modes,
    thresholds,
)
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY

RELEASE_OFFSET = 1e-13
"""m or m/s: the distance from the surface at which an axis is released. It is below the error of
the integration."""

START_TOLERANCE = 1e-12
"""m and m/s: an initial state this close to the surface counts as on it."""

COINCIDENCE_TOLERANCE = 1e-9
"""Relative to the time since the last crossing: axes that cross s = E within this time cross
together. This is far more than the round-off of `modes/phases.py`: each crossing moves s by a part
of the last bounce, and the next step could begin past the crossing of the other axis."""

SURFACE_TOLERANCE = 1e-13
"""Relative to |F| + κ|E|: an axis this close to its threshold of s = F + κE counts as on it."""

MAX_EVENTS_PER_INSTANT = 100
"""The run fails after this many flows in a row that end at the same time."""


def coincidence_distance(F: Any, elapsed: float) -> Any:
    """Return how far from s = E an axis that moves towards it crosses together with another one, m.

    Args:
        F: The velocity of the axis, or of all axes, m/s.
        elapsed: The time since the last crossing, s.
    """
    return COINCIDENCE_TOLERANCE * elapsed * abs(F)


class Flow(Protocol):
    """The interface of a smooth flow, integrated by an engine.

    A flow may handle crossings of s = E without the driver, because only the sign of the mode
    changes. Such a flow records the crossings in the log. It returns when the log has reached its
    limit of switches, or when the chatter is weak.
    """

    @property
    def steps(self) -> int:
        """Accepted steps so far."""
        ...

    @property
    def evaluations(self) -> int:
        """Evaluations of the rates so far."""
        ...

    def advance(self, start: DriverState, end: float, log: SwitchLog) -> DriverState:
        """Integrate to the next event that the driver must handle, or to a time.

        The flow returns earlier if the run reaches its limit of steps or its deadline.
        """
        ...


class FilippovDriver:
    """The driver of a run in which each switch is located exactly (a `Driver`).

    Args:
        problem: The problem.
        switching: The rules for the modes.
        flow: The smooth flow of the problem.
        deadline: The deadline of the run; default one that starts now.
    """

    def __init__(
        self,
        problem: Problem,
        switching: Switching,
        flow: Flow,
        deadline: Deadline | None = None,
    ) -> None:
        self.problem = problem
        self.switching = switching
        self.flow = flow
        self.log = SwitchLog(switching.stored_switches, switching.switch_limit)
        self.on_position = connector_of(problem.system).rate_weight == 0.0
        self.discarded = 0.0
        self.deadline = deadline or Deadline(problem.time_limit)

    def samples(self) -> Iterator[Sample]:
        """Yield the samples in order; the last has a status if the run stopped early."""
        current = self._set_modes_at_start(initial_driver_state(self.problem, self.switching))
        times = self.problem.times.tolist()
        yield self._sample(current)
        for end in times[1:] if current.status is None else []:
            events_at_this_time = 0
            while current.time < end and current.status is None:
                begin = current.time
                current = self._handle_events(self.flow.advance(current, end, self.log))
                events_at_this_time = events_at_this_time + 1 if current.time == begin else 0
                if events_at_this_time > MAX_EVENTS_PER_INSTANT:
                    current = current._replace(
                        status=RunStatus.SOLVER_FAILURE, reason="too many switches at one time"
                    )
            yield self._sample(current)
            if current.status is not None:
                return

    def _sample(self, current: DriverState) -> Sample:
        return Sample(current, tuple(self.log.counts), self.discarded)

    @property
    def steps(self) -> int:
        """Accepted steps so far."""
        return self.flow.steps

    @property
    def evaluations(self) -> int:
        """Evaluations of the rates so far."""
        return self.flow.evaluations

    def _set_modes_at_start(self, current: DriverState) -> DriverState:
        """Return the start, with modes chosen for the axes that start on the surface."""
        if current.status is not None or self.switching.layered:
            return current
        system = self.problem.system
        motion, connector = system.motion(current.state[BODY]), connector_of(system)
        s = np.abs(connector.surface(motion.E, motion.F))
        distance = np.maximum(s, np.abs(motion.F)) if self.on_position else s
        axes = np.flatnonzero(distance <= START_TOLERANCE).tolist()
        if not axes:
            return current
        if not self.on_position:
            return self._set_modes(
                current, modes_on_surface(system, current.state[BODY], current.modes, axes)
            )
        modes, state = current.modes, current.state.copy()
        for axis in axes:
            modes = modes.with_axis(axis, 0.0, held=1.0)
            state[[6 + axis, 9 + axis]] = 0.0
        return self._release_overloaded(self._set_modes(current._replace(state=state), modes))

    def _handle_events(self, current: DriverState) -> DriverState:
        if current.status is not None:
            return current
        if not (current.events or self.on_position):
            return current._replace(status=self._limit_reached())
        crossings = [event for event in current.events if not event.release]
        for event in current.events:
            if event.release:
                current = self._release(current, event)
        current = self._handle_crossings(current, crossings)
        if self.on_position and self._stick_test_is_due(current):
            current = self._test_sticking(current)
        if self.on_position and current.modes.any_held:
            current = self._release_overloaded(current)
        return current._replace(events=(), status=self._limit_reached())

    def _stick_test_is_due(self, current: DriverState) -> bool:
        """Return whether this is a crossing at which sticking must be tested.

        A release is excluded, because its force is at the bound. A sample is excluded, because it
        is not an event.
        """
        has_release = any(event.release for event in current.events)
        is_due = self.switching.sticks and self.log.total >= self.log.next_stick_test
        return (
            is_due and not has_release and self.log.total > 0 and current.time == self.log.last_time
        )

    def _limit_reached(self) -> RunStatus | None:
        if self.log.total >= self.switching.switch_limit:
            return RunStatus.SWITCH_LIMIT
        if self.flow.steps >= self.problem.step_limit:
            return RunStatus.STEP_LIMIT
        return RunStatus.TIME_LIMIT if self.deadline.expired() else None

    def _handle_crossings(self, current: DriverState, events: list[SwitchEvent]) -> DriverState:
        """Change the modes of all axes that cross their thresholds now, to round-off."""
        if not events:
            return current
        events = events + self._simultaneous_crossings(current, events)
        for event in events:
            self.log.add_switch(current.time, event.axis)
        modes = current.modes
        if not self.switching.layered and not self.on_position:
            crossing_axes = {event.axis for event in events}
            surface_axes = [a for a in range(3) if a in crossing_axes or modes.held[a]]
            chosen_modes = modes_on_surface(
                self.problem.system, current.state[BODY], modes, surface_axes
            )
            return self._set_modes(current, chosen_modes)
        for event in events:
            if self.switching.layered and modes.layer[event.axis]:
                modes = modes.with_axis(event.axis, event.direction)
            elif self.switching.layered:
                modes = modes.with_axis(event.axis, 0.0, layer=1.0)
            else:
                modes = modes.with_axis(event.axis, event.direction)
        return current._replace(modes=modes)

    def _simultaneous_crossings(
        self, current: DriverState, events: list[SwitchEvent]
    ) -> list[SwitchEvent]:
        """Return the crossings of other axes at the same time, to round-off.

        A flow stops at the first crossing. The other crossings would lie before the start of the
        next flow, which would miss them.
        """
        system = system_for_modes(self.problem.system, current.modes)
        motion = system.motion(current.state[BODY])
        connector = connector_of(system)
        s = connector.surface(motion.E, motion.F)
        tolerance = SURFACE_TOLERANCE * connector.surface(np.abs(motion.E), np.abs(motion.F))
        if self.on_position:
            tolerance = coincidence_distance(motion.F, current.time - self.log.last_time)
        upper, lower = thresholds(system, current.modes, self.switching)
        known_axes = {event.axis for event in events}
        found = []
        rate: Array | None = None
        for axis in range(3):
            at_threshold = (
                min(abs(s[axis] - upper[axis]), abs(s[axis] - lower[axis])) <= tolerance[axis]
            )
            if axis in known_axes or not at_threshold:
                continue
            if rate is None:
                rate = SurfaceDynamics(system, current.state[BODY]).surface_rate
            direction = 1.0 if abs(s[axis] - upper[axis]) <= tolerance[axis] else -1.0
            if direction * rate[axis] > 0:
                found.append(SwitchEvent(axis, direction, release=False))
        return found

    def _set_modes(self, current: DriverState, chosen_modes: Modes) -> DriverState:
        """Set the modes, and record the sticks and releases."""
        for axis in range(3):
            if chosen_modes.held[axis] != current.modes.held[axis]:
                kind = Transition.STICK if chosen_modes.held[axis] else Transition.RELEASE
                self.log.add_transition(current.time, axis, kind)
        return current._replace(modes=chosen_modes)

    def _release(self, current: DriverState, event: SwitchEvent) -> DriverState:
        """Release an axis whose force has reached its bound; the force stays there, at -K_s σ.

        While the axis was held, round-off may have moved s to the wrong side. So s is placed at
        `RELEASE_OFFSET` on its new side.
        """
        self.log.add_switch(current.time, event.axis)
        self.log.add_transition(current.time, event.axis, Transition.RELEASE)
        side, axis, state = -event.direction, event.axis, current.state.copy()
        connector = connector_of(self.problem.system)
        if self.on_position:
            state[6 + axis], state[9 + axis] = side * RELEASE_OFFSET, 0.0
        else:
            state[9 + axis] = -float(connector.slope) * state[6 + axis] + side * RELEASE_OFFSET
        return current._replace(state=state, modes=current.modes.with_axis(axis, side))

    def _release_overloaded(self, current: DriverState) -> DriverState:
        """Release each held axis whose equivalent force is beyond its bound after a crossing."""
        for _ in range(3):
            force = SurfaceDynamics(
                system_for_modes(self.problem.system, current.modes), current.state[BODY]
            ).force
            load_ratio = np.abs(force) / connector_of(self.problem.system).K_s * current.modes.held
            axis = int(load_ratio.argmax())
            if load_ratio[axis] <= 1.0 + ROUND_OFF:
                break
            current = self._release(
                current, SwitchEvent(axis, float(np.sign(force[axis])), release=True)
            )
        return current

    def _test_sticking(self, current: DriverState) -> DriverState:
        system = system_for_modes(self.problem.system, current.modes)
        if chatter_energy(system, current.state) >= self.switching.stick_energy:
            return current
        found = stick(system, current.state, current.modes)
        self.log.schedule_stick_test()
        if found is None:
            return current
        self.discarded += found.discarded
        self.log.add_sticks(current.time, found.axes)
        return current._replace(state=found.state, modes=found.modes)
