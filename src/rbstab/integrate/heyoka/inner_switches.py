"""Switches that heyoka's loop goes through, without a return to the driver.

A mode that switches alone (`systems.filippov.alone`) changes one `par[]`, and the compiled
integration continues. So a chatter of a million switches costs no more than a step and this code
for each. All other switches end the loop.
"""

import operator
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rbstab.integrate.heyoka.equations import CompiledEquations
from rbstab.integrate.switching.connector_switches import SoFar
from rbstab.integrate.switching.driver import Driver
from rbstab.systems.modes import NO_STATE

EVENT_OFFSET = 1e-12
"""After a switch, the zero of an event function whose rate is known is moved by this part of the
last flight: heyoka's root isolation fails if a step begins on a zero."""

NEAR = 1e-11
"""A margin below this may reach zero at the same time as another one, up to round-off."""

NEAR_TIME = 1e-14
"""Relative to the time: a margin of exact sign that is closer to zero may reach it now."""


class InnerSwitches:
    """The switches inside heyoka's loop, of one run.

    Args:
        driver: What follows each event of the run.

    Attributes:
        floors: The values below which a margin tells that its switch was missed (`Phase.floors`).
        missed: Whether the last step in the loop has missed a switch.
        least_margin: The least margin after the last step in the loop; inf where a mode has
            switched.
        before: What samples within the last step store, if a mode has switched at its end.
    """

    def __init__(self, driver: Driver) -> None:
        self.driver = driver
        self.floors: list[float] = []
        self.missed, self.least_margin = False, np.inf
        self.before: SoFar | None = None
        self._handlers: list[Any] = []
        self._loops = False
        self._begin = self._crossed_at = -np.inf

    def use(self, compiled: CompiledEquations) -> None:
        """Handle the events of an integrator from now on."""
        self._compiled, self._state = compiled, compiled.integrator.state
        self._handlers = compiled.handlers
        self._handlers.append(self.at_switch)

    def release(self) -> None:
        """Handle no more events of the integrator."""
        self._handlers.clear()

    @contextmanager
    def loop(self, t: float) -> Iterator[None]:
        """Switch modes while heyoka's loop runs, from a time, s."""
        self._loops, self._begin = True, t
        self.missed, self.least_margin, self.before = False, np.inf, None
        try:
            yield
        finally:
            self._loops = False

    def at_switch(self, integrator: Any, mode: int, direction: int) -> bool:
        """Switch a mode if it switches alone; return whether heyoka's loop goes on.

        Args:
            integrator: heyoka's integrator, at a zero of an event function.
            mode: The index of the mode.
            direction: 1 if the function rises there, else -1.
        """
        phase, t = self.driver.phase, integrator.time
        if not self._loops or t == self._begin:
            # A step of no length began on a zero, which may be a double one.
            return False
        if phase.signs[mode] == direction:
            return True  # heyoka has found the last switch of this mode again
        margins = phase.margin_list(self._state, t)
        margin, margins[mode] = margins[mode], np.inf
        if self._is_near(margins, t):
            # Another mode switches now as well, or the step has missed its switch.
            self.missed = self.is_missed(margins)
            return False
        if not self.driver.crosses(mode, t, self._state):
            return False
        self.before = self.driver.so_far()
        self.driver.cross_alone(mode, t)
        pars, compiled = integrator.pars, self._compiled
        pars[compiled.modes[mode]] = float(direction > 0)
        if phase.rate_places[mode] != NO_STATE:
            flight = abs(self._state[phase.rate_places[mode]]) * (t - self._crossed_at)
            offset = EVENT_OFFSET * flight if flight < np.inf else 0.0
            pars[compiled.offsets + mode] = direction * offset
            self.floors[mode] = min(-margin, 0.0) - 2.0 * offset
        self._crossed_at, self.least_margin = t, np.inf
        return True

    def has_missed(self, t: float) -> bool:
        """Return whether the step that ends at a time, s, has missed a switch; update `missed`."""
        self._begin = t
        # `at_switch` has looked at the margins where a mode has switched.
        if t != self._crossed_at:
            margins = self.driver.phase.margin_list(self._state, t)
            self.least_margin = min(margins)
            self.missed = self.least_margin < 0 and self.is_missed(margins)
        return self.missed

    def is_missed(self, margins: list[float]) -> bool:
        """Return whether a step has missed a switch, from the margins at its end."""
        return any(map(operator.lt, margins, self.floors))

    def _is_near(self, margins: list[float], t: float) -> bool:
        """Return whether a margin may reach zero at a time, s, up to round-off."""
        state, resolution = self._state, NEAR_TIME * t
        return any(
            margin < (NEAR if place == NO_STATE else resolution * abs(state[place]))
            for margin, place in zip(margins, self.driver.phase.rate_places, strict=True)
        )
