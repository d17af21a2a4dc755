"""Taylor polynomials of order 2 in some variables, in balls.

A polynomial is a dictionary of its coefficients by the variables of their terms, in rising order:
() for the constant, (0,) for the first variable, (0, 1) for the product of two. Those that are left
out are zero. So a sine of one angle has three.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache

from flint import arb

from rbstab.analysis.proof_check.trigonometric import Ball

ORDER = 2

Term = tuple[int, ...]
"""The variables of a term."""

Series = dict[Term, Ball]

Coefficients = tuple[Ball, Ball, Ball]
"""Those of a function of one number, of order 0 to 2."""

ZERO: Term = ()

Shape = frozenset[Term]


def variable(ball: Ball, axis: int) -> Series:
    """Return a variable."""
    return {ZERO: ball, (axis,): arb(1)}


def added(f: Series, g: Series, sign: int = 1) -> Series:
    """Return f + g or f - g."""
    found = dict(f)
    for term, value in g.items():
        if term in found:
            found[term] = found[term] + sign * value
        else:
            found[term] = sign * value
    return found


def scaled(f: Series, factor: Ball) -> Series:
    """Return a multiple of f."""
    return {term: factor * value for term, value in f.items()}


def product(f: Series, g: Series) -> Series:
    """Return f g."""
    found: Series = {}
    for one, two, both in _pairs(frozenset(f), frozenset(g)):
        value = f[one] * g[two]
        found[both] = found[both] + value if both in found else value
    return found


@lru_cache(10_000)
def _pairs(f: Shape, g: Shape) -> list[tuple[Term, Term, Term]]:
    """Return which coefficients of two polynomials are multiplied, and for which of the product."""
    pairs = ((one, two, tuple(sorted(one + two))) for one in f for two in g)
    return [triple for triple in pairs if len(triple[2]) <= ORDER]


def through(g: Coefficients, f: Series) -> Series:
    """Return g(f), from the Taylor coefficients g, g′ and g″/2 of g at the value of f."""
    step = {term: value for term, value in f.items() if term != ZERO}
    square = product(step, step)
    for i, j in square:
        if i == j:
            square[i, j] = square[i, j].nonnegative_part()
    return added({ZERO: g[0]}, added(scaled(step, g[1]), scaled(square, g[2])))


def closer(wide: Series, middle: Series, step: tuple[Ball, ...]) -> Series:
    """Return bounds over a box that are also those about its middle, by the mean value theorem.

    Args:
        wide: A polynomial over a box.
        middle: That at its middle.
        step: The balls of y - m, for each variable.
    """
    found = dict(wide)
    for term in sorted(wide, key=len, reverse=True):
        if len(term) == ORDER:
            continue
        about = middle.get(term, arb(0))
        for axis, ball in enumerate(step):
            higher = tuple(sorted((*term, axis)))
            if higher in found:
                about = about + higher.count(axis) * found[higher] * ball
        found[term] = _common(found[term], about)
    return found


def _common(one: Ball, two: Ball) -> Ball:
    """Return a ball with all numbers that are in both; one may be no number."""
    if not one.is_finite():
        return two
    return one.intersection(two) if two.is_finite() and one.overlaps(two) else one


def slope(f: Series, axis: int) -> Ball:
    """Return the derivative along an axis."""
    return f.get((axis,), arb(0))


def curvature(f: Series, i: int, j: int) -> Ball:
    """Return the second derivative along two axes."""
    return f.get((min(i, j), max(i, j)), arb(0)) * (2 if i == j else 1)


def _sin(x: Ball) -> Coefficients:
    sine, cosine = x.sin_cos()
    return sine, cosine, -sine / 2


def _cos(x: Ball) -> Coefficients:
    sine, cosine = x.sin_cos()
    return cosine, -sine, -cosine / 2


def _tan(x: Ball) -> Coefficients:
    t, cosine = x.tan(), x.cos()
    slope = 1 / (cosine * cosine)
    return t, slope, t * slope


def _atan(x: Ball) -> Coefficients:
    slope = 1 / (1 + x * x)
    return x.atan(), slope, -x * (slope * slope)


def _sqrt(x: Ball) -> Coefficients:
    root = x.sqrt()
    return root, 1 / (2 * root), -1 / (8 * root * x)


def _exp(x: Ball) -> Coefficients:
    e = x.exp()
    return e, e, e / 2


def _log(x: Ball) -> Coefficients:
    value = x.log()
    # Without a value there is no slope either, although 1/x is a number below 0.
    slope = 1 / x + 0 * value
    return value, slope, -slope * slope / 2


def _sinh(x: Ball) -> Coefficients:
    sine, cosine = x.sinh(), x.cosh()
    return sine, cosine, sine / 2


def _cosh(x: Ball) -> Coefficients:
    sine, cosine = x.sinh(), x.cosh()
    return cosine, sine, cosine / 2


def _tanh(x: Ball) -> Coefficients:
    t, cosine = x.tanh(), x.cosh()
    slope = 1 / (cosine * cosine)
    return t, slope, -t * slope


def _square_above(x: Ball) -> Coefficients:
    """max(x, 0)²: its slope is continuous, and its second derivative 0 or 2, or between at 0."""
    if not x.is_finite():
        return arb("nan"), arb("nan"), arb("nan")
    if x > 0:
        return x * x, 2 * x, arb(1)
    if x <= 0:
        return arb(0), arb(0), arb(0)
    above = x.max(arb(0))
    return (above * above).nonnegative_part(), 2 * above, arb(0.5, 0.5)


FUNCTIONS: Mapping[str, Callable[[Ball], Coefficients]] = {
    "sin": _sin,
    "cos": _cos,
    "tan": _tan,
    "atan": _atan,
    "sqrt": _sqrt,
    "exp": _exp,
    "log": _log,
    "sinh": _sinh,
    "cosh": _cosh,
    "tanh": _tanh,
    "square_above": _square_above,
}
"""The Taylor coefficients of functions at a number."""


def power(x: Ball, exponent: int) -> Coefficients:
    """Return the Taylor coefficients of x^n, for a whole number n."""
    n, factors = exponent, (1, exponent, exponent * (exponent - 1) // 2)
    first, second, third = (
        factor * _power(x, n - k) if factor else arb(0) for k, factor in enumerate(factors)
    )
    return first, second, third


def _power(x: Ball, exponent: int) -> Ball:
    if exponent < 0:
        return 1 / _power(x, -exponent)
    found = arb(1)
    for _ in range(exponent):
        found = found * x
    return found.nonnegative_part() if exponent % 2 == 0 else found
