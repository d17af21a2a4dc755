"""Taylor series of order 2 in balls: products of series, and functions of them.

A series has the coefficients f, ∂f/∂x_i and ∂²f/∂x_i∂x_j (half of it if i = j), by the sorted
numbers of their variables: (), (i,), (i, j). One that is not there is zero at all points, also
where others have no bound.
"""

from collections.abc import Iterable, Mapping, Sequence
from math import comb
from typing import Any

from flint import arb

Ball = Any
"""An `arb` of python-flint, which has no types."""

Series = dict[tuple[int, ...], Ball]

ORDER = 2

UNKNOWN = arb("nan")
"""A ball that is compared with nothing: the coefficient has no bound."""


def leaf(i: int, x: Ball) -> Series:
    """Return the series of a variable with a value."""
    return {(): x, (i,): arb(1)}


def unknown(numbers: Iterable[int]) -> dict[int, Series]:
    """Return series of variables without a bound."""
    return {k: {(): UNKNOWN} for k in numbers}


def constant(x: Series) -> Ball:
    """Return the value of a series."""
    return x.get((), arb(0))


def derivative(x: Series, *axes: int) -> Ball:
    """Return the derivative of a series by one or two variables."""
    coefficient = x.get(tuple(sorted(axes)), arb(0))
    return 2 * coefficient if len(axes) == 2 and axes[0] == axes[1] else coefficient


def summed(terms: Iterable[tuple[Ball, Series]]) -> Series:
    """Return the sum of series with factors."""
    total: Series = {}
    for c, x in terms:
        for k, v in x.items():
            total[k] = total[k] + c * v if k in total else c * v
    return total


def times(x: Series, y: Series, order: int) -> Series:
    """Return the product of two series up to an order.

    Args:
        x: The first series.
        y: The second series.
        order: The highest order of the product.
    """
    product: Series = {}
    for i, v in x.items():
        room = order - len(i)
        for j, w in y.items():
            if len(j) <= room:
                k = i + j if i <= j else j + i
                p = v * w
                product[k] = product[k] + p if k in product else p
    return product


def through(g: Sequence[Ball], x: Series, order: int) -> Series:
    """Return g(x), from the Taylor coefficients of g at the value of x.

    Args:
        g: g, g' and g''/2 at the value of x.
        x: The series.
        order: The highest order of g(x): 1, or `ORDER`.
    """
    u = {k: v for k, v in x.items() if k}
    bend = times(u, u, order) if order == ORDER else {}
    return {**summed([(g[1], u), (g[2], bend)]), (): g[0]}


def over_box(x: Series, at: Series, steps: Mapping[int, Ball]) -> Ball:
    """Return f over a box by Taylor's theorem, from its series over it and at its middle.

    Args:
        x: Its series over the box.
        at: Its series at the middle.
        steps: The ways δ from the middle, by the numbers of the variables.
    """
    total = constant(at)
    for k, c in at.items():
        if len(k) == 1:
            total += c * steps[k[0]]
    for k, c in x.items():
        if len(k) == ORDER:
            i, j = (steps[n] for n in k)
            total += c * (whole_power(i, 2) if k[0] == k[1] else i * j)
    return total


def narrower(x: Ball, y: Ball) -> Ball:
    """Return the narrower one of two balls with one number in both."""
    return y if y.is_finite() and not y.rad() > x.rad() else x


def coefficients(kind: str, v: Ball, power: int = 0) -> list[Ball]:
    """Return g(v), g'(v) and g''(v)/2 of a function.

    Args:
        kind: The name of the function: `sin`, ..., or `pow`.
        v: Its argument.
        power: The exponent of `pow`.
    """
    match kind:
        case "sin" | "cos":
            s, c = v.sin_cos()
            return [s, c, -s / 2] if kind == "sin" else [c, -s, -c / 2]
        case "exp":
            e = v.exp()
            return [e, e, e / 2]
        case "sqrt":
            r = v.sqrt()
            return [r, 1 / (2 * r), -1 / (8 * r * v)]
        case "log":
            return [v.log(), 1 / v, -1 / (2 * v * v)]
        case "atan":
            d = 1 / (1 + v * v)
            return [v.atan(), d, -v * d * d]
    assert kind == "pow"
    n = power
    factors = [comb(n, k) if n >= 0 else (-1) ** k * comb(k - n - 1, k) for k in range(ORDER + 1)]
    return [c * whole_power(v, n - k) if c else arb(0) for k, c in enumerate(factors)]


def whole_power(v: Ball, n: int) -> Ball:
    """Return a whole power of a ball; an even one is not negative."""
    if n < 0:
        return 1 / whole_power(v, -n)
    if n < 2:
        return v if n else arb(1)
    if n % 2:
        return v * whole_power(v, n - 1)
    half = whole_power(v, n // 2)
    square = half * half
    if square > 0:
        return square
    return arb(square.abs_upper() / 2, square.abs_upper() / 2)
