"""A function of numbers, written once, compiled for many at a time."""

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.symbols import state_symbols
from rbstab.mechanics.numbers import Array

SIMD = hy.recommended_simd_size()
"""Numbers in a vector of the processor."""


class CompiledMap:
    """A function of many arguments at once.

    Args:
        function: Takes an array of shape (inputs,) of any kind of number, and returns one of shape
            (outputs,).
        inputs: How many numbers it takes.

    Attributes:
        varies: Which outputs depend on an input, shape (outputs,).
    """

    def __init__(self, function: Callable[[Array], Array], inputs: int) -> None:
        symbols = state_symbols(inputs)
        results = [hy.expression(0.0) + entry for entry in function(symbols).tolist()]
        self.varies = np.array([bool(hy.get_variables(entry)) for entry in results])
        self.compiled = hy.cfunc(results, vars=list(symbols) or [hy.expression("none")])

    def __call__(self, given: Array) -> Array:
        """The outputs, shape (outputs, m), at inputs of shape (inputs, m)."""
        return evaluated(self.compiled, given if len(given) else np.zeros((1, given.shape[1])))


def evaluated(compiled: Any, inputs: Array, pars: Array | None = None) -> Array:
    """A compiled function of many arguments, each with the same bits wherever it stands.

    heyoka evaluates what does not fill a SIMD vector by other code, whose last digits differ: so
    the columns are filled up.

    Args:
        compiled: A `heyoka.cfunc`.
        inputs: Shape (inputs, m).
        pars: Shape (parameters, m), where there are any.

    Returns:
        Shape (outputs, m).
    """
    count = inputs.shape[1]
    full = np.arange(-(-count // SIMD) * SIMD)
    full[count:] = count - 1
    given = {} if pars is None else {"pars": np.ascontiguousarray(pars[:, full])}
    found = compiled(np.ascontiguousarray(inputs[:, full]), **given)
    return np.ascontiguousarray(found[:, :count])
