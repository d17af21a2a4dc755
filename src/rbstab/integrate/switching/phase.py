"""The smooth equations of a system in given modes, and the signs of their event functions.

The margin of a mode is its event function if the mode is 1, and minus that if it is 0. It is
positive as long as the mode is the right one; where it falls to zero, the mode switches.
"""

import math
import operator
from functools import cached_property, lru_cache

import numpy as np

from rbstab.integrate.problem import Problem
from rbstab.integrate.straight_line.equations import StraightLine, audited_rates_of
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import alone, at_start, holds_axes, slides
from rbstab.systems.impact import laid_on_stop, stop_of
from rbstab.systems.modes import (
    NO_STATE,
    Modes,
    guards_at,
    mode_owners,
    modes_of,
    rate_places,
    with_modes,
)
from rbstab.systems.system import System

MAX_PHASES = 256
"""The most phases in memory; a run that needs more makes some of them again."""

COINCIDENCE = 16
"""A mode whose margin would be zero within this many units in the last place of the time, or of 1,
switches together with the one that is being switched. It is round-off alone: a margin that is
passed a little later is found by the next step."""

MISSED = 1e-13
"""If a margin is below minus this after a step, the step missed a switch. Margins have several
units, and stay at zero after a switch, up to round-off. Those of exact signs need no such bound
(`Element.exact_guards`)."""

SHORTEST = 1e-18
"""s: no time is resolved further, however close to zero."""

EPSILON = float(np.finfo(float).eps)


class Phase:
    """A system in given modes, between two switches. One without modes has no margins.

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
        rate_places: The states that are the rates of event functions whose signs are exact
            (`systems.modes.rate_places`).
    """

    def __init__(
        self, system: System, guards: StraightLine | None, rates: StraightLine | None = None
    ) -> None:
        self.system = system
        self.audited_rates = (
            audited_rates_of(system) if rates is None else rates.in_modes_of(system)
        )
        self.signs = 2.0 * np.array(modes_of(system)) - 1.0
        self._float_signs = self.signs.tolist()
        places = rate_places(system)
        if holds_axes(system):
            places[:] = NO_STATE
        self.rate_places = places.tolist()
        self._epsilon = np.where(places == NO_STATE, EPSILON, 0.0)
        self._guards = guards or event_functions(system)
        stop = stop_of(system)
        self.rests = stop is not None and bool(stop.mode.any())
        self._on_stop = StraightLine(laid_on_stop, system) if self.rests else None

    @cached_property
    def alone(self) -> frozenset[int]:
        """The modes that switch alone: nothing else follows (`systems.filippov.alone`)."""
        return alone(self.system)

    def on_stop(self, y: Array) -> Array:
        """Return an audited state laid on the stop, if the body `rests`; else the state."""
        return y if self._on_stop is None else self._on_stop(y)

    def margins(self, y: Array, t: float) -> Array:
        """Return the margins at an audited state and a time, s, shape (modes,)."""
        return self.signs * self._guards(y, t)

    def margin_list(self, y: Array, t: float) -> list[float]:
        """Return the margins as Python numbers, inf for those that are NaN; see `margins`."""
        guards = self._guards.finite_entries(y, t)
        if guards is None:
            margins = self.margins(y, t)
            return np.where(np.isnan(margins), math.inf, margins).tolist()
        return list(map(operator.mul, self._float_signs, guards))

    def floors(self, y: Array, t: float) -> list[float]:
        """Return the values below which a margin tells that its switch was missed.

        A margin stays at zero after a switch, up to round-off: `MISSED`. One of an exact sign rises
        at once from what it was at its switch.

        Args:
            y: The audited state after a switch.
            t: The time, s.
        """
        margins = zip(self.margin_list(y, t), self.rate_places, strict=True)
        return [-MISSED if place == NO_STATE else min(margin, 0.0) for margin, place in margins]

    def margin_rates(self, y: Array, t: float, rates: Array | None = None) -> Array:
        """Return the rates of the margins along the motion, shape (modes,).

        Args:
            y: The audited state.
            t: The time, s.
            rates: The audited rates there, if they are known.
        """
        along = self.audited_rates(y, t) if rates is None else rates
        return self.signs * self._guards(y + 1j * STEP * along, t + 1j * STEP).imag / STEP

    def coinciding(self, y: Array, t: float) -> Array:
        """Return the indices of the modes whose margins reach zero at this state, up to round-off.

        Args:
            y: The audited state.
            t: The time, s.
        """
        margins, falling = self.margins(y, t), -self.margin_rates(y, t)
        resolution = max(float(np.spacing(t)), SHORTEST)
        reach = COINCIDENCE * (resolution * falling + self._epsilon)
        return np.flatnonzero((falling > 0) & (margins <= reach))


def depend_on_loads(system: System) -> bool:
    """Return whether event functions depend on the loads: those of a stop and of sliding ties.

    They are then not the same in all modes, and they depend on the time if the loads do.
    """
    return slides(system) or stop_of(system) is not None


def event_functions(system: System) -> StraightLine:
    """Return the event functions of a system, as a function of the audited state and the time."""
    return StraightLine(guards_at, system, timed=system.timed and depend_on_loads(system))


class Phases:
    """The phases of one problem; each is made when its modes first occur.

    Args:
        problem: The problem; elements of its system switch.

    Attributes:
        first: The phase in which the motion begins.
    """

    def __init__(self, problem: Problem) -> None:
        first = float(problem.times[0])
        self._schedule = problem.schedule
        self._system = at_start(problem.system_at_start(), problem.start, first)
        same = not depend_on_loads(problem.system)
        self._guards = event_functions(self._system) if same else None
        self._rates: StraightLine | None = None
        self.of = lru_cache(MAX_PHASES)(self._made)
        self.after_switch_of = lru_cache(MAX_PHASES)(self._after_switch_of)
        self.first = self.of(modes_of(self._system))

    def _made(self, modes: Modes) -> Phase:
        """Return the phase with these modes; `of` keeps it."""
        same = modes == modes_of(self._system)
        system = self._system if same else with_modes(self._system, modes)
        phase = Phase(system, self._guards, self._rates)
        self._rates = phase.audited_rates
        return phase

    def after(self, phase: Phase, switched: list[int]) -> Phase:
        """Return the phase after a switch.

        Args:
            phase: The phase before.
            switched: The indices of the modes that switch.
        """
        signs = phase.signs.copy()
        signs[switched] *= -1.0
        return self.of(tuple((0.5 * (signs + 1.0)).tolist()))

    def _after_switch_of(self, phase: Phase, mode: int) -> Phase:
        """Return the phase after a switch of one mode; `after_switch_of` keeps it."""
        return self.after(phase, [mode])

    def with_leg(self, phase: Phase, t: float) -> Phase:
        """Return a phase with the legs of the inputs that begin at a breakpoint."""
        self._system = self._schedule.system_at(self._system, t)
        self._rates = None
        self.of.cache_clear()
        self.after_switch_of.cache_clear()
        return self.of(modes_of(phase.system))

    def owner(self, mode: int) -> str:
        """Return the name of the element that owns a mode."""
        return mode_owners(self._system)[mode]
