"""Sine, exponential and other functions for every kind of number that the equations accept.

numpy handles floats and complex numbers. All other numbers are entries of object arrays. Their own
methods, such as ``sin`` and ``exp``, are called (python-flint's ``arb``, mpmath), unless a module
registers another function for its kind of number (``sin_of.register(Kind, function)``).

Each function takes one number, or an array. All are analytic where they are defined, so complex
steps give their derivatives. There is no absolute value, and no largest or smallest of two numbers:
these are branches.
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


sin_of = _of_number("sin", np.sin)
cos_of = _of_number("cos", np.cos)
tan_of = _of_number("tan", np.tan)
atan_of = _of_number("atan", np.arctan)
sqrt_of = _of_number("sqrt", np.sqrt)
exp_of = _of_number("exp", np.exp)
log_of = _of_number("log", np.log)
sinh_of = _of_number("sinh", np.sinh)
cosh_of = _of_number("cosh", np.cosh)
tanh_of = _of_number("tanh", np.tanh)

FUNCTIONS: dict[str, Any] = {
    "sin": sin_of,
    "cos": cos_of,
    "tan": tan_of,
    "atan": atan_of,
    "sqrt": sqrt_of,
    "exp": exp_of,
    "log": log_of,
    "sinh": sinh_of,
    "cosh": cosh_of,
    "tanh": tanh_of,
}
"""The functions of one number by name. The modules `math`, `cmath` and heyoka have the same names,
and other kinds of number have methods of these names."""


def sin(x: Array) -> Array:
    """Return the sine of a number, or of each entry of an array."""
    return _applied(np.sin, sin_of, x)


def cos(x: Array) -> Array:
    """Return the cosine of a number, or of each entry of an array."""
    return _applied(np.cos, cos_of, x)


def tan(x: Array) -> Array:
    """Return the tangent of a number, or of each entry of an array."""
    return _applied(np.tan, tan_of, x)


def atan(x: Array) -> Array:
    """Return the inverse tangent of a number, or of each entry of an array."""
    return _applied(np.arctan, atan_of, x)


def sqrt(x: Number) -> Number:
    """Return the square root of a number, or of each entry of an array."""
    return _applied(np.sqrt, sqrt_of, x)


def exp(x: Array) -> Array:
    """Return e to the power of a number, or of each entry of an array."""
    return _applied(np.exp, exp_of, x)


def log(x: Array) -> Array:
    """Return the natural logarithm of a number, or of each entry of an array."""
    return _applied(np.log, log_of, x)


def sinh(x: Array) -> Array:
    """Return the hyperbolic sine of a number, or of each entry of an array."""
    return _applied(np.sinh, sinh_of, x)


def cosh(x: Array) -> Array:
    """Return the hyperbolic cosine of a number, or of each entry of an array."""
    return _applied(np.cosh, cosh_of, x)


def tanh(x: Array) -> Array:
    """Return the hyperbolic tangent of a number, or of each entry of an array."""
    return _applied(np.tanh, tanh_of, x)


@singledispatch
def square(x: Number) -> Number:
    """Return x² of one number. Engines of Taylor series register a cheaper way than x·x."""
    return x * x


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


def _applied(by_numpy: Callable[[Any], Any], of_number: Callable[[Number], Number], x: Any) -> Any:
    if isinstance(x, np.ndarray):
        if x.dtype != object:
            return by_numpy(x)
        return entrywise(of_number, x)
    return by_numpy(x) if isinstance(x, np.generic) else of_number(x)
