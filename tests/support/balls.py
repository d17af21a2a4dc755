"""Values and derivatives of expressions in balls of 300 bits, by series of one variable.

Derivatives come from straight lines, so nothing of the bounds that they test is needed here.
"""

from collections.abc import Mapping
from fractions import Fraction
from math import isnan
from typing import Any

import numpy as np
from flint import arb, arb_mat, arb_series, ctx, fmpq

from rbstab.proof.exact.atoms import INNER, LET, OF, POSITIVE, STEP, VAR
from rbstab.proof.exact.expr import Expr

BITS = 300

Point = Mapping[int, Any]
"""The values of variables: balls."""


def ball(x):
    """Return a number as a ball."""
    if isinstance(x, Fraction):
        return arb(fmpq(x.numerator, x.denominator))
    return x if isinstance(x, arb) else arb(x)


def arbs(numbers):
    """Return an array of doubles as exact balls of radius 0."""
    flat = [arb(number) for number in np.ravel(numbers).tolist()]
    return np.array([*flat, None], dtype=object)[:-1].reshape(np.shape(numbers))


def series(e, given, length):
    """Return the series of an expression in t, where the variables are series in t."""
    total = arb_series([0], length)
    for m, c in e.terms.items():
        term = arb_series([ball(c)], length)
        for a, p in m:
            factor = _atom(a, given, length)
            for _ in range(abs(p)):
                term = term * factor if p > 0 else term / factor
        total += term
    return total


def _atom(a, given, length):
    if a.kind == VAR:
        return given[a.argument]
    x = series(a.inner, given, length)
    if a.kind == LET:
        return x
    if a.kind == OF:
        assert isinstance(a.extra, Expr)
        return series(a.extra, {INNER: x}, length)
    if a.kind in {STEP, POSITIVE}:
        value = arb(x[0])
        if not (value > 0 or value <= 0):
            raise ValueError("a step whose side is not known")
        if a.kind == POSITIVE:
            return x if value > 0 else arb_series([0], length)
        return arb_series([int(value > 0)], length)
    return getattr(x, a.kind)()


def along(e, point, direction, length):
    """Return the coefficients of e(point + t direction) in t."""
    with ctx.workprec(BITS):
        lines = {
            k: arb_series([ball(x), arb(direction.get(k, 0))], length) for k, x in point.items()
        }
        coefficients = series(e, lines, length)
        return [coefficients[k] for k in range(length)]


def value(e, point):
    """Return the value of an expression at a point."""
    return along(e, point, {}, 1)[0]


def gradient(e, point, numbers):
    """Return its derivatives by some variables."""
    return [along(e, point, {k: 1}, 2)[1] for k in numbers]


def hessian(e, point, numbers):
    """Return its second derivatives: those of e along i, j and i + j."""
    with ctx.workprec(BITS):
        single = {k: along(e, point, {k: 1}, 3)[2] for k in numbers}
        return [
            [
                2 * single[i]
                if i == j
                else along(e, point, {i: 1, j: 1}, 3)[2] - single[i] - single[j]
                for j in numbers
            ]
            for i in numbers
        ]


def lowest(e, point, free):
    """Return the point with the variables `free` where e is least, by Newton's method."""
    place = {k: ball(x) for k, x in point.items()} | {k: arb(0) for k in free}
    with ctx.workprec(BITS):
        for _ in range(200):
            g = gradient(e, place, free)
            step = arb_mat(hessian(e, place, free)).solve(arb_mat([[x] for x in g]))
            longest = max(abs(float(step[i, 0])) for i in range(len(free)))
            cut = min(1.0, 0.5 / max(longest, 1e-300))
            for i, k in enumerate(free):
                place[k] = (place[k] - cut * step[i, 0]).mid()
            if longest < 1e-70:
                return place
    raise ValueError("the lowest point is not found")


def reduced(e, point, numbers, free):
    """Return V = min e over `free`, ∇V and ∇²V = e_aa - e_ab e_bb⁻¹ e_ba."""
    at = lowest(e, point, free) if free else point
    derivatives = value(e, at), gradient(e, at, numbers), hessian(e, at, numbers)
    if not free:
        return derivatives
    with ctx.workprec(BITS):
        H = hessian(e, at, [*numbers, *free])
        n = len(numbers)
        cross = arb_mat([row[n:] for row in H[:n]])
        schur = cross * arb_mat([row[n:] for row in H[n:]]).solve(cross.transpose())
        reduced_hessian = [[H[i][j] - schur[i, j] for j in range(n)] for i in range(n)]
    return derivatives[0], derivatives[1], reduced_hessian


def contains(x, place, exact):
    """Return whether an interval of an array contains what is known to a ball."""
    low, high = float(x.lo[place]), float(x.hi[place])
    if isnan(low) or isnan(high):
        return False
    with ctx.workprec(BITS):
        tiny = arb(2) ** -200  # of the ball itself, which may be at an end
        above = low == float("-inf") or exact - arb(low) > -tiny
        below = high == float("inf") or arb(high) - exact > -tiny
    return bool(above and below)
