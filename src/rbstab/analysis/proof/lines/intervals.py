"""Arrays of intervals, as middles and radii in doubles; each result contains all exact results.

An operation on doubles has a relative error of at most u = 2⁻⁵³, or of at most the least double
where it underflows. A radius is the sum of a few magnitudes, so it is widened by `ROUNDING` of
itself, of the middle, and by `TINY`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.proof.trigonometric import Derivatives

ROUNDING = 1e-15
"""More than eight roundings of one sum of magnitudes: 8 u is below 9e-16."""

TINY = 1e-300
"""More than underflow can take away from a result."""


@dataclass(frozen=True, eq=False)
class Intervals:
    """All numbers within a radius of a middle, entry by entry; both arrays have the same shape.

    An entry that is no number, or infinite, has no bound: comparisons with it must be false.
    """

    middle: Array
    radius: Array

    @property
    def low(self) -> Array:
        """Lower bounds."""
        return np.nextafter(self.middle - self.radius, -np.inf)

    @property
    def high(self) -> Array:
        """Upper bounds."""
        return np.nextafter(self.middle + self.radius, np.inf)

    @property
    def size(self) -> Array:
        """Upper bounds of the magnitudes."""
        return (np.abs(self.middle) + self.radius) * (1 + ROUNDING)

    def __getitem__(self, place: Any) -> "Intervals":
        return Intervals(self.middle[place], self.radius[place])

    def __add__(self, other: "Intervals") -> "Intervals":
        return _wider(self.middle + other.middle, self.radius + other.radius)

    def __mul__(self, other: "Intervals") -> "Intervals":
        a, b = np.abs(self.middle), np.abs(other.middle)
        radius = a * other.radius + self.radius * b + self.radius * other.radius
        return _wider(self.middle * other.middle, radius)

    def __neg__(self) -> "Intervals":
        return Intervals(-self.middle, self.radius)

    def square(self) -> "Intervals":
        """Return x²: no number below zero."""
        most = self.size
        least = np.maximum(np.maximum(self.low, -self.high), 0.0)
        return between(least * least * (1 - ROUNDING), most * most * (1 + ROUNDING))

    def sum(self, axis: int) -> "Intervals":
        """Return the sum along an axis of at most six entries."""
        rounding = ROUNDING * np.abs(self.middle).sum(axis)
        return _wider(self.middle.sum(axis), self.radius.sum(axis) + rounding)

    def negative_power(self, exponent: int) -> "Intervals":
        """Return x^(-exponent/2) of positive numbers x; an entry that may be zero has no bound.

        Args:
            exponent: From 1 to 5.
        """
        low, high = self.low, self.high
        # Up to five factors with two roundings each, and the roundings of their product.
        most = _product([np.where(low > 0, 1.0 / np.sqrt(low), np.inf)] * exponent)
        least = _product([1.0 / np.sqrt(high)] * exponent)
        return between(least * (1 - 2 * ROUNDING), most * (1 + 2 * ROUNDING))

    def root(self) -> "Intervals":
        """Return √x; where numbers below zero are in x, of the others alone."""
        low, high = np.sqrt(np.maximum(self.low, 0.0)), np.sqrt(self.high)
        return between(low * (1 - ROUNDING), high * (1 + ROUNDING))


def between(low: Array, high: Array) -> Intervals:
    """Return the intervals between bounds."""
    middle = 0.5 * low + 0.5 * high
    return _wider(middle, np.maximum(high - middle, middle - low))


def near(number: float) -> Intervals:
    """Return the interval of all numbers that round to a double, of shape ()."""
    return _wider(np.array(number), np.array(0.0))


def exact(numbers: Array) -> Intervals:
    """Return the intervals of numbers that are exact."""
    return Intervals(numbers, np.zeros_like(numbers))


def rounded(numbers: Array) -> Intervals:
    """Return the intervals of all numbers that round to doubles."""
    return Intervals(numbers, ROUNDING * np.abs(numbers))


def known(found: "Derivatives") -> Intervals:
    """Return derivatives at points with their errors as intervals."""
    return Intervals(found.values, np.broadcast_to(found.error, found.values.shape))


def stacked(parts: Sequence[Intervals]) -> Intervals:
    """Return intervals of shape (m, ...) along a new second axis, shape (m, parts, ...)."""
    return Intervals(
        np.stack([part.middle for part in parts], axis=1),
        np.stack([part.radius for part in parts], axis=1),
    )


def total(parts: Sequence[Intervals]) -> Intervals:
    """Return the sum of some intervals; there must be one at least."""
    first, *others = parts
    for part in others:
        first = first + part
    return first


def _product(factors: Sequence[Array]) -> Array:
    found = factors[0]
    for factor in factors[1:]:
        found = found * factor
    return found


def _wider(middle: Array, radius: Array) -> Intervals:
    """Widen computed results by the roundings of their computation."""
    return Intervals(middle, (radius + ROUNDING * np.abs(middle)) * (1 + ROUNDING) + TINY)
