"""Functions of one number with their first two derivatives: to round-off, or of intervals.

Each returns [g, g′, g″]. Those of intervals have proved bounds: sines and the like are computed by
python-flint (`arb`), number by number, as numpy proves nothing of its errors.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rbstab.analysis.proof.formulas.program import SQUARE_ABOVE
from rbstab.analysis.proof.lines.intervals import ROUNDING, Intervals, between, near
from rbstab.mechanics import numbers
from rbstab.mechanics.numbers import Array, Number

BITS = 80
"""Bits of a ball, so that it is rounded to 53 bits once, at the end."""

MOST_POWER = 16
"""The largest exponent n, and that of 1/x: a power is a product of n factors, each rounded."""


def function(name: str, x: Any) -> list[Any]:
    """Return a function of one number, such as "sin", and its derivatives.

    Args:
        name: Its name in `mechanics.numbers`.
        x: The numbers: an array, or intervals.
    """
    if name == SQUARE_ABOVE:
        return _square_above(x)
    compute = _FUNCTIONS[name]
    return _of_intervals(compute, x) if isinstance(x, Intervals) else compute(x)


def _of_intervals(compute: Callable[[Number], list[Number]], x: Intervals) -> list[Intervals]:
    from flint import arb, ctx  # imported late, as in `polynomial`

    # Boxes of a grid have the same intervals many times.
    pairs, places = np.unique(np.stack([x.middle, x.radius]), axis=1, return_inverse=True)
    ends = np.full((3, 2, pairs.shape[1]), np.nan)
    with ctx.workprec(BITS):
        for column, (middle, radius) in enumerate(pairs.T.tolist()):
            if np.isfinite(middle) and np.isfinite(radius):
                for order, found in enumerate(compute(arb(middle, radius))):
                    ends[order, :, column] = float(found.lower()), float(found.upper())
    low, high = np.nextafter(ends[:, 0], -np.inf), np.nextafter(ends[:, 1], np.inf)
    return [between(low[n][places.ravel()], high[n][places.ravel()]) for n in range(3)]


def _sin(x: Number) -> list[Number]:
    sine = numbers.sin(x)
    return [sine, numbers.cos(x), -sine]


def _cos(x: Number) -> list[Number]:
    cosine = numbers.cos(x)
    return [cosine, -numbers.sin(x), -cosine]


def _tan(x: Number) -> list[Number]:
    t, cosine = numbers.tan(x), numbers.cos(x)
    slope = 1 / (cosine * cosine)
    return [t, slope, 2 * t * slope]


def _atan(x: Number) -> list[Number]:
    # python-flint's `x**2` is NaN for a ball about 0.
    slope = 1 / (1 + x * x)
    return [numbers.atan(x), slope, -2 * x * (slope * slope)]


def _sqrt(x: Number) -> list[Number]:
    root = numbers.sqrt(x)
    return [root, 1 / (2 * root), -1 / (4 * root * x)]


def _exp(x: Number) -> list[Number]:
    return [numbers.exp(x)] * 3


def _log(x: Number) -> list[Number]:
    value = numbers.log(x)
    # Without a value there is no slope either, although 1/x is a number below 0.
    slope = 1 / x + 0 * value
    return [value, slope, -slope * slope]


def _sinh(x: Number) -> list[Number]:
    sine = numbers.sinh(x)
    return [sine, numbers.cosh(x), sine]


def _cosh(x: Number) -> list[Number]:
    cosine = numbers.cosh(x)
    return [cosine, numbers.sinh(x), cosine]


def _tanh(x: Number) -> list[Number]:
    t, cosine = numbers.tanh(x), numbers.cosh(x)
    slope = 1 / (cosine * cosine)
    return [t, slope, -2 * t * slope]


_FUNCTIONS: dict[str, Callable[[Number], list[Number]]] = {
    "sin": _sin,
    "cos": _cos,
    "tan": _tan,
    "atan": _atan,
    "sqrt": _sqrt,
    "exp": _exp,
    "log": _log,
    "sinh": _sinh,
    "cosh": _cosh,
    "tanh": _tanh,
}


def _square_above(x: Any) -> list[Any]:
    """Return max(x, 0)², its slope, and its second derivative: 0 or 2, or between at x = 0."""
    if not isinstance(x, Intervals):
        above = np.maximum(x, 0.0)
        return [above * above, 2 * above, np.where(x > 0, 2.0, 0.0)]
    # Unlike those of Python, these keep what is no number.
    above = between(np.maximum(x.low, 0.0), np.maximum(x.high, 0.0))
    low, high = np.where(x.low > 0, 2.0, 0.0), np.where(x.high > 0, 2.0, 0.0)
    unknown = np.where(np.isfinite(x.middle + x.radius), 0.0, np.nan)
    return [above.square(), near(2.0) * above, between(low + unknown, high + unknown)]


def reciprocal(x: Any) -> list[Any]:
    """Return 1/x, -1/x² and 2/x³; an interval that may contain zero has no bound."""
    if not isinstance(x, Intervals):
        inverse = 1.0 / x
        return [inverse, -inverse * inverse, 2.0 * inverse**3]
    low, high = x.low, x.high
    same_sign = (low > 0) | (high < 0)
    ends = np.where(same_sign, 1.0 / high, np.nan), np.where(same_sign, 1.0 / low, np.nan)
    bounds = _wider(*ends, 1)
    squared = bounds.square()
    return [bounds, -squared, near(2.0) * (squared * bounds)]


def power(x: Any, exponent: int) -> list[Any]:
    """Return x^n, n x^(n-1) and n (n-1) x^(n-2) for a whole number n; no numbers for a large n."""
    n, factors = exponent, (1, exponent, exponent * (exponent - 1))
    if not isinstance(x, Intervals):
        x = np.asarray(x, dtype=float)
        return [c * x ** (n - k) if c else 0 * x for k, c in enumerate(factors)]
    if abs(n) > MOST_POWER:
        return [Intervals(x.middle, np.full_like(x.middle, np.nan))] * 3
    nothing = Intervals(np.zeros_like(x.middle), np.zeros_like(x.middle))
    return [near(float(c)) * _power(x, n - k) if c else nothing for k, c in enumerate(factors)]


def _power(x: Intervals, exponent: int) -> Intervals:
    if exponent < 0:
        return _power(reciprocal(x)[0], -exponent)
    if exponent == 0:
        return Intervals(np.ones_like(x.middle), np.zeros_like(x.middle))
    low, high = x.low, x.high
    if exponent % 2 == 0:
        low, high = np.maximum(np.maximum(low, -high), 0.0), x.size
    return _wider(_product(low, exponent), _product(high, exponent), exponent)


def _product(x: Array, exponent: int) -> Array:
    found = x
    for _ in range(exponent - 1):
        found = found * x
    return found


def _wider(low: Array, high: Array, roundings: int) -> Intervals:
    """Return the intervals between bounds that were computed with some roundings."""
    share = ROUNDING * roundings
    return between(low - share * np.abs(low), high + share * np.abs(high))
