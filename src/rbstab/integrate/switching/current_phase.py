"""The phase of a run and what follows each event: switches, impacts, and axes that slide."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbstab.integrate.problem import Problem, Trajectory, trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.connector_switches import ConnectorSwitches
from rbstab.integrate.switching.course import Transition
from rbstab.integrate.switching.impacts import Impacts
from rbstab.integrate.switching.phases import Phases
from rbstab.integrate.watched_rates import StopRun
from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import slide_modes
from rbstab.systems.impact import stop_of
from rbstab.systems.modes import modes_of
from rbstab.systems.sliding_impact import landed
from rbstab.systems.system import System

SWITCH_LIMIT = 10_000_000
"""A run stops after this many switches."""

IMPACT_LIMIT = 100_000
"""A run stops after this many impacts. A nearly elastic body that is damped, and pressed against
its stop, hops faster and faster for a long time."""


class SoFar(NamedTuple):
    """The system in its current modes, and the switches of each axis of a connector so far."""

    system: System
    counts: tuple[int, ...]


class CurrentPhase:
    """The phase of a run, and its switches so far.

    Args:
        problem: The problem.
        switch_limit: The run stops after this many switches. Default that of the sliding
            controller; without one `SWITCH_LIMIT`.

    Attributes:
        phase: The current phase.
        slides: Whether axes of ties slide on surfaces.
        count: The number of switches.
        impact_count: The number of impacts.
        impacts: The impacts; None if the system has no stop.
        connector: The switches of the connector of a sliding controller; None without one.
        transitions: All changes of the equations so far; None if they are not wanted.
    """

    transitions: list[Transition] | None = None

    def __init__(self, problem: Problem, switch_limit: int | None = None) -> None:
        self._problem, self._phases = problem, Phases(problem)
        self.slides = self._phases.slides
        self.phase = self._phases.first
        self.count = self.impact_count = 0
        self._last: dict[int, float] = {}
        switching = problem.switching
        self.connector = ConnectorSwitches(problem, switching) if switching is not None else None
        if self.connector is not None:
            self.connector.begin(self.phase.system, float(problem.times[0]))
        most = SWITCH_LIMIT if switching is None else switching.switch_limit
        self._limit = most if switch_limit is None else switch_limit
        has_stop = stop_of(problem.system) is not None
        self.impacts = Impacts(self, self.phase.system) if has_stop else None

    def cross(self, modes: list[int], t: float, y: Array) -> Array:
        """Switch some modes whose margins have reached zero, and return the state after it.

        It is `y` itself, unless there is an impact, or axes of sliding ties are put on surfaces.

        Args:
            modes: The modes.
            t: The time, s.
            y: The audited state.

        Raises:
            StopRun: As `switch`, or the forces of sliding ties are not determined.
        """
        before = began = self.phase.system
        impacts = self.impact_count
        if self.impacts is not None:
            y = self.impacts.after(modes, t, y)
        else:
            self.switch(modes, t)
            if self.connector is not None:
                now = self.phase.system
                system, y = self.connector.stuck(modes, before, now, t, y)
                if system is not now:
                    # Axes that stick together may hold what one of them could not hold alone.
                    before = system
                    self.phase = self._phases.of(modes_of(system))
            y = self.slide(modes, t, y)
        if self.connector is not None:
            self.connector.add_transitions(modes, before, self.phase.system, t)
        self._keep(modes, began, t, impact=self.impact_count > impacts)
        return y

    def crosses(self, mode: int, t: float, y: Array) -> bool:
        """Return whether a mode can be switched by `cross_alone`, at a state and a time, s.

        Else `cross` has more to do, or the run ends here.
        """
        if (
            mode not in self.phase.alone
            or self._last.get(mode) == t
            or self.count + 1 >= self._limit
        ):
            return False
        if self.connector is None or not self.connector.may_stick(y):
            return True
        # A test that finds no axis to stick must not change the motion, not even its last digits.
        after = self._phases.after_one(self.phase, mode).system
        return not self.connector.would_stick(after, t, y)

    def cross_alone(self, mode: int, t: float) -> None:
        """Switch a mode at a time, s; nothing else follows (`crosses`)."""
        self._last[mode], before = t, self.phase
        self.phase = self._phases.after_one(before, mode)
        if self.connector is not None:
            self.connector.add_event(mode, t)
        self.count += 1
        if self.transitions is not None:
            self._keep([mode], before.system, t)

    def _keep(self, modes: list[int], before: System, t: float, *, impact: bool = False) -> None:
        """Keep a change of the equations, if such changes are wanted.

        Args:
            modes: The modes whose margins have reached zero.
            before: The system before it.
            t: The time, s.
            impact: Whether it is an impact.
        """
        if self.transitions is not None:
            after = self.phase.system
            self.transitions.append(Transition(t, tuple(modes), before, after, impact))

    def begin_leg(self, t: float, y: Array) -> Array:
        """Begin the legs of the inputs at a breakpoint, and return the state after it.

        Loads may jump there. So axes of sliding ties may be released, or a body that rests against
        its stop. The state is `y` itself, unless axes are put beside their surfaces.

        Args:
            t: The breakpoint, s.
            y: The audited state.

        Raises:
            StopRun: The forces of sliding ties are not determined, or the limit is reached.
        """
        began = self.phase.system
        self.phase = self._phases.with_leg(self.phase, t)
        # What has switched at this time already may switch again, under another load.
        self._last.clear()
        before = self.phase.system
        if self.impacts is not None:
            y = self.impacts.after_breakpoint(t, y)
        else:
            y = self.slide([], t, y)
        if self.connector is not None:
            self.connector.add_transitions(None, before, self.phase.system, t)
        self._keep([], began, t)
        return y

    def slide(self, modes: list[int], t: float, y: Array) -> Array:
        """Choose the modes of axes that slide, after other modes; return the state after it.

        Args:
            modes: The modes whose margins have reached zero.
            t: The time, s.
            y: The audited state.

        Raises:
            StopRun: The forces of sliding ties are not determined.
        """
        if self._phases.slides:
            self.phase, y = self._phases.slid(self.phase, modes, t, y)
        return y

    def slide_after_impact(self, side: int, t: float, y: Array) -> Array:
        """Choose the modes of axes that slide, and whether the body rests; return the state.

        Args:
            side: The side of the impact, 1 or -1.
            t: The time, s.
            y: The audited state after the impact.

        Raises:
            StopRun: The forces of sliding ties are not determined, or the limit is reached.
        """
        before = np.array(modes_of(self.phase.system))
        phase, y = self._phases.after_impact(self.phase, t, y)
        sides, holds = slide_modes(phase.system)
        now = np.array(modes_of(phase.system))
        crossed = (before[holds] == 0) & (now[holds] == 0) & (before[sides] != now[sides])
        if crossed.any():
            self.switch(sides[crossed].tolist(), t)
        self.phase = phase
        found = landed(phase.system, y, side, t)
        if found is None:
            return y
        self.phase = self._phases.of(modes_of(found.system))
        return found.state

    def add_sample(self, y: Array) -> None:
        """Store what has happened so far as that of a sample, at a state."""
        self.add_samples([y])

    def so_far(self) -> "SoFar":
        """Return what samples store of the switches so far."""
        counts = () if self.connector is None else self.connector.counts
        return SoFar(self.phase.system, counts)

    def add_samples(self, states: list[Array], so_far: "SoFar | None" = None) -> None:
        """Store what has happened so far as that of some samples.

        Args:
            states: Their states.
            so_far: The switches before them; default all so far.
        """
        if self.impacts is None and self.connector is None:
            return
        system, counts = so_far or self.so_far()
        for y in states:
            if self.impacts is not None:
                self.impacts.add_sample()
            if self.connector is not None:
                self.connector.add_sample(system, y, counts)

    def repeat_sample(self, y: Array) -> None:
        """Store the last sample again, after a breakpoint at its time."""
        if self.impacts is not None:
            self.impacts.repeat_sample()
        if self.connector is not None:
            self.connector.repeat_sample(*self.so_far(), y)

    def recorded(self, run: Trajectory) -> Trajectory:
        """Return a run with its impacts, and with the switches of a sliding connector."""
        if self.impacts is not None:
            run = replace(run, impacts=self.impacts.trace())
        if self.connector is not None:
            run = replace(run, switches=self.connector.trace())
        return run

    def ended_at_start(self, status: RunStatus, detail: str) -> Trajectory:
        """Return the trajectory of a run that cannot begin.

        Args:
            status: Its status.
            detail: Why, as text.
        """
        problem, start = self._problem, self._problem.audited_start()
        self.add_sample(start)
        samples = [(float(problem.times[0]), start)]
        run = trajectory(problem, samples, status, detail, 0, 0, (self.phase.system,))
        return self.recorded(run)

    def switch(self, modes: list[int], t: float) -> None:
        """Switch some modes at a time.

        Raises:
            StopRun: A mode has switched at this time already, or the run has reached its limit.
        """
        for mode in modes:
            if self._last.get(mode) == t:
                name = self._phases.owner(mode)
                raise StopRun(RunStatus.SOLVER_FAILURE, f"the motion stays where {name} switches")
            self._last[mode] = t
        self.phase = self._phases.after(self.phase, modes)
        if self.connector is not None:
            self.connector.add_events(modes, t)
        self.count += len(modes)
        if self.count >= self._limit:
            raise StopRun(RunStatus.SWITCH_LIMIT, f"stopped after {self.count} switches")

    def count_impact(self) -> None:
        """Count an impact. After it, modes may switch again at the same time.

        Raises:
            StopRun: The run has reached its limit.
        """
        self.impact_count += 1
        if self.impact_count > IMPACT_LIMIT:
            raise StopRun(RunStatus.SWITCH_LIMIT, f"stopped after {IMPACT_LIMIT} impacts")
        self._last.clear()
