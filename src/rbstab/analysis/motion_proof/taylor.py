"""A polynomial near the motion of a system, and proved bounds on the rates around it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbstab.analysis.motion_proof.dual import Dual, objects
from rbstab.analysis.motion_proof.rounding import magnitude_of, middle_and_radius, rounded_up
from rbstab.mechanics.numbers import Array

Field = Callable[[Array], Array]
"""f of ẏ = f(y): the rates of a system as a function of its states, for any kind of number."""

Coefficients = list[list[Any]]
"""The coefficients of a polynomial in time for each state: exact balls, in its unit / sᵏ."""


Slopes = list[tuple[int, int, list[Any]]]
"""The entries (i, j) of ∂f/∂y along a polynomial that are not zero: their coefficients in time."""


@dataclass(frozen=True, eq=False)
class JacobianSeries:
    """∂f/∂y along a polynomial as a series in τ = t/h.

    middle and radius, shape (terms, n, n), enclose its first coefficients; rest, shape (n, n),
    bounds the sum of all further ones for |τ| <= 1. All are divided by s.
    """

    middle: Array
    radius: Array
    rest: Array


@dataclass(frozen=True, eq=False)
class DiscBounds:
    """Bounds on f and ∂f/∂y for all complex |t| <= ρh, and all states within a margin of p(t).

    rates has shape (n,), jacobian has shape (n, n).
    """

    rates: Array
    jacobian: Array

    @property
    def finite(self) -> bool:
        """Whether f is analytic there: no division by a number that may be zero has occurred."""
        return bool(np.isfinite(self.rates).all() and np.isfinite(self.jacobian).all())


def polynomial(field: Field, centre: list[Any], order: int) -> Coefficients:
    """Return p, the Taylor polynomial of the motion from a state, with rounded coefficients.

    It need not be exact: its defect is bounded afterwards. Its coefficients are exact numbers.

    Args:
        field: f.
        centre: The state, exact balls.
        order: The degree of p.
    """
    from flint import ctx

    found: Coefficients = [[entry] for entry in centre]
    cap = ctx.cap
    try:
        for k in range(1, order + 1):
            ctx.cap = k
            rates = field(_series(found))
            for coefficients, rate in zip(found, rates, strict=True):
                coefficients.append((_coefficient(rate, k - 1) / k).mid())
    finally:
        ctx.cap = cap
    return found


def extended(field: Field, p: Coefficients, slopes: Slopes, order: int) -> Coefficients:
    """Return p with further coefficients, from one more evaluation of f.

    With p of degree d, and p + δ the motion, (p + δ)' = f(p) + Jδ + O(δ²) and δ = O(t^(d+1)). So
    the coefficients of the motion follow one after the other, up to degree 2d + 2. The sums are
    computed in doubles; coefficients that are not finite become zero.

    Args:
        field: f.
        p: The polynomial.
        slopes: The coefficients of J = ∂f/∂y along p, at least d + 1 of them.
        order: The new degree, at most 2d + 2.
    """
    from flint import arb, ctx

    n, known = len(p), len(p[0])
    cap = ctx.cap
    try:
        ctx.cap = order
        rates = field(_series(p))
    finally:
        ctx.cap = cap
    J = np.zeros((order, n, n))
    for i, j, coefficients in slopes:
        for k, coefficient in enumerate(coefficients[:order]):
            J[k, i, j] = float(coefficient.mid())
    delta = np.zeros((order + 1, n))
    for k in range(known - 1, order):
        rate = np.array([float(_coefficient(rate, k).mid()) for rate in rates])
        for j in range(k + 1 - known):
            rate += J[j] @ delta[k - j]
        delta[k + 1] = rate / (k + 1)
    delta[~np.isfinite(delta)] = 0.0
    return [[*row, *(arb(value) for value in delta[known:, i].tolist())] for i, row in enumerate(p)]


def step_for(p: Coefficients, tolerance: float, scale: Array) -> float:
    """Return the step, s, at which the last terms of p are `tolerance` of the scale of a state."""
    order = len(p[0]) - 1
    step = np.inf
    for k in (order - 1, order):
        size = max(magnitude_of(row[k]) / s for row, s in zip(p, scale.tolist(), strict=True))
        if size > 0:
            step = min(step, (tolerance / size) ** (1.0 / k))
    return step


def defect(field: Field, p: Coefficients, h: float, ratio: float, bounds: DiscBounds) -> Array:
    """Return a bound on |f(p(t)) - p'(t)| for 0 <= t <= h, shape (n,).

    The first 2N coefficients are computed; Cauchy's estimate bounds the others: f(p(t)) is analytic
    and at most F for |t| <= ρh, so its coefficients are at most F (ρh)⁻ᵏ.

    Args:
        field: f.
        p: The polynomial, of degree N.
        h: The step, s.
        ratio: ρ.
        bounds: The bounds for |t| <= ρh.
    """
    from flint import arb, ctx

    terms = 2 * (len(p[0]) - 1)
    cap = ctx.cap
    try:
        ctx.cap = terms
        rates = field(_series(p))
    finally:
        ctx.cap = cap
    rest = ratio**-terms / (1.0 - 1.0 / ratio)
    powers = [arb(h) ** k for k in range(terms)]
    found = np.zeros(len(p))
    for i, (row, rate) in enumerate(zip(p, rates, strict=True)):
        total = arb(0)
        for k, power in enumerate(powers):
            term = _coefficient(rate, k)
            if k + 1 < len(row):
                term = term - (k + 1) * row[k + 1]
            total = total + abs(term) * power
        found[i] = rounded_up(magnitude_of(total) + bounds.rates[i] * rest)
    return found


def jacobian_slopes(field: Field, p: Coefficients, terms: int) -> Slopes:
    """Return the first coefficients of ∂f/∂y along p as balls."""
    from flint import ctx

    cap = ctx.cap
    try:
        ctx.cap = terms
        rates = field(_series(p, derivatives=True))
    finally:
        ctx.cap = cap
    return [
        (i, j, [_coefficient_of(slope, k) for k in range(min(terms, _length(slope)))])
        for i, rate in enumerate(rates)
        for j, slope in getattr(rate, "slopes", {}).items()
    ]


def jacobian_series(
    slopes: Slopes, terms: int, h: float, ratio: float, bounds: DiscBounds
) -> JacobianSeries:
    """Return ∂f/∂y along p as a series in τ = t/h; see `defect` for the arguments."""
    from flint import arb

    n = len(bounds.rates)
    middle, radius = np.zeros((terms, n, n)), np.zeros((terms, n, n))
    powers = [arb(h) ** k for k in range(terms)]
    for i, j, coefficients in slopes:
        for k, coefficient in enumerate(coefficients):
            middle[k, i, j], radius[k, i, j] = middle_and_radius(coefficient * powers[k])
    rest = bounds.jacobian * (ratio**-terms / (1.0 - 1.0 / ratio))
    return JacobianSeries(middle, radius, rounded_up(rest))


def disc_bounds(field: Field, p: Coefficients, h: float, ratio: float, margin: Array) -> DiscBounds:
    """Bound f and ∂f/∂y for all complex |t| <= ρh and all states within a margin of p(t).

    Args:
        field: f.
        p: The polynomial.
        h: The step, s.
        ratio: ρ.
        margin: The largest distance from p(t) by state, real or complex, shape (n,).
    """
    from flint import acb, arb

    reach = arb(h) * ratio
    state = []
    for i, (row, extra) in enumerate(zip(p, margin.tolist(), strict=True)):
        radius, power = arb(extra), arb(1)
        for coefficient in row[1:]:
            power = power * reach
            radius = radius + abs(coefficient) * power
        spread = arb(0, radius.abs_upper())
        state.append(Dual(acb(row[0] + spread, spread), {i: acb(1)}))
    n = len(p)
    size, jacobian = np.zeros(n), np.zeros((n, n))
    for i, rate in enumerate(field(objects(state))):
        size[i] = magnitude_of(rate.value) if isinstance(rate, Dual) else abs(rate)
        for j, slope in getattr(rate, "slopes", {}).items():
            jacobian[i, j] = magnitude_of(slope)
    return DiscBounds(size, jacobian)


def _series(p: Coefficients, *, derivatives: bool = False) -> Array:
    from flint import arb, arb_series

    return objects(
        [Dual(arb_series(row), {i: arb(1)} if derivatives else None) for i, row in enumerate(p)]
    )


def _coefficient(rate: Any, k: int) -> Any:
    """Return a coefficient of a rate, which is a dual or a double."""
    from flint import arb

    return _coefficient_of(rate.value if isinstance(rate, Dual) else arb(rate), k)


def _coefficient_of(value: Any, k: int) -> Any:
    """Return a coefficient of a series, or of a ball, which has only the first."""
    from flint import arb, arb_series

    if isinstance(value, arb_series):
        return value[k]
    return value if k == 0 else arb(0)


def _length(value: Any) -> int:
    from flint import arb_series

    return value.length() if isinstance(value, arb_series) else 1
