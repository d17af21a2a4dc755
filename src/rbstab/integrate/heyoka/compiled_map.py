"""Compiled functions: of many arguments at once, of systems, and with derivatives."""

from collections.abc import Callable
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.symbols import (
    parameter_values,
    set_parameters,
    state_symbols,
    symbols_of,
)
from rbstab.mechanics.numbers import Array, Number
from rbstab.systems.system import System

SIMD = hy.recommended_simd_size()
"""The number of floating-point numbers in a SIMD vector."""

PROBED = 1e-9
"""The tolerance of the step of a `Probe`."""

LONGEST = 1e-3
"""s; the longest step of a `Probe`: at rest without forces any step would do."""


class CompiledMap:
    """A compiled function, evaluated for many arguments at once.

    Args:
        function: Takes an array of shape (inputs,), of any kind of number, and returns an array of
            shape (outputs,).
        inputs: The number of inputs.

    Attributes:
        varies: Which outputs depend on an input, shape (outputs,).
    """

    def __init__(self, function: Callable[[Array], Array], inputs: int) -> None:
        symbols = state_symbols(inputs)
        results = [hy.expression(0.0) + entry for entry in function(symbols).tolist()]
        self.varies = np.array([bool(hy.get_variables(entry)) for entry in results])
        self.compiled = hy.cfunc(results, vars=list(symbols) or [hy.expression("none")])

    def __call__(self, inputs: Array) -> Array:
        """Return the outputs, shape (outputs, m), for inputs of shape (inputs, m)."""
        return evaluate_compiled(
            self.compiled, inputs if len(inputs) else np.zeros((1, inputs.shape[1]))
        )


class ScalarAt(NamedTuple):
    """The value (m,), gradient (m, n) and Hessian (m, n, n) for m arguments."""

    value: Array
    gradient: Array
    hessian: Array


class CompiledScalar:
    """A compiled function f(system, q) with its derivatives by q, for all systems of a structure.

    Args:
        system: Any system of the structure.
        function: f, for any kind of number in the system and in q, shape (n,).
        size: The size n of q.
    """

    def __init__(
        self, system: System, function: Callable[[System, Array], Number], size: int
    ) -> None:
        self.size = size
        symbolic, self.offsets, _ = symbols_of(system)
        q = state_symbols(size)
        value: Any = hy.expression(0.0) + function(symbolic, q)
        first = [hy.diff(value, entry) for entry in q]
        second = [hy.diff(slope, entry) for slope in first for entry in q]
        self.compiled = hy.cfunc([value, *first, *second], vars=list(q))

    def at(self, parameters: Array, q: Array) -> ScalarAt:
        """Return the value and its derivatives.

        Args:
            parameters: The parameters, shape (parameters, m), in the order of `parameter_values`.
            q: The arguments, shape (n, m).
        """
        outputs = evaluate_compiled(self.compiled, q, parameters[: self.compiled.nparams]).T
        n = self.size
        return ScalarAt(outputs[:, 0], outputs[:, 1 : n + 1], outputs[:, n + 1 :].reshape(-1, n, n))


class Probe:
    """Values and a step of a system as heyoka compiles it, to compare them with those of numpy.

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
        self._integrator = hy.taylor_adaptive(equations, np.zeros(system.size), tol=PROBED)

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


def lanes_of(count: int) -> Array:
    """Return the index of the column in each lane of complete SIMD vectors, shape (lanes,).

    heyoka evaluates an incomplete SIMD vector with other code, whose last digits differ. So the
    last column is repeated until all vectors are complete.

    Args:
        count: The number of columns.
    """
    return np.minimum(np.arange(-(-count // SIMD) * SIMD), count - 1)


def evaluate_compiled(compiled: Any, inputs: Array, pars: Array | None = None) -> Array:
    """Evaluate a compiled function; the bits of a column do not depend on its position.

    Args:
        compiled: A `heyoka.cfunc`.
        inputs: Shape (inputs, m).
        pars: Shape (parameters, m), or None.

    Returns:
        The outputs, shape (outputs, m).
    """
    count = inputs.shape[1]
    full = lanes_of(count)
    parameters = {} if pars is None else {"pars": np.ascontiguousarray(pars[:, full])}
    outputs = compiled(np.ascontiguousarray(inputs[:, full]), **parameters)
    return np.ascontiguousarray(outputs[:, :count])
