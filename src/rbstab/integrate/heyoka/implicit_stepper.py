"""The steps of the implicit law, compiled."""

from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compile_cache import compiled_once
from rbstab.integrate.heyoka.symbols import parameter_values, state_symbols, symbols_of
from rbstab.integrate.switching.implicit import Stepped, Stepper, step, system_for_step
from rbstab.integrate.switching.modes import Modes
from rbstab.mechanics.numbers import Array
from rbstab.systems.parameters import structure
from rbstab.systems.system import AUDIT_SIZE, System


def compiled_stepper(system: System) -> Stepper:
    """Steps of a system by one compiled function; what they depend on besides the state is open."""
    compiled = compiled_once((step, structure(system)), lambda: _compiled_step(system))
    known: dict[Modes, Array] = {}
    length = 0.0

    def stepper(y: Array, modes: Modes, h: float) -> Stepped:
        nonlocal length
        if h != length:
            known.clear()
            length = h
        if modes not in known:
            known[modes] = np.append(parameter_values(system_for_step(system, modes, h)), h)
        out = compiled(y, pars=known[modes])
        return Stepped(out[:14], out[14:17], out[17:20])

    return stepper


def _compiled_step(system: System) -> Any:
    """The function that makes the step of any system of a structure, under any modes."""
    symbolic, _, count = symbols_of(system_for_step(system, Modes((0.0, 0.0, 0.0)), 1.0))
    y = state_symbols(12 + AUDIT_SIZE)
    state, surface, force = step(symbolic, y, hy.par[count])
    return hy.cfunc([*state, *surface, *force], vars=list(y))
