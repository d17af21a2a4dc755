"""Numbers with their derivatives by n variables up to order 2, at many points or over many boxes.

The variables are the three angles, and perhaps those of a position. A jet has a row for f, one for
each of its n slopes, and one for each of its n(n + 1)/2 second derivatives. For a product,

    (fg)_i = f g_i + f_i g        (fg)_ij = f g_ij + f_i g_j + f_j g_i + f_ij g,

and for a function of one number, g(f)_i = g′ f_i and g(f)_ij = g′ f_ij + g″ f_i f_j.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import combinations_with_replacement
from math import isqrt
from typing import Any

import numpy as np

from rbstab.analysis.proof.formulas.functions import function, power, reciprocal
from rbstab.analysis.proof.lines.intervals import ROUNDING, TINY, Intervals, between
from rbstab.integrate.straight_line.number import ADD, DIVIDE, MULTIPLY, NEGATE, POWER, SUBTRACT
from rbstab.mechanics.numbers import Array

EXACT = 2.0**53
"""Whole numbers below it are doubles."""

Rows = Any
"""An array of shape (n, m), or intervals of this shape."""


class Layout:
    """The rows of a jet of n variables.

    Args:
        variables: n.

    Attributes:
        rows: Their number.
        second: The axes of the second derivatives, in the order of their rows.
        hessian: The rows of the second derivatives as a matrix, shape (n, n).
        axes: Both axes of each second derivative, each of shape (n(n + 1)/2,).
    """

    def __init__(self, variables: int) -> None:
        self.variables = n = variables
        self.second = tuple(combinations_with_replacement(range(n), 2))
        self.rows = 1 + n + len(self.second)
        place = {pair: row for row, pair in enumerate(self.second, start=1 + n)}
        self.hessian = np.array([[place[min(i, j), max(i, j)] for j in range(n)] for i in range(n)])
        self.axes = tuple(np.array(axes) for axes in zip(*self.second, strict=True))
        factors = self._factors()
        # Which rows of two factors are multiplied, and where the products of each row begin.
        self.left = np.array([pair[0] for pairs in factors for pair in pairs])
        self.right = np.array([pair[1] for pairs in factors for pair in pairs])
        self.begins = np.cumsum([0, *map(len, factors)])[:-1]

    @property
    def slopes(self) -> slice:
        """The rows of the slopes."""
        return slice(1, 1 + self.variables)

    def _factors(self) -> list[list[tuple[int, int]]]:
        """Return which rows of two factors are multiplied for each row of a product."""
        found = [[(0, 0)], *([(0, i), (i, 0)] for i in range(1, 1 + self.variables))]
        for row, (i, j) in enumerate(self.second, start=1 + self.variables):
            found.append([(0, row), (1 + i, 1 + j), (1 + j, 1 + i), (row, 0)])
        return found


layout = cache(Layout)
"""The rows of a jet, from the number of its variables."""


def variables_of(rows: int) -> int:
    """Return n from the number of rows, (n + 1)(n + 2)/2."""
    return (isqrt(8 * rows + 1) - 3) // 2


class Jet:
    """f and its derivatives, each of shape (m,).

    Args:
        rows: The rows, shape (rows, m).
        constant: Whether all derivatives are zero. It only saves time.
    """

    def __init__(self, rows: Rows, *, constant: bool = False) -> None:
        self.rows, self.constant = rows, constant

    @property
    def layout(self) -> Layout:
        """Which row is what."""
        rows = self.rows
        return layout(variables_of(len(rows.middle if isinstance(rows, Intervals) else rows)))

    def __add__(self, other: "Jet") -> "Jet":
        return Jet(self.rows + other.rows)

    def __neg__(self) -> "Jet":
        return Jet(-self.rows)

    def __mul__(self, other: "Jet") -> "Jet":
        if self.constant:
            return Jet(other.rows * self.rows[:1], constant=other.constant)
        if other.constant:
            return Jet(self.rows * other.rows[:1])
        known = self.layout
        return Jet(_summed(self.rows[known.left] * other.rows[known.right], known.begins))

    def through(self, g: Sequence[Any]) -> "Jet":
        """Return g(f), from g, g′ and g″ at f."""
        known = self.layout
        slopes, bent = self.rows[known.slopes], self.rows[1 + known.variables :]
        value, first, second = (one[np.newaxis] for one in g)
        curved = first * bent + second * _pairs_of(slopes, known)
        return Jet(_stacked([value, first * slopes, curved]))


def _pairs_of(slopes: Rows, known: Layout) -> Rows:
    """Return f_i f_j in the order of the second derivatives; no square is negative."""
    first, second = known.axes
    found = slopes[first] * slopes[second]
    if isinstance(found, Intervals):
        squares, diagonal = slopes.square(), first == second
        found.middle[diagonal], found.radius[diagonal] = squares.middle, squares.radius
    return found


def _summed(products: Rows, begins: Array) -> Rows:
    """Return the sums of the products that belong to one row each, at most four."""
    if not isinstance(products, Intervals):
        return np.add.reduceat(products, begins, axis=0)
    middle, radius, size = (
        np.add.reduceat(one, begins, axis=0)
        for one in (products.middle, products.radius, np.abs(products.middle))
    )
    return Intervals(middle, (radius + ROUNDING * size) * (1 + ROUNDING) + TINY)


def _stacked(parts: Sequence[Rows]) -> Rows:
    if not isinstance(parts[0], Intervals):
        return np.concatenate(parts)
    return Intervals(
        np.concatenate([part.middle for part in parts]),
        np.concatenate([part.radius for part in parts]),
    )


def variable(values: Rows, axis: int, variables: int) -> Jet:
    """Return a variable as a jet.

    Args:
        values: Its values, an array of shape (m,) or intervals of this shape.
        axis: Its index.
        variables: The number of all variables.
    """
    if not isinstance(values, Intervals):
        return Jet(_variable(values, axis, variables, 1.0))
    rows = (
        _variable(values.middle, axis, variables, 1.0),
        _variable(values.radius, axis, variables, 0.0),
    )
    return Jet(Intervals(*rows))


def _variable(value: Array, axis: int, variables: int, slope: float) -> Array:
    rows = np.zeros((layout(variables).rows, len(value)))
    rows[0], rows[1 + axis] = value, slope
    return rows


def constant(number: float, like: Rows, variables: int) -> Jet:
    """Return all numbers that round to a double as a jet; small whole numbers are exact.

    Args:
        number: The double.
        like: The values of a variable, of which there are as many.
        variables: The number of all variables.
    """
    is_interval = isinstance(like, Intervals)
    middle = np.zeros((layout(variables).rows, len(like.middle if is_interval else like)))
    middle[0] = number
    if not is_interval:
        return Jet(middle, constant=True)
    radius = np.zeros_like(middle)
    radius[0] = 0.0 if number.is_integer() and abs(number) < EXACT else np.spacing(abs(number))
    return Jet(Intervals(middle, radius), constant=True)


def combined(kind: str, x: Jet, *others: Any) -> Jet:
    """Return the result of an operation of a program."""
    if kind in _OPERATIONS:
        return _OPERATIONS[kind](x, *others)
    return x.through(function(kind, x.rows[0]))


def _subtract(x: Jet, y: Jet) -> Jet:
    return x + -y


def _multiply(x: Jet, y: Jet) -> Jet:
    return _raise(x, 2) if x is y else x * y


def _divide(x: Jet, y: Jet) -> Jet:
    return x * y.through(reciprocal(y.rows[0]))


def _raise(x: Jet, exponent: int) -> Jet:
    return x.through(power(x.rows[0], exponent))


_OPERATIONS: Mapping[str, Callable[..., Jet]] = {
    ADD: Jet.__add__,
    SUBTRACT: _subtract,
    MULTIPLY: _multiply,
    DIVIDE: _divide,
    NEGATE: Jet.__neg__,
    POWER: _raise,
}


def tightened(over: Jet, centre: Jet, reach: Array) -> Jet:
    """Return a jet over boxes with closer bounds, by Taylor's theorem about their centres.

    f is within Σ |f_i(m)| r_i + ½ Σ |f_ij| r_i r_j of f(m), and f_i within Σ |f_ij| r_j of f_i(m),
    with f_ij over the whole box.

    Args:
        over: The jet over the boxes.
        centre: The jet at their centres.
        reach: r, the radii, shape (n, m).
    """
    if over.constant:
        return over
    known = over.layout
    n = 1 + known.variables
    bent = over.rows.size[known.hessian] * reach
    turned = centre.rows.radius[known.slopes] + bent.sum(axis=1)
    along = (centre.rows.size[known.slopes] * reach).sum(axis=0)
    spread = along + 0.5 * (bent * reach[:, np.newaxis]).sum(axis=(0, 1))
    radius = np.concatenate([(centre.rows.radius[0] + spread)[np.newaxis], turned])
    # A sum over all second derivatives has fewer roundings, each less than an eighth of ROUNDING.
    rounding = (8 + 2 * len(known.second)) * ROUNDING
    about = Intervals(centre.rows.middle[:n], radius * (1 + rounding) + TINY)
    wide = over.rows[:n]
    # Both have all values, and one of them may have no bound.
    common = between(np.fmax(wide.low, about.low), np.fmin(wide.high, about.high))
    return Jet(_stacked([common, over.rows[n:]]))


def gradient(jet: Jet) -> Rows:
    """Return the slopes, shape (m, n)."""
    return _mapped(lambda rows: rows[jet.layout.slopes].T, jet)


def hessian(jet: Jet) -> Rows:
    """Return the second derivatives, shape (m, n, n)."""
    return _mapped(lambda rows: np.moveaxis(rows[jet.layout.hessian], 2, 0), jet)


def _mapped(change: Any, jet: Jet) -> Rows:
    rows = jet.rows
    if isinstance(rows, Intervals):
        return Intervals(change(rows.middle), change(rows.radius))
    return change(rows)
