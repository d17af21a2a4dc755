"""Following a sliding connector through its modes: smooth flow between switches (Filippov).

Between two switches the vector field is smooth and either engine follows it (a `Flow`). What a
switch leads to is decided here, the same for both.
"""

import time
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from rbstab.integrate.problem import Problem, Switching
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switch_trace import Transition
from rbstab.integrate.switching.chatter import chatter_energy, stick
from rbstab.integrate.switching.driver import Hit, Reached, Sample, at_start
from rbstab.integrate.switching.modes import (
    ROUND_OFF,
    Modes,
    connector_of,
    instant,
    modes_on_surface,
    system_under,
    thresholds,
)
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.numbers import Array

LOOK_AGAIN = 32
"""Switches, at least, between two looks at which axes of a weak chatter may stick: a look costs as
much as many."""

SET_OFF = 1e-13
"""m or m/s: how far from its surface an axis is let go; below what an integration is exact to."""

AT_START = 1e-12
"""m and m/s: a start this near to its surface is on it."""

COINCIDENT = 1e-9
"""Of the time since the last crossing: axes that cross s = E within this cross together."""

AT_SURFACE = 1e-13
"""Of |F| + κ|E|: axes that are this near to their thresholds of s = F + κE are there."""

MAX_AT_ONCE = 100
"""Decisions at one instant, after which nothing will ever change."""

LOOK_AGAIN_SHARE = 64
"""Of all switches so far, this part may pass between two looks."""


class Flow(Protocol):
    """Follows the smooth motion of an engine.

    Crossings of s = E may be passed over inside (their mode simply changes sides); a flow that does
    so notes them in the log, and returns where that is full or where the chatter has become weak.
    """

    @property
    def steps(self) -> int:
        """Accepted steps so far."""
        ...

    @property
    def evaluations(self) -> int:
        """Evaluations of the rates so far."""
        ...

    def advance(self, start: Reached, end: float, log: SwitchLog) -> Reached:
        """From a state to the next hit that has to be decided, or to a time."""
        ...


class FilippovDriver:
    """One run through the modes of its connector, each switch at its time (a `Driver`)."""

    def __init__(self, problem: Problem, switching: Switching, flow: Flow) -> None:
        self.problem = problem
        self.switching = switching
        self.flow = flow
        self.log = SwitchLog(switching.stored_switches, switching.switch_limit)
        self.on_position = connector_of(problem.system).rate_weight == 0.0
        self.discarded = 0.0
        self.failure = "its step became too small"
        self.deadline = time.monotonic() + problem.time_limit

    def samples(self) -> Iterator[Sample]:
        """The samples one after the other; the last has a status where the run stopped early."""
        now = self._begun(at_start(self.problem, self.switching))
        times = self.problem.times.tolist()
        yield self._sample(now)
        for end in times[1:] if now.status is None else []:
            standing = 0
            while now.time < end and now.status is None:
                begin = now.time
                now = self._decided(self.flow.advance(now, end, self.log))
                standing = standing + 1 if now.time == begin else 0
                if standing > MAX_AT_ONCE:
                    self.failure = "its switches do not end"
                    now = now._replace(status=RunStatus.SOLVER_FAILURE)
            yield self._sample(now)
            if now.status is not None:
                return

    def _sample(self, now: Reached) -> Sample:
        return Sample(now, tuple(self.log.counts), self.discarded)

    @property
    def steps(self) -> int:
        """Accepted steps so far."""
        return self.flow.steps

    @property
    def evaluations(self) -> int:
        """Evaluations of the rates so far."""
        return self.flow.evaluations

    def _begun(self, now: Reached) -> Reached:
        """The start, with the axes that stand on the surface already where they stay on it."""
        if now.status is not None or self.switching.layered:
            return now
        system = self.problem.system
        motion, connector = system.motion(now.state[:12]), connector_of(system)
        s = np.abs(connector.surface(motion.E, motion.F))
        still = np.maximum(s, np.abs(motion.F)) if self.on_position else s
        axes = np.flatnonzero(still <= AT_START).tolist()
        if not axes:
            return now
        if not self.on_position:
            return self._changed(now, modes_on_surface(system, now.state[:12], now.modes, axes))
        modes, state = now.modes, now.state.copy()
        for axis in axes:
            modes = modes.with_axis(axis, 0.0, held=1.0)
            state[[6 + axis, 9 + axis]] = 0.0
        return self._inside_boxes(self._changed(now._replace(state=state), modes))

    def _decided(self, now: Reached) -> Reached:
        if now.status is not None:
            return now
        crossed = [hit for hit in now.hits if not hit.release]
        for hit in now.hits:
            if hit.release:
                now = self._release(now, hit)
        now = self._cross(now, crossed)
        if self.on_position and self._may_look(now):
            now = self._stick(now)
        if self.on_position and now.modes.any_held:
            now = self._inside_boxes(now)
        return now._replace(hits=(), status=self._limit_reached())

    def _may_look(self, now: Reached) -> bool:
        """Whether this is a crossing, and one at which to look whether the chatter is weak.

        Not at a release, whose force is at its bound; not at a sample, which is no event.
        """
        released = any(hit.release for hit in now.hits)
        due = self.switching.sticks and self.log.total >= self.log.look_from
        return due and not released and self.log.total > 0 and now.time == self.log.last_time

    def _limit_reached(self) -> RunStatus | None:
        if self.log.total >= self.switching.switch_limit:
            return RunStatus.SWITCH_LIMIT
        if self.flow.steps >= self.problem.step_limit:
            return RunStatus.STEP_LIMIT
        return RunStatus.TIME_LIMIT if time.monotonic() > self.deadline else None

    def _cross(self, now: Reached, hits: list[Hit]) -> Reached:
        """Axes that arrived at their thresholds, with those that arrive there to round-off."""
        if not hits:
            return now
        hits = hits + self._coinciding(now, hits)
        for hit in hits:
            self.log.switch(now.time, hit.axis)
        modes = now.modes
        if not self.switching.layered and not self.on_position:
            arrived = {hit.axis for hit in hits}
            on_surface = [a for a in range(3) if a in arrived or modes.held[a]]
            chosen = modes_on_surface(self.problem.system, now.state[:12], modes, on_surface)
            return self._changed(now, chosen)
        for hit in hits:
            if self.switching.layered and modes.layer[hit.axis]:
                modes = modes.with_axis(hit.axis, hit.direction)
            elif self.switching.layered:
                modes = modes.with_axis(hit.axis, 0.0, layer=1.0)
            else:
                modes = modes.with_axis(hit.axis, hit.direction)
        return now._replace(modes=modes)

    def _coinciding(self, now: Reached, hits: list[Hit]) -> list[Hit]:
        """The axes that cross their thresholds at this instant too, to round-off.

        A flow stops at the first; the others would stand behind the start of the next.
        """
        system = system_under(self.problem.system, now.modes)
        motion = system.motion(now.state[:12])
        connector = connector_of(system)
        s = connector.surface(motion.E, motion.F)
        near = AT_SURFACE * connector.surface(np.abs(motion.E), np.abs(motion.F))
        if self.on_position:
            near = COINCIDENT * (now.time - self.log.last_time) * np.abs(motion.F)
        up, down = thresholds(system, now.modes, self.switching)
        known = {hit.axis for hit in hits}
        found = []
        rate: Array | None = None
        for axis in range(3):
            at_end = min(abs(s[axis] - up[axis]), abs(s[axis] - down[axis])) <= near[axis]
            if axis in known or not at_end:
                continue
            if rate is None:
                rate = instant(system, now.state[:12]).surface_rate
            direction = 1.0 if abs(s[axis] - up[axis]) <= near[axis] else -1.0
            if direction * rate[axis] > 0:
                found.append(Hit(axis, direction, release=False))
        return found

    def _changed(self, now: Reached, chosen: Modes) -> Reached:
        """Under modes that were chosen, with what sticks and what lets go noted."""
        for axis in range(3):
            if chosen.held[axis] != now.modes.held[axis]:
                what = Transition.STICK if chosen.held[axis] else Transition.RELEASE
                self.log.transition(now.time, axis, what)
        return now._replace(modes=chosen)

    def _release(self, now: Reached, hit: Hit) -> Reached:
        """Lets an axis go whose force is at its bound -K_s σ, where it stays.

        What round-off left of s while it was held could stand on the wrong side: s is put a little
        onto its own.
        """
        self.log.switch(now.time, hit.axis)
        self.log.transition(now.time, hit.axis, Transition.RELEASE)
        side, axis, state = -hit.direction, hit.axis, now.state.copy()
        connector = connector_of(self.problem.system)
        if self.on_position:
            state[6 + axis], state[9 + axis] = side * SET_OFF, 0.0
        else:
            state[9 + axis] = -float(connector.slope) * state[6 + axis] + side * SET_OFF
        return now._replace(state=state, modes=now.modes.with_axis(axis, side))

    def _inside_boxes(self, now: Reached) -> Reached:
        """Releases the held axes whose equivalent force a crossing of another made jump too far."""
        for _ in range(3):
            force = instant(system_under(self.problem.system, now.modes), now.state[:12]).force
            load = np.abs(force) / connector_of(self.problem.system).K_s * now.modes.held
            axis = int(load.argmax())
            if load[axis] <= 1.0 + ROUND_OFF:
                break
            now = self._release(now, Hit(axis, float(np.sign(force[axis])), release=True))
        return now

    def _stick(self, now: Reached) -> Reached:
        system = system_under(self.problem.system, now.modes)
        if chatter_energy(system, now.state) >= self.switching.stick_energy:
            return now
        found = stick(system, now.state, now.modes)
        pause = max(LOOK_AGAIN, self.log.total // LOOK_AGAIN_SHARE)
        self.log.look_from = self.log.total + pause
        if found is None:
            return now
        self.discarded += found.discarded
        for axis in found.axes:
            self.log.switch(now.time, axis)
            self.log.transition(now.time, axis, Transition.STICK)
        return now._replace(state=found.state, modes=found.modes)
