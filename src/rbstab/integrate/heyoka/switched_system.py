"""The compiled equations of a body with a sliding connector between switches, with their events.

All parameters are set at run time: one compilation serves all systems of a structure, in all modes.
"""

import threading
from typing import Any, NamedTuple, Protocol

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compile_cache import compiled_once
from rbstab.integrate.heyoka.symbols import (
    compiled_zeros,
    parameter_values,
    scaled_audit,
    state_symbols,
    symbols_of,
    symbols_with_zeros,
)
from rbstab.integrate.switching.chatter import contact_kinetic_energy
from rbstab.integrate.switching.driver import SwitchEvent
from rbstab.integrate.switching.modes import Modes, connector_of, system_for_modes
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY, E_OF_W, THETA
from rbstab.systems.coordinates import PartlyHeldCoordinates
from rbstab.systems.parameters import parameters, structure
from rbstab.systems.system import AUDIT_SIZE, System

COOLDOWN = 1e-10
"""s: a crossing found again within this time is the same crossing. heyoka's default is longer than
the bounces of a chatter."""


class EventHandler(Protocol):
    """The interface of the run that handles the events of a compiled integrator."""

    def at_event(self, integrator: Any, event: SwitchEvent | None) -> bool:
        """Handle an event, None for the end of the range; return False to end the run."""
        ...


class _EventDispatcher:
    """Passes the events of an integrator to its current run."""

    handler: EventHandler


class _Callback:
    """The callback of an event. heyoka copies its callbacks; the copies share the dispatcher."""

    def __init__(self, dispatcher: _EventDispatcher, event: SwitchEvent | None) -> None:
        self.dispatcher = dispatcher
        self.event = event

    def __deepcopy__(self, _memo: Any) -> "_Callback":
        return self

    def __call__(self, integrator: Any, _direction: int) -> bool:
        return self.dispatcher.handler.at_event(integrator, self.event)


class CompiledSwitchedSystem:
    """The compiled audited equations in W, with events at the thresholds of every axis.

    Its `par[]` are the parameters of the system, then the thresholds, their flags, the
    range bound and the energy scale.

    Args:
        system: Any system of the structure with the same zeros (`compiled_zeros`), in W.
        tolerance: heyoka's tolerance.
    """

    def __init__(self, system: System, tolerance: float) -> None:
        symbolic, offsets, first = symbols_of(system, symbols_with_zeros(compiled_zeros(system)))
        self.mode = slice(offsets["connector.mode"], offsets["connector.mode"] + 3)
        coordinates = symbolic.coordinates
        y = state_symbols(BODY.stop + AUDIT_SIZE)
        upper, lower, uses_upper, uses_lower = (
            [hy.par[first + 3 * kind + axis] for axis in range(3)] for kind in range(4)
        )
        bound, scale = hy.par[first + 12], hy.par[first + 13]
        connector = connector_of(symbolic)
        motion = symbolic.motion(y)
        s = connector.surface(motion.E, motion.F)
        self.dispatcher = _EventDispatcher()
        terminal_events = [self._terminal_event(regularity(y[THETA]) - bound, None)]
        # Large event functions would make heyoka's steps smaller. So an unused event function is
        # 1, and forces are divided by their bounds. `scipy_flow` needs neither: there, an event
        # function has no effect on the steps.
        for axis in range(3):
            above = uses_upper[axis] * (s[axis] - upper[axis]) + (1.0 - uses_upper[axis])
            below = uses_lower[axis] * (s[axis] - lower[axis]) + (1.0 - uses_lower[axis])
            terminal_events.append(
                self._terminal_event(above, SwitchEvent(axis, 1.0, release=False))
            )
            terminal_events.append(
                self._terminal_event(below, SwitchEvent(axis, -1.0, release=False))
            )
        if isinstance(coordinates, PartlyHeldCoordinates):
            force = symbolic.observe(y).contact_force * coordinates.held
            force_ratio = force / connector.K_s
            for axis in range(3):
                terminal_events.append(
                    self._terminal_event(
                        force_ratio[axis] - 1.0, SwitchEvent(axis, 1.0, release=True)
                    )
                )
                terminal_events.append(
                    self._terminal_event(
                        force_ratio[axis] + 1.0, SwitchEvent(axis, -1.0, release=True)
                    )
                )
        self.integrator = hy.taylor_adaptive(
            list(zip(y, scaled_audit(symbolic.audited_rates(y), BODY.stop, scale), strict=True)),
            state=[0.0] * len(y),
            tol=tolerance,
            t_events=terminal_events,
            # The equivalent force needs so much code that LLVM would compile for 20 s. Axes are
            # seldom held, so slower code does not matter.
            compact_mode=isinstance(coordinates, PartlyHeldCoordinates),
        )

    def _terminal_event(self, quantity: Any, event: SwitchEvent | None) -> Any:
        directions = hy.event_direction
        rising = (
            directions.positive
            if event is not None and event.direction > 0
            else directions.negative
        )
        return hy.t_event(
            quantity,
            callback=_Callback(self.dispatcher, event),
            direction=rising,
            cooldown=COOLDOWN,
        )


def switched_system(system: System, tolerance: float) -> CompiledSwitchedSystem:
    """Return the equations of a system's structure and zeros, compiled once in each thread."""
    named = parameters(system)
    key = CompiledSwitchedSystem, structure(system, named), compiled_zeros(system, named), tolerance
    return compiled_once(key, lambda: CompiledSwitchedSystem(system, tolerance))


class CompiledModes(NamedTuple):
    """A system in given modes, its compiled equations, and the values of its parameters."""

    system: System
    switched: CompiledSwitchedSystem
    values: Array


class _LastSystem(threading.local):
    """The modes of the last system of this thread.

    The search for the peaks of one run starts many short runs of the same system.
    """

    def __init__(self) -> None:
        self.key: tuple[System, float] | None = None
        self.found: dict[Modes, CompiledModes] = {}


_last = _LastSystem()


def compiled_modes(system: System, tolerance: float, modes: Modes) -> CompiledModes:
    """Return a system in given modes with its compiled equations."""
    # Systems are compared as objects, not by their values.
    if _last.key != (system, tolerance):
        _last.key, _last.found = (system, tolerance), {}
    if modes not in _last.found:
        smooth = system_for_modes(system, modes)
        switched = switched_system(smooth, tolerance)
        _last.found[modes] = CompiledModes(smooth, switched, parameter_values(smooth))
    return _last.found[modes]


class WeakChatter:
    """A compiled test of the chatter energy e against an upper bound.

    The flow calls this test at switches without interrupting the integration, because an
    interruption would change the last digits. So neither the bound nor the number of tests changes
    the trajectory.
    """

    def __init__(self, system: System, bound: float) -> None:
        self.bound, self.K_s = bound, connector_of(system).K_s
        key = contact_kinetic_energy, structure(system)
        self.kinetic_energy = compiled_once(key, lambda: _compile_kinetic_energy(system))
        self.values = parameter_values(system)[: self.kinetic_energy.nparams]

    def __call__(self, state: Array) -> bool:
        """Return whether e is below the bound at a state."""
        potential_energy = self.K_s @ np.abs(state[E_OF_W])
        if potential_energy >= self.bound:
            return False
        return bool(
            self.kinetic_energy(state[BODY], pars=self.values)[0] + potential_energy < self.bound
        )


def _compile_kinetic_energy(system: System) -> Any:
    """Compile `contact_kinetic_energy` for all systems of a structure."""
    symbolic, _, _ = symbols_of(system)
    y = state_symbols(12)
    return hy.cfunc([contact_kinetic_energy(symbolic, y)], vars=list(y))
