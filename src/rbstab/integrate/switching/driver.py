"""What follows each event of a run: switches, sticking, impacts, rests. It is one for all engines.

The event function of a stop is the distance from it, as long as the body does not rest there. Where
it reaches zero, the state jumps (`systems.impact`), and the mode stays: the body bounces. If it
comes to rest, the mode becomes 1. The event function is then the acceleration towards the stop that
the couple of the stop prevents; where it falls to zero, the body is released.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rbstab.integrate.problem import Problem, Trajectory
from rbstab.integrate.status import RunStatus, StopRun
from rbstab.integrate.switching.connector_switches import ConnectorSwitches, SoFar, side_of_axes
from rbstab.integrate.switching.course import Transition
from rbstab.integrate.switching.phase import Phases, depend_on_loads
from rbstab.integrate.switching.records import ImpactRecord
from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import RedundantTiesError, after_events, held_axes, slide_modes
from rbstab.systems.impact import (
    HOP_HEIGHT,
    impact,
    laid_on_stop,
    side_of,
    stop_of,
)
from rbstab.systems.landing import after_impact, landed
from rbstab.systems.modes import first_mode, modes_of
from rbstab.systems.system import System

SWITCH_LIMIT = 10_000_000
"""A run stops after this many switches."""

IMPACT_LIMIT = 100_000
"""A run stops after this many impacts. A nearly elastic body that is damped, and pressed against
its stop, hops faster and faster for a long time."""

PASSED = 1e-13
"""An impact has moved a margin past zero if it is below minus this. Smaller margins are round-off:
those of displacements do not jump."""


class Driver:
    """The phase of a run, and its switches so far.

    Args:
        problem: The problem.

    Attributes:
        phase: The current phase.
        count: The number of switches.
        impacts: The impacts; None if the system has no stop.
        connector: The switches of the connector of a sliding controller; None without one.
        transitions: All changes of the equations so far; None if they are not wanted.
    """

    transitions: list[Transition] | None = None

    def __init__(self, problem: Problem) -> None:
        self._phases = Phases(problem)
        self.phase = self._phases.first
        self._chooses = depend_on_loads(problem.system)
        self._of_axes = frozenset(slide_modes(problem.system).ravel().tolist())
        self.count, self.impacts, self.connector = 0, None, None
        self._last: dict[int, float] = {}
        self._limit = SWITCH_LIMIT
        if problem.switching is not None:
            self._limit = problem.switching.switch_limit
            self.connector = ConnectorSwitches(problem)
            start = float(problem.times[0])
            self.connector.add_transitions(None, None, self.phase.system, start)
        self._sides: dict[int, int] = {}
        if stop_of(problem.system) is not None:
            self.impacts, first = (
                ImpactRecord(),
                first_mode(problem.system, stop_of(problem.system)),
            )
            self._sides = {first: 1, first + 1: -1}

    @property
    def resting(self) -> int:
        """The side of its stop on which the body rests: 1 or -1; 0 if it does not."""
        return sum(side for mode, side in self._sides.items() if self.phase.signs[mode] > 0)

    def begin(self, t: float, y: Array) -> Array:
        """Return the state after the start of the run, at which the body may touch its stop.

        Args:
            t: The time, s.
            y: The audited state at the start.

        Raises:
            StopRun: The start is beyond the stop.
        """
        if self.impacts is None:
            return y
        system = self.phase.system
        side, stop = side_of(system, y), stop_of(system)
        assert stop is not None
        self.impacts.follow(t, 0, self.resting)
        if self.resting:
            return laid_on_stop(system, y)
        if side and abs(y[1]) > stop.angle + HOP_HEIGHT:
            raise StopRun(RunStatus.SOLVER_FAILURE, f"θ2 starts beyond the stop {stop.name}")
        meets = [mode for mode, of in self._sides.items() if of == side]
        if meets and self.phase.margin_rates(y, t)[meets[0]] < 0:
            return self._impact(side, t, y)
        return y

    def cross(self, modes: list[int], t: float, y: Array) -> Array:
        """Switch some modes whose margins have reached zero, and return the state after it.

        It is `y` itself, unless there is an impact, or axes of sliding ties are put on surfaces.

        Args:
            modes: The modes.
            t: The time, s.
            y: The audited state.

        Raises:
            StopRun: A mode has switched at this time already, the run has reached a limit, or the
                forces of sliding ties are not determined.
        """
        before = began = self.phase.system
        meets = [mode for mode in modes if mode in self._sides and self.phase.signs[mode] < 0]
        if meets:
            y = self._impact(self._sides[meets[0]], t, y)
        else:
            rested = self.resting
            self._switch(modes, t)
            if self.connector is not None and self.impacts is None:
                now = self.phase.system
                system, y = self.connector.stuck(modes, before, now, t, y)
                if system is not now:
                    # Axes that stick together may hold what one of them could not hold alone.
                    before = system
                    self.phase = self._phases.of(modes_of(system))
            y = self._choose(modes, rested, t, y)
        if self.connector is not None:
            self.connector.add_transitions(modes, before, self.phase.system, t)
        self._keep(modes, began, t, impact=bool(meets))
        return y

    def crosses(self, mode: int, t: float, y: Array) -> bool:
        """Return whether a mode can be switched by `cross_alone`.

        Else `cross` has more to do, or the run ends here.

        Args:
            mode: The index of the mode.
            t: The time, s.
            y: The audited state.
        """
        if (
            mode not in self.phase.alone
            or self._last.get(mode) == t
            or self.count + 1 >= self._limit
        ):
            return False
        if self.connector is None or not self.connector.may_stick(y, ahead=1):
            return True
        # A test that finds no axis to stick must not change the motion, not even its last digits.
        after = self._phases.after_switch_of(self.phase, mode).system
        return self.connector.test_sticking(after, t, y) is None

    def cross_alone(self, mode: int, t: float) -> None:
        """Switch a mode at a time, s; nothing else follows (`crosses`)."""
        self._last[mode], before = t, self.phase
        self.phase = self._phases.after_switch_of(before, mode)
        if self.connector is not None:
            self.connector.add_switches([mode], t)
        self.count += 1
        self._keep([mode], before.system, t)

    def begin_leg(self, t: float, y: Array) -> Array:
        """Begin the legs of the inputs at a breakpoint, and return the state after it.

        Loads may jump there. So axes of sliding ties may be released, or a body that rests against
        its stop. The state is `y` itself, unless axes are put beside their surfaces.

        Args:
            t: The breakpoint, s.
            y: The audited state.

        Raises:
            StopRun: The forces of sliding ties are not determined.
        """
        began, rested = self.phase.system, self.resting
        self.phase = self._phases.with_leg(self.phase, t)
        # What has switched at this time already may switch again, under another load.
        self._last.clear()
        before = self.phase.system
        y = self._choose([], rested, t, y)
        if self.connector is not None:
            self.connector.add_transitions(None, before, self.phase.system, t)
        self._keep([], began, t)
        return y

    def _keep(self, modes: list[int], before: System, t: float, *, impact: bool = False) -> None:
        """Keep a change of the equations, if such changes are wanted."""
        if self.transitions is not None:
            after = self.phase.system
            self.transitions.append(Transition(t, tuple(modes), before, after, impact))

    def _switch(self, modes: list[int], t: float) -> None:
        """Switch some modes at a time, s."""
        for mode in modes:
            if self._last.get(mode) == t:
                name = self._phases.owner(mode)
                raise StopRun(RunStatus.SOLVER_FAILURE, f"the motion stays where {name} switches")
            self._last[mode] = t
        self.phase = self._phases.after(self.phase, modes)
        if self.connector is not None:
            self.connector.add_switches(modes, t)
        self.count += len(modes)
        if self.count >= self._limit:
            raise StopRun(RunStatus.SWITCH_LIMIT, f"stopped after {self.count} switches")

    def _choose(self, modes: list[int], rested: int, t: float, y: Array) -> Array:
        """Choose what holds after a jump of loads: axes that slide, and the rest at a stop."""
        # The margins of the modes have reached zero, and they have switched.
        if self._chooses:
            y = self._chosen(after_events, y, modes, t)
        if self.impacts is not None:
            # `rested` is the side of the stop on which the body rested before, or 0.
            self.impacts.follow(t, rested, self.resting)
        return y

    def _chosen(self, choice: Callable[..., tuple[System, Array]], *given: Any) -> Array:
        """Go on in the system that a choice finds, and return the state."""
        try:
            system, y = choice(self.phase.system, *given)
        except RedundantTiesError as error:
            raise StopRun(RunStatus.SOLVER_FAILURE, str(error)) from error
        self.phase = self._phases.of(modes_of(system))
        return y

    def _impact(self, side: int, t: float, y: Array) -> Array:
        """Return the state after an impact on a side, and the rest if the body comes to rest."""
        record = self.impacts
        assert record is not None
        if t == record.last_time:
            raise StopRun(RunStatus.SOLVER_FAILURE, "the hops at the stop became too short")
        collision = impact(self.phase.system, y)
        if record.count >= IMPACT_LIMIT:
            raise StopRun(RunStatus.SWITCH_LIMIT, f"stopped after {IMPACT_LIMIT} impacts")
        # After it, modes may switch again at the same time.
        self._last.clear()
        y = collision.state
        # An impact can turn back what the motion was about to switch at the same time. So the other
        # modes are those that switch after it.
        others = self._others(t, y)
        if others:
            self._switch(others, t)
        energy = self._energy(t, y)
        before, sides = self.phase, slide_modes(self.phase.system)[0]
        y = self._chosen(after_impact, y, t)
        phase = self.phase
        held = held_axes(before.system) | held_axes(phase.system)
        crossed = ~held & (before.signs[sides] != phase.signs[sides])
        self._switch(sides[crossed].tolist(), t)
        self.phase = phase
        rest = landed(phase.system, y, side, t)
        if rest is not None:
            self.phase, y = self._phases.of(modes_of(rest[0])), rest[1]
        # Nothing is recorded if the run ends here, before the impact.
        record.add(t, float(collision.rate), float(collision.lost) + energy - self._energy(t, y))
        record.follow(t, 0, self.resting)
        return y

    def _energy(self, t: float, y: Array) -> float:
        return float(self.phase.system.observe(y, t).energy.sum())

    def _others(self, t: float, y: Array) -> list[int]:
        """Return the modes an impact switches, except those of the stop and of sliding axes."""
        # They reach their switch at the same time, or the impact moves them past it: the velocities
        # jump, and so does s = F + κE of a tie with a boundary layer.
        passed = np.flatnonzero(self.phase.margins(y, t) < -PASSED)
        modes = {*self.phase.coinciding(y, t).tolist(), *passed.tolist()}
        return sorted(modes - self._sides.keys() - self._of_axes)

    def so_far(self) -> SoFar:
        """Return what samples store of the switches so far."""
        counts = () if self.connector is None else tuple(self.connector.record.counts)
        return SoFar(self.phase.system, counts)

    @property
    def records(self) -> bool:
        """Whether it stores something of samples."""
        return self.impacts is not None or self.connector is not None

    def add_sample(self, y: Array, so_far: SoFar | None = None) -> None:
        """Store what has happened so far as that of a sample.

        Args:
            y: Its audited state.
            so_far: The switches before it; default all so far.
        """
        if self.impacts is not None:
            self.impacts.add_sample(self.resting)
        if self.connector is not None:
            system, counts = so_far or self.so_far()
            self.connector.record.add_sample(side_of_axes(system), y, counts)

    def recorded(self, run: Trajectory) -> Trajectory:
        """Return a run with its impacts, and with the switches of a sliding connector."""
        if self.impacts is not None:
            run = replace(run, impacts=self.impacts.trace())
        if self.connector is not None:
            run = replace(run, switches=self.connector.record.trace())
        return run
