"""Numbers with their derivatives by three angles up to order 2, at many points or over many boxes.

A jet has ten rows: f, its three slopes, and its six second derivatives. For a product,

    (fg)_i = f g_i + f_i g        (fg)_ij = f g_ij + f_i g_j + f_j g_i + f_ij g,

and for a function of one number, g(f)_i = g′ f_i and g(f)_ij = g′ f_ij + g″ f_i f_j.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from rbstab.analysis.proof.lines.intervals import ROUNDING, TINY, Intervals, between
from rbstab.analysis.proof.traced.functions import function, power, reciprocal
from rbstab.integrate.straight_line.number import ADD, DIVIDE, MULTIPLY, NEGATE, POWER, SUBTRACT
from rbstab.mechanics.numbers import Array

SECOND = tuple(combinations_with_replacement(range(3), 2))
"""The axes of the second derivatives, in the order of their rows."""

ROWS = 4 + len(SECOND)

HESSIAN = np.array([[4 + SECOND.index((min(i, j), max(i, j))) for j in range(3)] for i in range(3)])
"""The rows of a jet as a matrix."""

FIRST_AXIS, SECOND_AXIS = (np.array(axes) for axes in zip(*SECOND, strict=True))

EXACT = 2.0**53
"""Whole numbers below it are doubles."""

Rows = Any
"""An array of shape (n, m), or intervals of this shape."""


class Jet:
    """f and its derivatives, each of shape (m,).

    Args:
        rows: The rows, shape (ROWS, m).
    """

    def __init__(self, rows: Rows) -> None:
        self.rows = rows

    def __add__(self, other: "Jet") -> "Jet":
        return Jet(self.rows + other.rows)

    def __neg__(self) -> "Jet":
        return Jet(-self.rows)

    def __mul__(self, other: "Jet") -> "Jet":
        return Jet(_summed(self.rows[_LEFT] * other.rows[_RIGHT]))

    def through(self, g: Sequence[Any]) -> "Jet":
        """Return g(f), from g, g′ and g″ at f."""
        f, slopes = self.rows, self.rows[1:4]
        value, first, second = (one[np.newaxis] for one in g)
        bent = first * f[4:] + second * _pairs_of(slopes)
        return Jet(_stacked([value, first * slopes, bent]))


def _pairs_of(slopes: Rows) -> Rows:
    """Return f_i f_j in the order of the second derivatives; no square is negative."""
    found = slopes[FIRST_AXIS] * slopes[SECOND_AXIS]
    if isinstance(found, Intervals):
        squares, diagonal = slopes.square(), FIRST_AXIS == SECOND_AXIS
        found.middle[diagonal], found.radius[diagonal] = squares.middle, squares.radius
    return found


def _summed(products: Rows) -> Rows:
    """Return the sums of the products that belong to one row each, at most four."""
    if not isinstance(products, Intervals):
        return np.add.reduceat(products, _BEGINS, axis=0)
    middle, radius, size = (
        np.add.reduceat(one, _BEGINS, axis=0)
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


def _factors() -> list[list[tuple[int, int]]]:
    """Return which rows of two factors are multiplied for each row of a product."""
    found = [[(0, 0)], *([(0, i), (i, 0)] for i in range(1, 4))]
    for row, (i, j) in enumerate(SECOND, start=4):
        found.append([(0, row), (1 + i, 1 + j), (1 + j, 1 + i), (row, 0)])
    return found


_LEFT = np.array([pair[0] for pairs in _factors() for pair in pairs])
_RIGHT = np.array([pair[1] for pairs in _factors() for pair in pairs])
_BEGINS = np.cumsum([0, *map(len, _factors())])[:-1]


def angle(Theta: Rows, axis: int) -> Jet:
    """Return an angle as a jet.

    Args:
        Theta: The angles, an array of shape (m, 3) or intervals of this shape.
        axis: The index of the angle.
    """
    if not isinstance(Theta, Intervals):
        return Jet(_angle(Theta[:, axis], axis, 1.0))
    rows = (_angle(Theta.middle[:, axis], axis, 1.0), _angle(Theta.radius[:, axis], axis, 0.0))
    return Jet(Intervals(*rows))


def _angle(value: Array, axis: int, slope: float) -> Array:
    rows = np.zeros((ROWS, len(value)))
    rows[0], rows[1 + axis] = value, slope
    return rows


def constant(number: float, Theta: Rows) -> Jet:
    """Return all numbers that round to a double as a jet; small whole numbers are exact."""
    is_interval = isinstance(Theta, Intervals)
    middle = np.zeros((ROWS, len(Theta.middle if is_interval else Theta)))
    middle[0] = number
    if not is_interval:
        return Jet(middle)
    radius = np.zeros_like(middle)
    radius[0] = 0.0 if number.is_integer() and abs(number) < EXACT else np.spacing(abs(number))
    return Jet(Intervals(middle, radius))


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
        reach: r, the radii, shape (3, m).
    """
    bent = over.rows.size[HESSIAN] * reach
    turned = centre.rows.radius[1:4] + bent.sum(axis=1)
    spread = (centre.rows.size[1:4] * reach).sum(axis=0) + 0.5 * (bent * reach[:, np.newaxis]).sum(
        axis=(0, 1)
    )
    radius = np.concatenate([(centre.rows.radius[0] + spread)[np.newaxis], turned])
    about = Intervals(centre.rows.middle[:4], radius * (1 + 20 * ROUNDING) + TINY)
    known = over.rows[:4]
    # Both have all values, and one of them may have no bound.
    common = between(np.fmax(known.low, about.low), np.fmin(known.high, about.high))
    return Jet(_stacked([common, over.rows[4:]]))


def gradient(jet: Jet) -> Rows:
    """Return the slopes, shape (m, 3)."""
    return _mapped(lambda rows: rows[1:4].T, jet)


def hessian(jet: Jet) -> Rows:
    """Return the second derivatives, shape (m, 3, 3)."""
    return _mapped(lambda rows: np.moveaxis(rows[HESSIAN], 2, 0), jet)


def _mapped(change: Any, jet: Jet) -> Rows:
    rows = jet.rows
    if isinstance(rows, Intervals):
        return Intervals(change(rows.middle), change(rows.radius))
    return change(rows)
