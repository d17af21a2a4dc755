"""The compiled stepper of the implicit law."""

from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compile_cache import compiled_once
from rbstab.integrate.heyoka.symbols import parameter_values, state_symbols, symbols_of
from rbstab.integrate.switching.implicit import Stepper, StepResult, step, system_for_step
from rbstab.integrate.switching.modes import Modes
from rbstab.mechanics.numbers import Array
from rbstab.systems.parameters import structure
from rbstab.systems.system import AUDIT_SIZE, System


def compiled_stepper(system: System) -> Stepper:
    """Return a stepper with one compiled function; the modes and h are its parameters."""
    compiled = compiled_once((step, structure(system)), lambda: _compiled_step(system))
    parameters_by_modes: dict[Modes, Array] = {}
    current_step = 0.0

    def stepper(y: Array, modes: Modes, h: float) -> StepResult:
        nonlocal current_step
        if h != current_step:
            parameters_by_modes.clear()
            current_step = h
        if modes not in parameters_by_modes:
            parameters_by_modes[modes] = np.append(
                parameter_values(system_for_step(system, modes, h)), h
            )
        outputs = compiled(y, pars=parameters_by_modes[modes])
        return StepResult(outputs[:14], outputs[14:17], outputs[17:20])

    return stepper


def _compiled_step(system: System) -> Any:
    """Compile the step of all systems of a structure, in all modes."""
    symbolic, _, count = symbols_of(system_for_step(system, Modes((0.0, 0.0, 0.0)), 1.0))
    y = state_symbols(12 + AUDIT_SIZE)
    state, surface, force = step(symbolic, y, hy.par[count])
    return hy.cfunc([*state, *surface, *force], vars=list(y))
