"""Sine, cosine and square root for every kind of number that the equations accept.

numpy handles floats and complex numbers. All other numbers are entries of object arrays. Their own
methods ``sin``, ``cos`` and ``sqrt`` are called (python-flint's ``arb``, mpmath), unless a module
registers another function for its kind of number (``sin_of.register(Kind, function)``).
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
    """Return the sine of one number of a kind that numpy does not support."""
    return x.sin()


@singledispatch
def cos_of(x: Number) -> Number:
    """Return the cosine of one number of a kind that numpy does not support."""
    return x.cos()


@singledispatch
def sqrt_of(x: Number) -> Number:
    """Return the square root of one number of a kind that numpy does not support."""
    return x.sqrt()


for _scalar_type in (int, float, complex):
    # A constant among symbols (an angle fixed at 0.0) has no sine method.
    sin_of.register(_scalar_type, np.sin)
    cos_of.register(_scalar_type, np.cos)
    sqrt_of.register(_scalar_type, np.sqrt)


def sin(x: Array) -> Array:
    """Return the sine of each entry of an array of any kind of number."""
    return np.sin(x) if x.dtype != object else _each(sin_of, x)


def cos(x: Array) -> Array:
    """Return the cosine of each entry of an array of any kind of number."""
    return np.cos(x) if x.dtype != object else _each(cos_of, x)


def sqrt(x: Number) -> Number:
    """Return the square root of one number of any kind."""
    return np.sqrt(x) if isinstance(x, np.generic) else sqrt_of(x)


def _each(function: Callable[[Number], Number], x: Array) -> Array:
    return np.array([function(entry) for entry in x], dtype=object)
