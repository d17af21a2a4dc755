"""Taylor coefficients g^(k)(x)/k! of functions of one number, over intervals of it, up to k = 3."""

from fractions import Fraction
from math import factorial

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.intervals import (
    UNBOUNDED,
    constant,
    monotone,
    negative,
    outward,
    power,
    product,
    root,
    sin_cos,
)
from rbstab.proof.exact.atoms import COS, SIN


def coefficients(
    kind: str, extra: int | None, x: Array, order: int, least: float | None = None
) -> list[Array]:
    """Return bounds on g^(k)(x)/k! for k up to an order of at most 3.

    Args:
        kind: The function: `SIN`, `COS`, "power", "exp", "sqrt", "log" or "atan".
        extra: The exponent of a power.
        x: The intervals, shape (2, boxes), or numbers, shape (1, points).
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


def _sines(kind: str, x: Array, order: int, least: float | None) -> list[Array]:
    s, c = sin_cos(x)
    if least is not None:
        c = np.maximum(c, least)
    turns = [s, c, negative(s), negative(c)]
    first = int(kind == COS)
    return [_times(turns[(first + k) % 4], Fraction(1, factorial(k))) for k in range(order + 1)]


def _times(x: Array, c: Fraction | int) -> Array:
    return x if c == 1 else product(x, constant(c)[: len(x)])


def _powers(n: int, x: Array, order: int) -> list[Array]:
    powers, c = list[Array](), 1
    for k in range(order + 1):
        powers.append(_times(power(x, n - k), c) if c else np.zeros_like(x))
        c = c * (n - k) // (k + 1)  # exactly
    return powers


def _exp(x: Array) -> list[Array]:
    e = monotone("exp", x)
    return [_times(e, Fraction(1, factorial(k))) for k in range(4)]


def _sqrt(x: Array) -> list[Array]:
    """Return the coefficients of √x: √x, 1/(2√x), -1/(8√x³), 1/(16√x⁵)."""
    r = root(x)
    factors = (Fraction(1, 2), Fraction(-1, 8), Fraction(1, 16))
    below = [_times(power(r, -n), c) for n, c in zip((1, 3, 5), factors, strict=True)]
    # It has no derivative at 0.
    return [r, *(np.where(x[0] <= 0, UNBOUNDED[: len(x)], coefficient) for coefficient in below)]


def _log(x: Array) -> list[Array]:
    bad = x[0] <= 0
    inside = np.where(bad, 1.0, x)
    powers = [_times(power(inside, -k), Fraction((-1) ** (k + 1), k)) for k in range(1, 4)]
    return [
        np.where(bad, UNBOUNDED[: len(x)], coefficient)
        for coefficient in (monotone("log", inside), *powers)
    ]


def _atan(x: Array) -> list[Array]:
    """Return atan x, d, -x d², (3x² - 1) d³/3 with d = 1/(1 + x²)."""
    square = power(x, 2)
    d = power(outward(1 + square), -1)
    d2 = product(d, d)
    third = product(product(outward(3 * square - 1), d2), d)
    return [monotone("atan", x), d, negative(product(x, d2)), _times(third, Fraction(1, 3))]


_OTHERS = {"exp": _exp, "sqrt": _sqrt, "log": _log, "atan": _atan}
