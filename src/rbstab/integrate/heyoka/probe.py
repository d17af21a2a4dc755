"""Values and a step of a system as heyoka compiles it, to compare them with those of numpy."""

from collections.abc import Callable

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compiled_map import evaluate_compiled
from rbstab.integrate.heyoka.symbols import (
    parameter_values,
    set_parameters,
    state_symbols,
    symbols_of,
)
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

TOLERANCE = 1e-9
LONGEST = 1e-3
"""s; the longest step: at rest without forces any step would do."""


class Probe:
    """Functions of one structure of systems, compiled.

    Args:
        system: Any system of the structure.
        values: Takes a system and a state of any kind of number, and returns an array.
    """

    def __init__(self, system: System, values: Callable[[System, Array], Array]) -> None:
        symbolic, _, _ = symbols_of(system)
        y = state_symbols(system.size)
        results = [hy.expression(0.0) + entry for entry in values(symbolic, y).tolist()]
        self._values = hy.cfunc(results, vars=list(y))
        rates = [hy.expression(0.0) + entry for entry in symbolic.rates(y).tolist()]
        equations = list(zip(y.tolist(), rates, strict=True))
        self._integrator = hy.taylor_adaptive(equations, np.zeros(system.size), tol=TOLERANCE)

    def values(self, system: System, y: Array) -> Array:
        """Return the values of a system of the structure at a state of floats."""
        # The last parameters may be in no value, as the anchor; then heyoka has no place for them.
        pars = parameter_values(system).astype(float)[: self._values.nparams, np.newaxis]
        return evaluate_compiled(self._values, y[:, np.newaxis], pars)[:, 0]

    def steps_from(self, system: System, y: Array) -> bool:
        """Return whether a step from a state ends at finite numbers."""
        integrator = self._integrator
        integrator.time, integrator.state[:] = 0.0, y
        set_parameters(integrator, parameter_values(system).astype(float))
        outcome, _ = integrator.step(LONGEST)
        ended = outcome in (hy.taylor_outcome.success, hy.taylor_outcome.time_limit)
        return ended and bool(np.isfinite(integrator.state).all())
