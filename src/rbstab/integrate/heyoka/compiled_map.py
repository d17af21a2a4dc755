"""Compiled functions, evaluated for many arguments at once."""

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.symbols import state_symbols
from rbstab.mechanics.numbers import Array

SIMD = hy.recommended_simd_size()
"""The number of floating-point numbers in a SIMD vector."""


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
