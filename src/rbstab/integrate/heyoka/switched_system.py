"""The equations of a sliding body between its switches, compiled with their events.

Every parameter is open: one compilation serves all systems of a structure, under all their modes.
"""

from typing import Any, Protocol

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compile_cache import compiled_once
from rbstab.integrate.heyoka.symbols import (
    parameter_values,
    scaled_audit,
    state_symbols,
    symbols_of,
)
from rbstab.integrate.switching.chatter import bouncing_energy
from rbstab.integrate.switching.driver import Hit
from rbstab.integrate.switching.modes import connector_of
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.systems.coordinates import PartlyHeldCoordinates
from rbstab.systems.parameters import structure
from rbstab.systems.system import AUDIT_SIZE, System

COOLDOWN = 1e-10
"""s: a crossing that is found again this soon after itself is the same. heyoka's own choice is
longer than the bounces that a chatter comes to."""


class Listener(Protocol):
    """Who uses a compiled integrator at the moment."""

    def at_event(self, integrator: Any, hit: Hit | None) -> bool:
        """An event, None for the end of the range; false ends the run."""
        ...


class _Sink:
    """Where the events of an integrator report to: whoever uses it at the moment."""

    listener: Listener


class _Callback:
    """What heyoka calls at an event. heyoka copies its callbacks; copies share the sink."""

    def __init__(self, sink: _Sink, hit: Hit | None) -> None:
        self.sink = sink
        self.hit = hit

    def __deepcopy__(self, _memo: Any) -> "_Callback":
        return self

    def __call__(self, integrator: Any, _direction: int) -> bool:
        return self.sink.listener.at_event(integrator, self.hit)


class Switched:
    """The audited equations in W, compiled, with events at the thresholds of every axis.

    Open are the parameters of the system, then thresholds, range bound and scale of the energies.

    Args:
        system: Any system of the structure, in coordinates W.
        tolerance: heyoka's tolerance.
    """

    def __init__(self, system: System, tolerance: float) -> None:
        symbolic, offsets, first = symbols_of(system)
        self.mode = slice(offsets["connector.mode"], offsets["connector.mode"] + 3)
        coordinates = symbolic.coordinates
        y = state_symbols(12 + AUDIT_SIZE)
        up, down, uses_up, uses_down = (
            [hy.par[first + 3 * kind + axis] for axis in range(3)] for kind in range(4)
        )
        bound, scale = hy.par[first + 12], hy.par[first + 13]
        connector = connector_of(symbolic)
        motion = symbolic.motion(y)
        s = connector.surface(motion.E, motion.F)
        self.sink = _Sink()
        events = [self._event(regularity(y[0:3]) - bound, None)]
        # heyoka counts event functions among the states when it chooses its steps, so they must not
        # be large: one that is not used is 1, and forces are in units of their bounds.
        for axis in range(3):
            above = uses_up[axis] * (s[axis] - up[axis]) + (1.0 - uses_up[axis])
            below = uses_down[axis] * (s[axis] - down[axis]) + (1.0 - uses_down[axis])
            events.append(self._event(above, Hit(axis, 1.0, release=False)))
            events.append(self._event(below, Hit(axis, -1.0, release=False)))
        if isinstance(coordinates, PartlyHeldCoordinates):
            force = symbolic.observe(y).contact_force * coordinates.held
            load = force / connector.K_s
            for axis in range(3):
                events.append(self._event(load[axis] - 1.0, Hit(axis, 1.0, release=True)))
                events.append(self._event(load[axis] + 1.0, Hit(axis, -1.0, release=True)))
        self.integrator = hy.taylor_adaptive(
            list(zip(y, scaled_audit(symbolic.audited_rates(y), scale), strict=True)),
            state=[0.0] * len(y),
            tol=tolerance,
            t_events=events,
            # With the equivalent force the code is so large that LLVM would need 20 s for it; there
            # are few events to be fast for.
            compact_mode=isinstance(coordinates, PartlyHeldCoordinates),
        )

    def _event(self, quantity: Any, hit: Hit | None) -> Any:
        directions = hy.event_direction
        rising = (
            directions.positive if hit is not None and hit.direction > 0 else directions.negative
        )
        return hy.t_event(
            quantity, callback=_Callback(self.sink, hit), direction=rising, cooldown=COOLDOWN
        )


def switched_system(system: System, tolerance: float) -> Switched:
    """The compiled equations of a system's structure, made once in each thread."""
    key = Switched, structure(system), tolerance
    return compiled_once(key, lambda: Switched(system, tolerance))


class WeakChatter:
    """Whether the chatter energy e is below a bound, compiled.

    It is asked at every switch inside a run, so that neither how often it is asked nor the bound
    change the motion that is followed: pausing there would, by its last digits.
    """

    def __init__(self, system: System, bound: float) -> None:
        self.bound, self.K_s = bound, connector_of(system).K_s
        key = bouncing_energy, structure(system)
        self.bouncing = compiled_once(key, lambda: _compiled_bouncing(system))
        self.values = parameter_values(system)[: self.bouncing.nparams]

    def __call__(self, state: Array) -> bool:
        """Whether it is at a state."""
        resting = self.K_s @ np.abs(state[6:9])
        if resting >= self.bound:
            return False
        return bool(self.bouncing(state[:12], pars=self.values)[0] + resting < self.bound)


def _compiled_bouncing(system: System) -> Any:
    """The energy of the bouncing of any system of a structure."""
    symbolic, _, _ = symbols_of(system)
    y = state_symbols(12)
    return hy.cfunc([bouncing_energy(symbolic, y)], vars=list(y))
