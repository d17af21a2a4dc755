"""Taylor coefficients in balls: products of series, and functions of them.

A series has the coefficients f_α = ∂^α f/α! for |α| up to 3, by the number of α. One that is not
there is zero at all points, also where others have no bound.
"""

from collections.abc import Sequence
from functools import cache
from itertools import product
from math import comb, factorial, prod
from operator import add
from typing import Any

from flint import arb

Ball = Any
"""An `arb` of python-flint, which has no types."""

Series = dict[int, Ball]

ORDER = 3

UNKNOWN = arb("nan")
"""A ball that is compared with nothing: the coefficient has no bound."""


class Rows:
    """The numbers of the multi-indices α of some variables, lower orders first.

    Args:
        n: The number of variables.
        order: The highest order. Rows of a lower order have the same numbers.
    """

    def __init__(self, n: int, order: int = ORDER) -> None:
        rows = [a for a in product(range(order + 1), repeat=n) if sum(a) <= order]
        self.order, self.rows = order, sorted(rows, key=lambda a: (sum(a), a))
        place = {a: k for k, a in enumerate(self.rows)}
        # The product of two coefficients belongs to the sum of their multi-indices.
        self.sums = [
            {j: place[s] for j, b in enumerate(self.rows) if (s := tuple(map(add, a, b))) in place}
            for a in self.rows
        ]
        # For each list of variables the row of their derivative, and its factorials.
        self._places = dict[tuple[int, ...], tuple[int, int]]()
        for axes in (axes for k in range(1, order + 1) for axes in product(range(n), repeat=k)):
            row = tuple(axes.count(i) for i in range(n))
            self._places[axes] = place[row], prod(map(factorial, row))
        self.first = [self._places[(i,)][0] for i in range(n)]

    def derivative(self, x: Series, *axes: int) -> Ball:
        """Return the derivative of a series by some variables."""
        row, factor = self._places[axes]
        return x[row] * factor if row in x else arb(0)

    def leaf(self, i: int, x: Ball) -> Series:
        """Return the series of a variable with a value."""
        return {0: x, self.first[i]: arb(1)}

    def times(self, x: Series, y: Series) -> Series:
        """Return the product of two series."""
        found: Series = {}
        for i, v in x.items():
            sums = self.sums[i]
            for j, w in y.items():
                k = sums.get(j)
                if k is not None:
                    p = v * w
                    found[k] = found[k] + p if k in found else p
        return found

    def through(self, g: Sequence[Ball], x: Series) -> Series:
        """Return g(x), from the Taylor coefficients of g at the value of x."""
        u = {k: v for k, v in x.items() if k}
        found, power = {0: g[0]}, u
        for k in range(1, self.order + 1):
            for i, v in power.items():
                found[i] = found[i] + g[k] * v if i in found else g[k] * v
            if k < self.order:
                power = self.times(power, u)
        return found

    def value(self, x: Series, at: Series, steps: Sequence[Ball]) -> Ball:
        """Return f over a box by Taylor's theorem, from its series over it and at its middle."""
        total, zero, n = at.get(0, arb(0)), arb(0), range(len(steps))
        for i in n:
            total += at.get(self.first[i], zero) * steps[i]
            for j in range(i, len(steps)):
                c = x.get(self._places[i, j][0])
                if c is not None:
                    total += c * (whole_power(steps[i], 2) if i == j else steps[i] * steps[j])
        return total


rows_of = cache(Rows)


def narrower(x: Ball, y: Ball) -> Ball:
    """Return the narrower one of two balls with one number in both."""
    return y if y.is_finite() and not y.rad() > x.rad() else x


def coefficients(kind: str, v: Ball, power: int = 0) -> list[Ball]:
    """Return g(v), g'(v), g''(v)/2 and g'''(v)/6 of a function."""
    if kind in ("sin", "cos"):
        s, c = v.sin_cos()
        return [s, c, -s / 2, -c / 6] if kind == "sin" else [c, -s, -c / 2, s / 6]
    if kind == "exp":
        e = v.exp()
        return [e, e, e / 2, e / 6]
    if kind == "sqrt":
        r = v.sqrt()
        return [r, 1 / (2 * r), -1 / (8 * r * v), 1 / (16 * r * v * v)]
    if kind == "log":
        return [v.log(), 1 / v, -1 / (2 * v * v), 1 / (3 * v * v * v)]
    if kind == "atan":
        d = 1 / (1 + v * v)
        return [v.atan(), d, -v * d * d, (3 * v * v - 1) * d * d * d / 3]
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
