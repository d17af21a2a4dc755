"""A compiled scalar function with gradient and Hessian, for all systems of one structure."""

from collections.abc import Callable
from typing import Any, NamedTuple

import heyoka as hy

from rbstab.integrate.heyoka.compiled_map import evaluate_compiled
from rbstab.integrate.heyoka.symbols import state_symbols, symbols_of
from rbstab.mechanics.numbers import Array, Number
from rbstab.systems.system import System


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
