"""The compiled equations of systems: parameters, modes and legs of inputs are `par[]` of them."""

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compile_cache import compiled_once
from rbstab.integrate.heyoka.symbols import (
    compiled_zeros,
    scaled_audit,
    state_symbols,
    symbols_of,
)
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.states import THETA
from rbstab.systems.filippov import idle_holds
from rbstab.systems.impact import stop_of
from rbstab.systems.modes import guards_at, mode_parameters
from rbstab.systems.parameters import parameters, structure
from rbstab.systems.system import System

MAX_UNROLLED = 4
"""Modes of a system whose equations are compiled without loops. Loops take a tenth of the time to
compile, and five times as long to run."""


COOLDOWN = 1e-10
"""s: a zero of an event function that is found again within this time is the same zero. heyoka's
default is longer than the bounces of a chatter."""


class CompiledEquations:
    """The compiled audited equations of one structure, in all modes. Each run sets the parameters.

    Its `par[]` are the parameters of the system, the range bound, the energy scale, and an offset
    of each event function.

    Args:
        system: Any system of the structure with the same zeros (`compiled_zeros`). If it holds no
            axis on a surface, no system in which one is held.
        tolerance: heyoka's tolerance: relative or absolute, whichever is larger for a state.

    Attributes:
        integrator: heyoka's integrator.
        modes: The index of the `par[]` of each mode.
        offsets: The index of the `par[]` of the offset of the first event function.
        event_modes: The modes whose event functions can reach zero, in the order of the events.
        names: The index of the first `par[]` of each parameter.
        handlers: Called with heyoka's integrator at a zero of an event function, the mode, and 1 if
            the function rises, -1 if it falls; returns whether heyoka's loop goes on. One at most.
    """

    def __init__(self, system: System, tolerance: float) -> None:
        zeros = _zeros(system)
        symbolic, first, count = symbols_of(
            system, lambda index: hy.expression(0.0) if index in zeros else hy.par[index]
        )
        places = [
            first[f"{element.name}.mode"] + np.arange(element.mode_count)
            for element in system.elements
            if element.mode_count
        ]
        self.modes = np.concatenate([np.zeros(0, dtype=int), *places])
        self.offsets = count + 2
        y = state_symbols(system.audited_size)
        rates = symbolic.audited_rates(y, hy.time)
        rates = scaled_audit(rates, system.size, hy.par[count + 1])
        self.names = first
        leaving = regularity(y[THETA]) - hy.par[count]
        guards = guards_at(symbolic, y, hy.time)
        self.event_modes = [mode for mode, guard in enumerate(guards) if not _is_constant(guard)]
        self.handlers: list[Callable[[Any, int, int], bool]] = []
        switches = [
            hy.t_event(
                guards[mode] + hy.par[self.offsets + mode],
                callback=_passing_on(mode, self.handlers),
                cooldown=COOLDOWN,
            )
            for mode in self.event_modes
        ]
        self.integrator = hy.taylor_adaptive(
            list(zip(y, rates, strict=True)),
            state=[0.0] * len(y),
            tol=tolerance,
            t_events=[hy.t_event(leaving), *switches, *map(hy.t_event, symbolic.clearances(y))],
            # The code grows with the elements: with eight of them LLVM would compile for minutes.
            compact_mode=len(switches) > MAX_UNROLLED or _is_long(system, len(switches)),
        )


def _passing_on(
    mode: int, handlers: list[Callable[[Any, int, int], bool]]
) -> Callable[[Any, int], bool]:
    """Return the callback of an event. heyoka copies the callback, and the handlers are shared."""

    def callback(integrator: Any, direction: int) -> bool:
        return handlers[0](integrator, mode, direction)

    return callback


def _zeros(system: System) -> tuple[int, ...]:
    """Return the indices of the parameters that are compiled in as zeros, with `idle_holds`."""
    named, modes = parameters(system), mode_parameters(system)
    is_mode = np.repeat([name in modes for name in named], [value.size for value in named.values()])
    idle = np.flatnonzero(is_mode)[list(idle_holds(system))]
    return (*compiled_zeros(system), *idle.tolist())


def _is_constant(event_function: Any) -> bool:
    """Return whether an event function has no symbol, so that it never reaches zero."""
    # A sum, because heyoka 7.10 makes no expression of an expression.
    expressions = [hy.expression(0.0) + event_function]
    return not hy.get_variables(expressions) and not hy.get_params(expressions)


def _is_long(system: System, modes: int) -> bool:
    """Return whether the equations are long: of a stop beside another element that switches."""
    # They have the load on the stop, also where the body does not rest there. The equations of a
    # manifold are as long with a stop alone.
    has_stop = stop_of(system) is not None
    return has_stop and (modes > 2 or system.coordinates.name == "manifold")


def compiled_equations(system: System, tolerance: float) -> CompiledEquations:
    """Return the equations of a system's structure and zeros, compiled once in each thread."""
    key = CompiledEquations, structure(system), _zeros(system), tolerance
    return compiled_once(key, lambda: CompiledEquations(system, tolerance))
