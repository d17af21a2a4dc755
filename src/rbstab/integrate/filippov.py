"""Following a sliding connector through its modes: smooth flow between switches (Filippov).

Between two switches the vector field is smooth and either engine follows it (a `Flow`). What a
switch leads to is decided here, the same for both.
"""

import time
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from rbstab.integrate.chatter import chatter_energy, stick
from rbstab.integrate.following import Hit, Reached, Sample, at_start
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switch_log import SwitchLog, Transition
from rbstab.integrate.switching import (
    ROUND_OFF,
    Modes,
    Switching,
    connector_of,
    instant,
    modes_on_surface,
    system_under,
)

LOOK_AGAIN = 32
"""Switches, at least, between two looks at which axes of a weak chatter may stick: a look costs as
much as many."""

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
    """One run through the modes of its connector, each switch at its time (a `Follower`)."""

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
        now = at_start(self.problem, self.switching)
        times = self.problem.times.tolist()
        yield self._sample(now)
        for end in times[1:] if now.status is None else []:
            while now.time < end and now.status is None:
                now = self._decided(self.flow.advance(now, end, self.log))
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

    def _decided(self, now: Reached) -> Reached:
        if now.status is not None:
            return now
        for hit in now.hits:
            now = self._release(now, hit) if hit.release else self._cross(now, hit)
        if self.on_position and self.switching.sticks and self.log.total >= self.log.look_from:
            now = self._stick(now)
        if self.on_position and now.modes.any_held:
            now = self._inside_boxes(now)
        return now._replace(hits=(), status=self._limit_reached())

    def _limit_reached(self) -> RunStatus | None:
        if self.log.total >= self.switching.switch_limit:
            return RunStatus.SWITCH_LIMIT
        if self.flow.steps >= self.problem.step_limit:
            return RunStatus.STEP_LIMIT
        return RunStatus.TIME_LIMIT if time.monotonic() > self.deadline else None

    def _cross(self, now: Reached, hit: Hit) -> Reached:
        modes, axis = now.modes, hit.axis
        self.log.switch(now.time, axis)
        if self.switching.layered:
            leaves = bool(modes.layer[axis])
            mode = hit.direction if leaves else 0.0
            return now._replace(modes=modes.with_axis(axis, mode, layer=float(not leaves)))
        if self.on_position:
            return now._replace(modes=modes.with_axis(axis, hit.direction))
        chosen = self._chosen(now, axis)
        for changed in range(3):
            if chosen.held[changed] != modes.held[changed]:
                what = Transition.STICK if chosen.held[changed] else Transition.RELEASE
                self.log.transition(now.time, changed, what)
        return now._replace(modes=chosen)

    def _chosen(self, now: Reached, axis: int) -> Modes:
        """Filippov's choice for an axis that arrived on s = F + κE, with those held there."""
        on_surface = [a for a in range(3) if a == axis or now.modes.held[a]]
        return modes_on_surface(self.problem.system, now.state[:12], now.modes, on_surface)

    def _release(self, now: Reached, hit: Hit) -> Reached:
        # The force that held the axis is at its bound -K_s σ and stays there.
        self.log.switch(now.time, hit.axis)
        self.log.transition(now.time, hit.axis, Transition.RELEASE)
        return now._replace(modes=now.modes.with_axis(hit.axis, -hit.direction))

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
