"""The smooth equations of a system in given modes, and the signs of their event functions.

The margin of a mode is its event function if the mode is 1, and minus that if it is 0. It is
positive as long as the mode is the right one; where it falls to zero, the mode switches.
"""

from typing import Any, NamedTuple

import numpy as np

from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.integrate.watched_rates import StopRun, audited_rates_of
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array
from rbstab.systems.modes import (
    Modes,
    guards_at,
    has_modes,
    mode_owners,
    modes_of,
    with_first_modes,
    with_modes,
)
from rbstab.systems.system import AUDIT_SIZE, System

SWITCH_LIMIT = 10_000_000
"""A run stops after this many switches."""

MAX_PHASES = 256
"""The most phases in memory; a run that needs more makes some of them again."""

COINCIDENCE = 16
"""A mode whose margin would be zero within this many units in the last place of the time, or of 1,
switches together with the one that is being switched."""

CLEAR = 1e-6
"""An event function farther from zero than this has the same sign however it is evaluated."""

EPSILON = float(np.finfo(float).eps)


class Phase:
    """A system in given modes, between two switches.

    Args:
        system: The system, in these modes.
        guards: Its event functions, as a function of the audited state.
        rates: The audited rates of the system in other modes, if they are known.

    Attributes:
        system: The system.
        audited_rates: Its audited rates, as a function of the audited state.
        signs: 1 for each mode that is 1, -1 for each that is 0, shape (modes,).
    """

    def __init__(
        self, system: System, guards: StraightLine, rates: StraightLine | None = None
    ) -> None:
        self.system = system
        self.audited_rates = (
            audited_rates_of(system) if rates is None else rates.in_modes_of(system)
        )
        self.signs = 2.0 * np.array(modes_of(system)) - 1.0
        self._guards = guards

    def margins(self, y: Array) -> Array:
        """Return the margins at an audited state, shape (modes,)."""
        return self.signs * self._guards(y)

    def margin_rates(self, y: Array, rates: Array | None = None) -> Array:
        """Return the rates of the margins along the motion, shape (modes,).

        Args:
            y: The audited state.
            rates: The audited rates there, if they are known.
        """
        along = self.audited_rates(y) if rates is None else rates
        return self.signs * self._guards(y + 1j * STEP * along).imag / STEP

    def coinciding(self, y: Array, t: float, rates: Array | None = None) -> Array:
        """Return the indices of the modes whose margins reach zero at this state, up to round-off.

        Args:
            y: The audited state.
            t: The time, s.
            rates: The audited rates there, if they are known.
        """
        margins, falling = self.margins(y), -self.margin_rates(y, rates)
        reach = COINCIDENCE * (float(np.spacing(t)) * falling + EPSILON)
        return np.flatnonzero((falling > 0) & (margins <= reach))


class Phases:
    """The phases of one problem; each is made when its modes first occur.

    Args:
        problem: The problem; elements of its system switch.

    Attributes:
        first: The phase in which the motion begins.
    """

    def __init__(self, problem: Problem) -> None:
        # They are the same in all modes.
        size = problem.system.size + AUDIT_SIZE
        self._guards = StraightLine(guards_at, problem.system, size)
        self._system = _in_first_modes(problem, self._guards(problem.audited_start()))
        self.first = Phase(self._system, self._guards)
        self._known: dict[Modes, Phase] = {modes_of(self._system): self.first}

    def of(self, modes: Modes) -> Phase:
        """Return the phase with these modes."""
        if modes not in self._known:
            if len(self._known) == MAX_PHASES:
                self._known.clear()
            system, rates = with_modes(self._system, modes), self.first.audited_rates
            self._known[modes] = Phase(system, self._guards, rates)
        return self._known[modes]

    def after(self, phase: Phase, switched: Any) -> Phase:
        """Return the phase after a switch.

        Args:
            phase: The phase before.
            switched: The indices of the modes that switch.
        """
        signs = phase.signs.copy()
        signs[switched] *= -1.0
        return self.of(tuple((0.5 * (signs + 1.0)).tolist()))

    def owner(self, mode: int) -> str:
        """Return the name of the element that owns a mode."""
        return mode_owners(self._system)[mode]


def _in_first_modes(problem: Problem, guards: Array) -> System:
    """Return the system of a problem in its first modes, by its event functions at the start."""
    if (np.abs(guards) > CLEAR).all():
        return with_modes(problem.system, tuple((guards > 0).astype(float).tolist()))
    return with_first_modes(problem.system, problem.start)


class CurrentPhase:
    """The phase of a run, and its switches so far.

    Args:
        problem: The problem.
        switch_limit: The run stops after this many switches.

    Attributes:
        phase: The current phase.
        count: The number of switches.
    """

    def __init__(self, problem: Problem, switch_limit: int) -> None:
        self._phases = Phases(problem)
        self.phase = self._phases.first
        self.count = 0
        self._limit = switch_limit
        self._last: dict[int, float] = {}

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
        self.count += len(modes)
        if self.count >= self._limit:
            raise StopRun(RunStatus.SWITCH_LIMIT, f"stopped after {self.count} switches")


class Switch(NamedTuple):
    """A mode that switches within a step: its index, the time, s, and the end of its bracket, s."""

    mode: int
    time: float
    latest: float


def switches(problem: Problem) -> bool:
    """Return whether elements of a problem switch."""
    return has_modes(problem.system)
