"""Intervals in doubles, rounded outwards, and numbers in doubles. An infinite end is no bound.

An array of intervals has shape (..., 2, boxes) with their lower and upper ends. One of shape
(..., 1, boxes) has doubles near numbers, which are not rounded: the same formulas hold for both.

Each operation is computed to nearest, and its ends are then moved outwards by `SLACK` of their
magnitude. This covers its own rounding, and that of a sum of up to 60 such results. Values of
transcendental functions come from python-flint, whose errors are proved.
"""

from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array

SLACK = 64 * 2.0**-53
TINY = 1e-300
"""Covers what underflows."""

PRECISION = 80
"""Bits of the numbers of python-flint that are rounded to doubles."""

MOST_KEPT = 30_000
"""Values of one function that are kept."""

SIGNS = np.array([[-1.0], [1.0]])
"""The ways in which both ends are moved."""

UNBOUNDED = SIGNS * np.inf


class Intervals:
    """Intervals with the ends lo and hi, arrays of one shape."""

    __slots__ = ("hi", "lo")

    def __init__(self, lo: Array, hi: Array) -> None:
        self.lo, self.hi = lo, hi

    @classmethod
    def of(cls, ends: Array) -> "Intervals":
        """Return those with some ends, shape (..., 2, boxes)."""
        return cls(ends[..., 0, :], ends[..., 1, :])

    @property
    def ends(self) -> Array:
        """Both ends, shape (..., 2, boxes)."""
        return np.stack([self.lo, self.hi], -2)

    def __getitem__(self, place: Any) -> "Intervals":
        return Intervals(self.lo[place], self.hi[place])

    def __mul__(self, other: "Intervals") -> "Intervals":
        return Intervals.of(product(self.ends, other.ends))

    def widened(self, below: Array | float, above: Array | float) -> "Intervals":
        """Move the lower ends down and the upper ones up."""
        return Intervals.of(outward(Intervals(self.lo - below, self.hi + above).ends))

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


def outward(x: Array, slack: float = SLACK) -> Array:
    """Move ends outwards by a share of their magnitude; what is no number becomes no bound."""
    if x.shape[-2] == 1:
        return x
    moved = np.abs(x)
    moved *= slack
    moved += TINY
    moved *= SIGNS
    moved += x
    if np.isnan(moved.sum()):  # also where infinite numbers of both signs are summed
        moved = np.where(np.isnan(moved), UNBOUNDED, moved)
    return moved


def product(a: Array, b: Array) -> Array:
    """Return ab. 0·inf counts as 0: an infinite end stands for arbitrarily large finite numbers."""
    if a.shape[-2] == 1:
        return np.asarray(a * b)
    first, second = a[..., :1, :] * b, a[..., 1:, :] * b
    low, high = np.fmin(first, second), np.fmax(first, second, out=first)
    np.fmin(low[..., 0, :], low[..., 1, :], out=second[..., 0, :])
    np.fmax(high[..., 0, :], high[..., 1, :], out=second[..., 1, :])
    return outward(second)


def negative(x: Array) -> Array:
    """Return -x."""
    return np.asarray(-x[..., ::-1, :])


@lru_cache(10_000)
def constant(c: Fraction | int) -> Array:
    """Return the doubles about a rational number, shape (2, 1)."""
    x = float(c)
    return np.full((2, 1), x) if Fraction(x) == c else np.nextafter(x, UNBOUNDED)


def root(x: Array) -> Array:
    """Return the square root of what is not negative (numpy rounds it correctly)."""
    return np.maximum(outward(np.sqrt(np.maximum(x, 0.0))), 0.0)


def monotone(name: str, x: Array) -> Array:
    """Return a rising function (`exp`, `log`, `atan`) from its values at both ends."""
    if x.shape[-2] == 1:
        return np.asarray(_NUMPY[name](x))
    return outward(values_of(name, x))


def values_of(name: str, x: Array) -> Array:
    """Return the values of a function (`sin`, ...) at doubles, each to some ulps; NaN if unbounded.

    They are kept: boxes have angles in common, and their centres are middles of sines too.
    """
    from flint import arb, ctx  # imported late: few commands make proofs

    kept = _KEPT.setdefault(name, {})
    if len(kept) > MOST_KEPT:
        # Another thread may be reading the old ones.
        kept = _KEPT[name] = {}
    different, places = np.unique(x, return_inverse=True)
    values = different.tolist()
    with ctx.workprec(PRECISION):
        for value in values:
            if value not in kept:
                ball = getattr(arb(value), name)()
                kept[value] = float(ball) if ball.is_finite() else np.nan
    function_values = np.array([kept[value] for value in values])
    return np.asarray(function_values[places].reshape(x.shape))


_KEPT: dict[str, dict[float, float]] = {}

_NUMPY = {"exp": np.exp, "log": np.log, "atan": np.arctan}


def sin_cos(x: Array) -> tuple[Array, Array]:
    """Return sine and cosine: exact to an ulp at the middles, and widened by the radii."""
    if x.shape[-2] == 1:
        return np.sin(x), np.cos(x)
    m, r = Intervals.of(x).mid, Intervals.of(x).rad
    m, r = np.where(np.isfinite(m), m, 0.0), np.where(np.isfinite(r), r, 4.0)
    s, c = values_of("sin", m), values_of("cos", m)
    return _turned(s, c, r), _turned(c, -s, r)


def _turned(f: Array, g: Array, r: Array) -> Array:
    """Bound f cos δ + g sin δ for |δ| <= r, where f² + g² = 1: its extremes, or its ends."""
    e = 2.0**-50
    small = np.minimum(r, np.pi)
    right = f * np.cos(small) + g * np.sin(small)
    left = f * np.cos(small) - g * np.sin(small)
    low, high = np.minimum(np.minimum(right, left), f), np.maximum(np.maximum(right, left), f)
    # The largest value 1 lies inside if the angle of (f, g) is within r, the least one likewise.
    angle = np.abs(np.arctan2(g, f))
    high = np.where(angle <= r + e, 1.0, high)
    low = np.where(np.pi - angle <= r + e, -1.0, low)
    return np.clip(Intervals(low, high).ends + 8 * e * SIGNS, -1.0, 1.0)


def power(x: Array, n: int) -> Array:
    """Return x^n for a whole number n, also a negative one."""
    if x.shape[-2] == 1:
        return np.asarray(x**n)
    raised = _positive_power(x, abs(n))
    return raised if n >= 0 else _reciprocal(raised)


def _positive_power(x: Array, n: int) -> Array:
    raised, even = np.ones_like(x), n % 2 == 0
    for _ in range(n):  # each product is correctly rounded
        raised = raised * x
    if n == 0:
        return raised
    if even:
        raised.sort(axis=-2)
        raised[..., 0, :][(x[..., 0, :] <= 0) & (x[..., 1, :] >= 0)] = 0.0
    raised = outward(raised, 4 * n * 2.0**-53)
    # The sign is known exactly, so that 1/x has a bound on one side where an end is zero.
    low, high = raised[..., 0, :], raised[..., 1, :]
    np.maximum(low, 0.0, out=low, where=(x[..., 0, :] >= 0) | even)
    np.minimum(high, 0.0, out=high, where=(x[..., 1, :] <= 0) & (not even))
    return raised


def _reciprocal(x: Array) -> Array:
    """Return 1/x; an end at zero gives no bound on one side, and zero inside on neither."""
    low, high = x[..., 0, :], x[..., 1, :]
    lowest = np.where((high < 0) | ((low >= 0) & (high > 0)), 1.0 / high, -np.inf)
    highest = np.where((low > 0) | ((high <= 0) & (low < 0)), 1.0 / low, np.inf)
    return outward(Intervals(lowest, highest).ends)
