"""A scalar function of many systems of one structure, with two derivatives, compiled."""

from collections.abc import Callable
from typing import Any, NamedTuple

import heyoka as hy

from rbstab.integrate.heyoka.compiled_map import evaluated
from rbstab.integrate.heyoka.symbols import state_symbols, symbols_of
from rbstab.mechanics.numbers import Array, Number
from rbstab.systems.system import System


class ScalarAt(NamedTuple):
    """Of m arguments: value (m,), gradient (m, n) and Hessian (m, n, n)."""

    value: Array
    gradient: Array
    hessian: Array


class CompiledScalar:
    """f(system, q), for every system of a structure.

    Args:
        system: Any system of the structure.
        function: f, for any kind of number in the system and in q, shape (n,).
        size: n.
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
        """The value and its derivatives.

        Args:
            parameters: Shape (parameters, m), in the order of `parameter_values`.
            q: Shape (n, m).
        """
        found = evaluated(self.compiled, q, parameters[: self.compiled.nparams]).T
        n = self.size
        return ScalarAt(found[:, 0], found[:, 1 : n + 1], found[:, n + 1 :].reshape(-1, n, n))
