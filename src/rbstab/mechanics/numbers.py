"""Elementary functions for every kind of number that flows through the equations.

Floats and complex numbers go to numpy. Anything else arrives in an object array: its sine and
cosine are the element's own methods (python-flint's ``arb``, mpmath), unless the kind of number was
registered here by the module that brings it in (``sin_of.register(Kind, function)``).
"""

from collections.abc import Callable
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Number = Any


@singledispatch
def sin_of(x: Number) -> Number:
    """The sine of one number of a kind that numpy does not know."""
    return x.sin()


@singledispatch
def cos_of(x: Number) -> Number:
    """The cosine of one number of a kind that numpy does not know."""
    return x.cos()


for _plain in (int, float, complex):
    # A constant among symbols (an angle held at 0.0) has no sine method of its own.
    sin_of.register(_plain, np.sin)
    cos_of.register(_plain, np.cos)


def sin(x: Array) -> Array:
    """The sine of each entry of an array, whatever its kind of number."""
    return np.sin(x) if x.dtype != object else _each(sin_of, x)


def cos(x: Array) -> Array:
    """The cosine of each entry of an array, whatever its kind of number."""
    return np.cos(x) if x.dtype != object else _each(cos_of, x)


def _each(function: Callable[[Number], Number], x: Array) -> Array:
    return np.array([function(entry) for entry in x], dtype=object)
