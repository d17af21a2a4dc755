"""Taylor coefficients g^(k)(x)/k! of functions of one number, over intervals of it, up to k = 3."""

from fractions import Fraction
from math import factorial

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.intervals import (
    Intervals,
    constant,
    monotone,
    outward,
    power,
    product,
    root,
    scaled,
    sin_cos,
)
from rbstab.proof.exact.expr import COS, SIN


def coefficients(
    kind: str, extra: int | None, x: Intervals, order: int, least: float | None = None
) -> list[Intervals]:
    """Return bounds on g^(k)(x)/k! for k up to an order of at most 3.

    Args:
        kind: The function: `SIN`, `COS`, "power", "exp", "sqrt", "log" or "atan".
        extra: The exponent of a power.
        x: The intervals, shape (boxes,).
        order: The highest k.
        least: A known lower bound of a cosine.

    Raises:
        ValueError: The function is not known.
    """
    if kind in {SIN, COS}:
        return _sines(kind, x, order, least)
    if kind == "power":
        assert extra is not None
        return _powers(extra, x, order)
    if kind not in _OTHERS:
        raise ValueError(f"no bounds on the function {kind} are known")
    return _OTHERS[kind](x)[: order + 1]


def _sines(kind: str, x: Intervals, order: int, least: float | None) -> list[Intervals]:
    s, c = sin_cos(x)
    if least is not None:
        c = Intervals(np.maximum(c.lo, least), np.maximum(c.hi, least))
    minus_s, minus_c = (Intervals(-one.hi, -one.lo) for one in (s, c))
    turns = [s, c, minus_s, minus_c] if kind == SIN else [c, minus_s, minus_c, s]
    return [_over(turns[k], k) for k in range(order + 1)]


def _over(x: Intervals, k: int) -> Intervals:
    """Return x/k!."""
    return x if k < 2 else scaled(x, constant(Fraction(1, factorial(k))))


def _powers(n: int, x: Intervals, order: int) -> list[Intervals]:
    found, c = list[Intervals](), Fraction(1)
    for k in range(order + 1):
        zero = np.zeros_like(x.lo)
        found.append(scaled(power(x, n - k), constant(c)) if c else Intervals(zero, zero))
        c = c * (n - k) / (k + 1)
    return found


def _exp(x: Intervals) -> list[Intervals]:
    e = monotone("exp", x)
    return [_over(e, k) for k in range(4)]


def _sqrt(x: Intervals) -> list[Intervals]:
    """Return the coefficients of √x: √x, 1/(2√x), -1/(8√x³), 1/(16√x⁵)."""
    r = root(x)
    r = Intervals(np.maximum(r.lo, 0.0), r.hi)
    factors = (Fraction(1, 2), Fraction(-1, 8), Fraction(1, 16))
    powers = (power(r, -n) for n in (1, 3, 5))
    below = [scaled(p, constant(c)) for p, c in zip(powers, factors, strict=True)]
    # It has no derivative at 0.
    return [r, *(_unless(x.lo <= 0, one) for one in below)]


def _log(x: Intervals) -> list[Intervals]:
    bad = x.lo <= 0
    inside = Intervals(np.where(bad, 1.0, x.lo), np.where(bad, 1.0, x.hi))
    found = [monotone("log", inside)]
    found += [
        scaled(power(inside, -k), constant(Fraction((-1) ** (k + 1), k))) for k in range(1, 4)
    ]
    return [_unless(bad, one) for one in found]


def _atan(x: Intervals) -> list[Intervals]:
    """Return atan x, d, -x d², (3x² - 1) d³/3 with d = 1/(1 + x²)."""
    square = power(x, 2)
    d = power(outward(1 + square.lo, 1 + square.hi), -1)
    d2 = product(d, d)
    third = product(product(outward(3 * square.lo - 1, 3 * square.hi - 1), d2), d)
    return [
        monotone("atan", x),
        d,
        scaled(product(x, d2), -1.0),
        scaled(third, constant(Fraction(1, 3))),
    ]


def _unless(bad: Array, x: Intervals) -> Intervals:
    return Intervals(np.where(bad, -np.inf, x.lo), np.where(bad, np.inf, x.hi))


_OTHERS = {"exp": _exp, "sqrt": _sqrt, "log": _log, "atan": _atan}
