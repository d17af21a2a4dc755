"""The compiled stepper of the implicit law."""

from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compile_cache import compiled_once
from rbstab.integrate.heyoka.symbols import parameter_values, state_symbols, symbols_of
from rbstab.integrate.implicit.axis_modes import Modes
from rbstab.integrate.implicit.steps import Stepper, StepResult, step, system_for_step
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY
from rbstab.systems.parameters import structure
from rbstab.systems.system import AUDIT_SIZE, System

_STATE = slice(0, BODY.stop + AUDIT_SIZE)
_SURFACE = slice(_STATE.stop, _STATE.stop + 3)
_FORCE = slice(_SURFACE.stop, _SURFACE.stop + 3)
"""The outputs of the compiled step, in the order of `StepResult`."""


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
        return StepResult(outputs[_STATE], outputs[_SURFACE], outputs[_FORCE])

    return stepper


def _compiled_step(system: System) -> Any:
    """Compile the step of all systems of a structure, in all modes."""
    symbolic, _, count = symbols_of(system_for_step(system, Modes((0.0, 0.0, 0.0)), 1.0))
    y = state_symbols(_STATE.stop)
    state, surface, force = step(symbolic, y, hy.par[count])
    return hy.cfunc([*state, *surface, *force], vars=list(y))
