"""A function of numbers, written once, compiled for many at a time."""

from collections.abc import Callable

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka_engine import state_symbols
from rbstab.mechanics.numbers import Array


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
    return lambda given: np.asarray(compiled(np.ascontiguousarray(given)))
