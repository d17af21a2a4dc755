"""Compiled functions: of many arguments at once, of systems, and with derivatives."""

from collections.abc import Callable, Iterable
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


class Compiled:
    """A compiled function of some numbers, of `par[]` and of the time, for many arguments at once.

    heyoka evaluates an incomplete SIMD vector with other code, whose last digits differ. So the
    last argument is repeated until all vectors are complete: no bit depends on the others.

    Args:
        entries: Its values: expressions, or numbers.
        symbols: The symbols of its arguments, shape (inputs,).

    Attributes:
        varies: Which values depend on an argument, shape (values,).
        parameters: The number of `par[]` that it needs.
    """

    def __init__(self, entries: Iterable[Any], symbols: Array) -> None:
        expressions = [hy.expression(0.0) + entry for entry in entries]
        self.varies = np.array([bool(hy.get_variables(entry)) for entry in expressions])
        self._inputs = len(symbols)
        self._compiled = hy.cfunc(expressions, vars=list(symbols) or [hy.expression("none")])
        self.parameters = self._compiled.nparams

    def __call__(
        self, inputs: Array, pars: Array | None = None, times: Array | None = None
    ) -> Array:
        """Return the values, shape (values, m).

        Args:
            inputs: Shape (inputs, m); more rows may follow.
            pars: `par[]`, shape (parameters, m); more rows may follow.
            times: Shape (m,), s.
        """
        count = inputs.shape[1]
        if count % SIMD:
            full = np.minimum(np.arange(-(-count // SIMD) * SIMD), count - 1)
            pars = None if pars is None else pars[:, full]
            times = None if times is None else times[full]
            return np.ascontiguousarray(self(inputs[:, full], pars, times)[:, :count])
        given = {} if pars is None else {"pars": np.ascontiguousarray(pars[: self.parameters])}
        if self._compiled.is_time_dependent:
            given["time"] = np.ascontiguousarray(times)
        arguments = inputs[: self._inputs] if self._inputs else np.zeros((1, count))
        return np.asarray(self._compiled(np.ascontiguousarray(arguments), **given))


def compiled_map(function: Callable[[Array], Array], inputs: int) -> Compiled:
    """Return a compiled function of some numbers of any kind, shape (inputs,)."""
    symbols = state_symbols(inputs)
    return Compiled(function(symbols).tolist(), symbols)


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
        self._compiled = Compiled([value, *first, *second], q)

    def at(self, parameters: Array, q: Array) -> ScalarAt:
        """Return the value and its derivatives.

        Args:
            parameters: The parameters, shape (parameters, m), in the order of `parameter_values`.
            q: The arguments, shape (n, m).
        """
        outputs = self._compiled(q, parameters).T
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
        self._values = Compiled(values(symbolic, y).tolist(), y)
        rates = [hy.expression(0.0) + entry for entry in symbolic.rates(y).tolist()]
        equations = list(zip(y.tolist(), rates, strict=True))
        self._integrator = hy.taylor_adaptive(equations, np.zeros(system.size), tol=PROBED)

    def values(self, system: System, y: Array) -> Array:
        """Return the values of a system of the structure at a state of floats."""
        pars = parameter_values(system).astype(float)
        return self._values(y[:, np.newaxis], pars[:, np.newaxis])[:, 0]

    def steps_from(self, system: System, y: Array) -> bool:
        """Return whether a step from a state ends at finite numbers."""
        integrator = self._integrator
        integrator.time, integrator.state[:] = 0.0, y
        set_parameters(integrator, parameter_values(system).astype(float))
        outcome, _ = integrator.step(LONGEST)
        ended = outcome in (hy.taylor_outcome.success, hy.taylor_outcome.time_limit)
        return ended and bool(np.isfinite(integrator.state).all())
