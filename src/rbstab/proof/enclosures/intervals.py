"""Arrays of intervals [lo, hi] in doubles, rounded outwards. An infinite end is no bound.

Each operation is computed to nearest, and its ends are then moved outwards by `SLACK` of their
magnitude. This covers its own rounding, and that of a sum of up to 60 such results. Values of
transcendental functions come from python-flint, whose errors are proved.
"""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array

SLACK = 64 * 2.0**-53
TINY = 1e-300
"""Covers what underflows."""

PRECISION = 80
"""Bits of the numbers of python-flint that are rounded to doubles."""


class Intervals:
    """Intervals with the ends lo and hi, arrays of one shape."""

    __slots__ = ("hi", "lo")

    def __init__(self, lo: Array, hi: Array) -> None:
        self.lo, self.hi = lo, hi

    def __getitem__(self, place: Any) -> "Intervals":
        return Intervals(self.lo[place], self.hi[place])

    @property
    def mid(self) -> Array:
        """A double near the middle of each."""
        with np.errstate(all="ignore"):
            return np.asarray(0.5 * self.lo + 0.5 * self.hi)

    @property
    def rad(self) -> Array:
        """A radius about `mid` that reaches both ends."""
        with np.errstate(all="ignore"):
            m = self.mid
            return np.maximum(self.hi - m, m - self.lo) * (1 + SLACK) + TINY

    @property
    def mag(self) -> Array:
        """The largest magnitude in each."""
        return np.maximum(np.abs(self.lo), np.abs(self.hi))


def outward(lo: Array, hi: Array, slack: float = SLACK) -> Intervals:
    """Move ends outwards by a share of their magnitude; what is no number becomes no bound."""
    low, high = np.asarray(_moved(np.subtract, lo, slack)), np.asarray(_moved(np.add, hi, slack))
    if np.isnan(low.sum() + high.sum()):  # also where infinite numbers of both signs are summed
        low = np.where(np.isnan(low), -np.inf, low)
        high = np.where(np.isnan(high), np.inf, high)
    return Intervals(low, high)


def _moved(way: np.ufunc, x: Array, slack: float) -> Array:
    size = np.abs(x)
    size *= slack
    size += TINY
    return np.asarray(way(x, size, out=size if isinstance(size, np.ndarray) else None))


def product(a: Intervals, b: Intervals) -> Intervals:
    """Return ab. 0·inf counts as 0: an infinite end stands for arbitrarily large finite numbers."""
    one, two = a.lo * b.lo, a.lo * b.hi
    low, high = np.fmin(one, two), np.fmax(one, two, out=one)
    for end in (b.lo, b.hi):
        np.multiply(a.hi, end, out=two)
        np.fmin(low, two, out=low)
        np.fmax(high, two, out=high)
    return outward(low, high)


def scaled(x: Intervals, factor: Intervals | float) -> Intervals:
    """Return the product with one number, which may be known to an interval alone."""
    if isinstance(factor, Intervals):
        if factor.lo != factor.hi:
            shape = np.shape(x.lo)
            return product(
                Intervals(np.broadcast_to(factor.lo, shape), np.broadcast_to(factor.hi, shape)), x
            )
        factor = float(factor.lo)
    ends = (factor * x.lo, factor * x.hi)
    return outward(*(ends if factor >= 0 else ends[::-1]))


def met(a: Intervals, b: Intervals) -> Intervals:
    """Return what is in both."""
    return Intervals(np.fmax(a.lo, b.lo), np.fmin(a.hi, b.hi))


def constant(c: Fraction | int) -> Intervals:
    """Return the doubles about a rational number."""
    x = float(c)
    exact = Fraction(x) == c
    low, high = (x, x) if exact else (np.nextafter(x, -np.inf), np.nextafter(x, np.inf))
    return Intervals(np.asarray(low), np.asarray(high))


def root(x: Intervals) -> Intervals:
    """Return the square root of what is not negative (numpy rounds it correctly)."""
    return outward(np.sqrt(np.maximum(x.lo, 0.0)), np.sqrt(np.maximum(x.hi, 0.0)))


def monotone(name: str, x: Intervals) -> Intervals:
    """Return a rising function (`exp`, `log`, `atan`) from its values at both ends."""
    ends = values_of(np.stack([x.lo, x.hi]), lambda ball: getattr(ball, name)())
    return outward(ends[0], ends[1])


def values_of(x: Array, function: Callable[[Any], Any]) -> Array:
    """Return the values of a function of a ball at doubles, each to some ulps; NaN if unbounded."""
    from flint import arb, ctx  # imported late: few commands make proofs

    different, places = np.unique(x, return_inverse=True)
    found = np.full(different.shape, np.nan)
    with ctx.workprec(PRECISION):
        for k, value in enumerate(different.tolist()):
            ball = function(arb(value))
            if ball.is_finite():
                found[k] = float(ball)
    return np.asarray(found[places].reshape(x.shape))


def sin_cos(x: Intervals) -> tuple[Intervals, Intervals]:
    """Return sine and cosine: exact to an ulp at the middles, and widened by the radii."""
    m = np.where(np.isfinite(x.mid), x.mid, 0.0)
    r = np.where(np.isfinite(x.rad), x.rad, 4.0)
    s, c = values_of(m, lambda ball: ball.sin()), values_of(m, lambda ball: ball.cos())
    return _turned(s, c, r), _turned(c, -s, r)


def _turned(f: Array, g: Array, r: Array) -> Intervals:
    """Bound f cos δ + g sin δ for |δ| <= r, where f² + g² = 1: its extremes, or its ends."""
    e = 2.0**-50
    small = np.minimum(r, np.pi)
    one = f * np.cos(small) + g * np.sin(small)
    two = f * np.cos(small) - g * np.sin(small)
    low, high = np.minimum(np.minimum(one, two), f), np.maximum(np.maximum(one, two), f)
    # The largest value 1 lies inside if the angle of (f, g) is within r, the least one likewise.
    angle = np.abs(np.arctan2(g, f))
    high = np.where(angle <= r + e, 1.0, high)
    low = np.where(np.pi - angle <= r + e, -1.0, low)
    return Intervals(np.maximum(low - 8 * e, -1.0), np.minimum(high + 8 * e, 1.0))


def power(x: Intervals, n: int) -> Intervals:
    """Return x^n for a whole number n, also a negative one."""
    with np.errstate(all="ignore"):
        found = _positive_power(x, abs(n))
        return found if n >= 0 else _reciprocal(found)


def _positive_power(x: Intervals, n: int) -> Intervals:
    a, b = np.ones_like(x.lo), np.ones_like(x.hi)
    for _ in range(n):  # each product is correctly rounded
        a, b = a * x.lo, b * x.hi
    if n == 0:
        return Intervals(a, b)
    if n % 2 == 0:
        crossing = (x.lo <= 0) & (x.hi >= 0)
        a, b = np.where(crossing, 0.0, np.minimum(a, b)), np.maximum(a, b)
    found = outward(a, b, 4 * n * 2.0**-53)
    # The sign is known exactly, so that 1/x has a bound on one side where an end is zero.
    low = np.where((x.lo >= 0) | (n % 2 == 0), np.maximum(found.lo, 0.0), found.lo)
    high = np.where((x.hi <= 0) & (n % 2 == 1), np.minimum(found.hi, 0.0), found.hi)
    return Intervals(low, high)


def _reciprocal(x: Intervals) -> Intervals:
    """Return 1/x; an end at zero gives no bound on one side, and zero inside on neither."""
    positive, negative = x.lo >= 0, x.hi <= 0
    low = np.where(positive, 1.0 / x.hi, np.where(negative & (x.hi < 0), 1.0 / x.hi, -np.inf))
    high = np.where(negative, 1.0 / x.lo, np.where(positive & (x.lo > 0), 1.0 / x.lo, np.inf))
    none = positive & negative
    return outward(np.where(none, -np.inf, low), np.where(none, np.inf, high))
