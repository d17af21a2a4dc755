"""The smooth equations of a system in given modes, and the signs of their event functions.

The margin of a mode is its event function if the mode is 1, and minus that if it is 0. It is
positive as long as the mode is the right one; where it falls to zero, the mode switches.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbstab.integrate.modes.connector_switches import ConnectorSwitches
from rbstab.integrate.modes.impacts import Impacts
from rbstab.integrate.problem import Problem, Trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.integrate.watched_rates import EquationsInTime, StopRun, audited_rates_of
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import RedundantTiesError, after_events, at_start, slides
from rbstab.systems.impact import laid_on_stop, stop_of
from rbstab.systems.modes import (
    Modes,
    guards_at,
    has_modes,
    mode_owners,
    modes_of,
    with_modes,
)
from rbstab.systems.system import System

SWITCH_LIMIT = 10_000_000
"""A run stops after this many switches."""

IMPACT_LIMIT = 100_000
"""A run stops after this many impacts. A nearly elastic body that is damped, and pressed against
its stop, hops faster and faster for a long time."""

MAX_PHASES = 256
"""The most phases in memory; a run that needs more makes some of them again."""

COINCIDENCE = 16
"""A mode whose margin would be zero within this many units in the last place of the time, or of 1,
switches together with the one that is being switched."""

EPSILON = float(np.finfo(float).eps)


class Phase:
    """A system in given modes, between two switches.

    Args:
        system: The system, in these modes.
        guards: Its event functions, as a function of the audited state and the time; None if they
            are not those of other modes.
        rates: The audited rates of the system in other modes, if they are known.

    Attributes:
        system: The system.
        audited_rates: Its audited rates, as a function of the audited state.
        signs: 1 for each mode that is 1, -1 for each that is 0, shape (modes,).
        rests: Whether the body rests against its stop.
    """

    def __init__(
        self, system: System, guards: EquationsInTime | None, rates: EquationsInTime | None = None
    ) -> None:
        size = system.audited_size
        self.system = system
        self.audited_rates = (
            audited_rates_of(system) if rates is None else rates.in_modes_of(system)
        )
        self.signs = 2.0 * np.array(modes_of(system)) - 1.0
        self._guards = guards or event_functions(system)
        self._guards_of_state = self._guards.of_state
        stop = stop_of(system)
        self.rests = stop is not None and bool(stop.mode.any())
        self._on_stop = StraightLine(laid_on_stop, system, size) if self.rests else None

    def on_stop(self, y: Array) -> Array:
        """Return an audited state laid on the stop, if the body `rests`; else the state."""
        return y if self._on_stop is None else self._on_stop(y)

    def margins(self, y: Array, t: float) -> Array:
        """Return the margins at an audited state and a time, s, shape (modes,)."""
        # This is called ten times a step, so it leaves out what only a time needs.
        of_state = self._guards_of_state
        return self.signs * (self._guards(y, t) if of_state is None else of_state(y))

    def margin_rates(self, y: Array, t: float, rates: Array | None = None) -> Array:
        """Return the rates of the margins along the motion, shape (modes,).

        Args:
            y: The audited state.
            t: The time, s.
            rates: The audited rates there, if they are known.
        """
        along = self.audited_rates(y, t) if rates is None else rates
        return self.signs * self._guards(y + 1j * STEP * along, t + 1j * STEP).imag / STEP

    def coinciding(self, y: Array, t: float, rates: Array | None = None) -> Array:
        """Return the indices of the modes whose margins reach zero at this state, up to round-off.

        Args:
            y: The audited state.
            t: The time, s.
            rates: The audited rates there, if they are known.
        """
        margins, falling = self.margins(y, t), -self.margin_rates(y, t, rates)
        reach = COINCIDENCE * (float(np.spacing(t)) * falling + EPSILON)
        return np.flatnonzero((falling > 0) & (margins <= reach))


def depend_on_loads(system: System) -> bool:
    """Return whether event functions depend on the loads: those of a stop and of sliding ties.

    They are then not the same in all modes, and they depend on the time if the loads do.
    """
    return slides(system) or stop_of(system) is not None


def event_functions(system: System) -> EquationsInTime:
    """Return the event functions of a system, as a function of the audited state and the time."""
    return EquationsInTime(guards_at, system, system.timed and depend_on_loads(system))


class Phases:
    """The phases of one problem; each is made when its modes first occur.

    Args:
        problem: The problem; elements of its system switch.

    Attributes:
        first: The phase in which the motion begins.
        slides: Whether axes of ties slide on surfaces.
    """

    def __init__(self, problem: Problem) -> None:
        first = float(problem.times[0])
        self._schedule = problem.schedule
        self._system = at_start(problem.system_at_start(), problem.start, first)
        self.slides = slides(problem.system)
        same = not depend_on_loads(problem.system)
        self._guards = event_functions(self._system) if same else None
        self._rates: EquationsInTime | None = None
        self._known: dict[Modes, Phase] = {}
        self.first = self.of(modes_of(self._system))

    def of(self, modes: Modes) -> Phase:
        """Return the phase with these modes."""
        if modes not in self._known:
            if len(self._known) == MAX_PHASES:
                self._known.clear()
            same = modes == modes_of(self._system)
            system = self._system if same else with_modes(self._system, modes)
            phase = Phase(system, self._guards, self._rates)
            self._rates = phase.audited_rates
            self._known[modes] = phase
        return self._known[modes]

    def after(self, phase: Phase, switched: list[int]) -> Phase:
        """Return the phase after a switch.

        Args:
            phase: The phase before.
            switched: The indices of the modes that switch.
        """
        signs = phase.signs.copy()
        signs[switched] *= -1.0
        return self.of(tuple((0.5 * (signs + 1.0)).tolist()))

    def with_leg(self, phase: Phase, t: float) -> Phase:
        """Return a phase with the legs of the inputs that begin at a breakpoint."""
        assert self._schedule is not None
        self._system = self._schedule.system_at(self._system, t)
        self._rates = None
        self._known.clear()
        return self.of(modes_of(phase.system))

    def slid(self, phase: Phase, switched: list[int], t: float, y: Array) -> tuple[Phase, Array]:
        """Return the phase and the state after Filippov's choice for the axes of sliding ties.

        Args:
            phase: The phase in which all other modes have switched already.
            switched: The indices of the modes whose event functions have reached zero.
            t: The time, s.
            y: The audited state. Axes are put on their surfaces.

        Raises:
            StopRun: The forces of the ties are not determined.
        """
        try:
            system, y = after_events(phase.system, y, switched, t)
        except RedundantTiesError as error:
            raise StopRun(RunStatus.SOLVER_FAILURE, str(error)) from error
        return self.of(modes_of(system)), y

    def owner(self, mode: int) -> str:
        """Return the name of the element that owns a mode."""
        return mode_owners(self._system)[mode]


class CurrentPhase:
    """The phase of a run, and its switches so far.

    Args:
        problem: The problem.
        switch_limit: The run stops after this many switches. Default that of the sliding
            controller; without one `SWITCH_LIMIT`.

    Attributes:
        phase: The current phase.
        count: The number of switches.
        impact_count: The number of impacts.
        impacts: The impacts; None if the system has no stop.
        connector: The switches of the connector of a sliding controller; None without one.
    """

    def __init__(self, problem: Problem, switch_limit: int | None = None) -> None:
        self._phases = Phases(problem)
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
        if self.impacts is not None:
            return self.impacts.after(modes, t, y)
        before = self.phase.system
        self.switch(modes, t)
        if self._phases.slides:
            self.phase, y = self._phases.slid(self.phase, modes, t, y)
        if self.connector is not None:
            now = self.phase.system
            self.connector.add_transitions(before, now, t)
            system, y = self.connector.stuck(modes, before, now, t, y)
            if system is not now:
                self.phase = self._phases.of(modes_of(system))
        return y

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
        self.phase = self._phases.with_leg(self.phase, t)
        # What has switched at this time already may switch again, under another load.
        self._last.clear()
        if self.impacts is not None:
            return self.impacts.released(t, y)
        before = self.phase.system
        if self._phases.slides:
            self.phase, y = self._phases.slid(self.phase, [], t, y)
        if self.connector is not None:
            self.connector.add_transitions(before, self.phase.system, t)
        return y

    def add_sample(self, y: Array) -> None:
        """Store what has happened so far as that of a sample, at a state."""
        self.add_samples([y])

    def add_samples(self, states: list[Array]) -> None:
        """Store what has happened so far as that of some samples, at their states."""
        if self.impacts is None and self.connector is None:
            return
        for y in states:
            if self.impacts is not None:
                self.impacts.add_sample()
            if self.connector is not None:
                self.connector.add_sample(self.phase.system, y)

    def repeat_sample(self, y: Array) -> None:
        """Store the last sample again, after a breakpoint at its time."""
        if self.impacts is not None:
            self.impacts.repeat_sample()
        if self.connector is not None:
            self.connector.repeat_sample(self.phase.system, y)

    def recorded(self, run: Trajectory) -> Trajectory:
        """Return a run with its impacts, and with the switches of a sliding connector."""
        if self.impacts is not None:
            run = replace(run, impacts=self.impacts.trace())
        if self.connector is not None:
            run = replace(run, switches=self.connector.trace())
        return run

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


class Switch(NamedTuple):
    """A mode that switches within a step: its index, the time, s, and the end of its bracket, s."""

    mode: int
    time: float
    latest: float


def switches(problem: Problem) -> bool:
    """Return whether elements of a problem switch."""
    return has_modes(problem.system)
