"""A function of numbers, written once, compiled for many at a time."""

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka_engine import state_symbols
from rbstab.mechanics.numbers import Array

SIMD = hy.recommended_simd_size()
"""Numbers in a vector of the processor."""


def compiled_map(function: Callable[[Array], Array], inputs: int) -> Callable[[Array], Array]:
    """The same function of many arguments at once.

    Args:
        function: Takes an array of shape (inputs,) of any kind of number, and returns one of shape
            (outputs,).
        inputs: How many numbers it takes.

    Returns:
        A function that takes shape (inputs, m) and returns shape (outputs, m).
    """
    symbols = state_symbols(inputs)
    results = [hy.expression(0.0) + entry for entry in function(symbols).tolist()]
    if not inputs:
        constants = np.array([float(hy.cfunc([entry], vars=[])([])[0]) for entry in results])
        return lambda given: np.repeat(constants[:, np.newaxis], given.shape[1], axis=1)
    compiled = hy.cfunc(results, vars=list(symbols))
    return lambda given: evaluated(compiled, given)


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
