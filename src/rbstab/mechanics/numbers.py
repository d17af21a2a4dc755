"""Sine, exponential and other functions for every kind of number that the equations accept.

numpy handles floats and complex numbers. All other numbers are entries of object arrays. Their own
methods, such as ``sin`` and ``exp``, are called (python-flint's ``arb``, mpmath), unless a module
registers another function for its kind of number: ``FUNCTIONS["sin"].register(Kind, function)``.

Each function takes one number, or an array. All are analytic where they are defined (sqrt above 0),
so complex steps give their derivatives. There is no absolute value, and no largest or smallest of
two numbers: these are branches.
"""

from collections.abc import Callable
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Number = Any


def _of_number(name: str, by_numpy: Callable[[Number], Number]) -> Any:
    """Return a function of one number of a kind that numpy does not support: its method `name`."""

    @singledispatch
    def of(x: Number) -> Number:
        return getattr(x, name)()

    for scalar_type in (int, float, complex):
        # A constant among symbols (an angle fixed at 0.0) has no sine method.
        of.register(scalar_type, by_numpy)
    return of


_BY_NUMPY: dict[str, Callable[[Any], Any]] = {
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "atan": np.arctan,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
}

FUNCTIONS: dict[str, Any] = {name: _of_number(name, of) for name, of in _BY_NUMPY.items()}
"""The functions of one number by name. The modules `math`, `cmath` and heyoka have the same names,
and other kinds of number have methods of these names."""


def _function(name: str) -> Callable[[Any], Any]:
    """Return one of the functions, of a number or of each entry of an array."""
    by_numpy, of_number = _BY_NUMPY[name], FUNCTIONS[name]

    def function(x: Any) -> Any:
        if isinstance(x, np.ndarray):
            return entrywise(of_number, x) if x.dtype == object else by_numpy(x)
        return by_numpy(x) if isinstance(x, np.generic) else of_number(x)

    return function


sin, cos, tan, atan, sqrt, exp, log, sinh, cosh, tanh = map(_function, FUNCTIONS)


@singledispatch
def square(x: Number) -> Number:
    """Return x² of one number. Engines of Taylor series register a cheaper way than x·x."""
    return x * x


@singledispatch
def root_excess(x: Number) -> Number:
    """Return √(1 + x²) - 1 of one number, without round-off where x is small."""
    return x * x / (1.0 + sqrt(1.0 + x * x))


def power(x: Array, exponent: int) -> Array:
    """Return a number, or each entry of an array, to the power of a positive whole number.

    It is a product. Engines of Taylor series compute x**3 by a recursion that divides by x, so
    they fail at x = 0.

    Raises:
        ValueError: The exponent is not a whole number above 0.
    """
    if exponent != int(exponent) or exponent < 1:
        raise ValueError(f"power(x, {exponent}): expected a whole number above 0")
    half = power(x, exponent // 2) if exponent > 1 else None
    if half is None:
        return x
    return half * half * x if exponent % 2 else half * half


def entrywise(function: Callable[[Any], Number], values: Array) -> Array:
    """Return an object array of a function of each entry of an array."""
    entries = [function(entry) for entry in values.ravel().tolist()]
    return np.array(entries, dtype=object).reshape(values.shape)
