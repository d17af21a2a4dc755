"""Polynomials in the numbers z of a box of bodies.

Where z stands in a polynomial, it is a *weight*; inside a function it stays.
"""

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from functools import cache, reduce
from itertools import product as pairs_of
from math import prod
from typing import Any

from numpy.polynomial.chebyshev import poly2cheb

from rbstab.proof.exact.atoms import LET, POSITIVE, STEP, VAR, Atom, Monomial, times
from rbstab.proof.exact.expr import Expr, as_factor, expr, only, product, summed, variable
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy
from rbstab.proof.robust.numbers import FIRST

REMAINDERS = 5000
"""The first variable that stands for the remainder of a series; it is in [-1, 1] too."""

STEPS = frozenset({STEP, POSITIVE})
"""The kinds of atoms that are not smooth."""

SERIES = 8
"""The largest number of terms of the series of a reciprocal."""

SMALL = Fraction(1, 10_000)
"""The size of the remainder, relative to the reciprocal, at which a series ends."""

Weighted = dict[Monomial, Any]
"""A polynomial in z: the coefficient of each product of powers."""


def weighted(e: Expr) -> dict[Monomial, Expr]:
    """Write an expression as a polynomial in the numbers z, where these are outside of functions.

    Sums that are factors (`LET`) are taken apart by their powers of z. A reciprocal of a polynomial
    in z alone becomes a series with a remainder, which is one more variable in [-1, 1]. A number
    that places a step stays in all terms with steps: step(θ - a)(θ - a)² is smooth, and is not with
    another number a in its second factor.

    Raises:
        NoReducedEnergy: A divisor may be zero for some body.
    """
    steps = [a for a in e.all_atoms if a.kind in STEPS]
    placing = frozenset(v for a in steps for v in a.variables if v >= FIRST)
    return _Weights(placing).of(e, frozenset())


class _Weights:
    """The taking apart of one expression; equal reciprocals share a remainder."""

    def __init__(self, placing: frozenset[int]) -> None:
        # The numbers in `placing` stay in terms with steps.
        self.placing, self.remainders = placing, 0
        self.reciprocal = cache(self._reciprocal)

    def of(self, e: Expr, fixed: frozenset[int]) -> dict[Monomial, Expr]:
        """Return an expression as a polynomial in all numbers but the fixed ones."""
        polynomial: dict[Monomial, dict[Monomial, Fraction]] = {}
        for m, c in e.terms.items():
            stay = fixed | self.placing if any(_has_step(a) for a, _ in m) else fixed
            factors = [self._power(a, p, stay) for a, p in m]
            for n, x in reduce(product, factors, expr(c)).terms.items():
                z = tuple((a, p) for a, p in n if _is_number(a) and a.variables.isdisjoint(stay))
                rest = tuple(factor for factor in n if factor not in z)
                row = polynomial.setdefault(z, {})
                row[rest] = row.get(rest, Fraction(0)) + x
        return {z: Expr(row) for z, row in polynomial.items()}

    def _power(self, a: Atom, p: int, fixed: frozenset[int]) -> Expr:
        varying = {v for v in a.variables - fixed if v >= FIRST}
        alone = varying == a.variables
        if a.kind == VAR and alone and p < 0:
            raise NoReducedEnergy(NoEnergyReason.DIVISOR)
        if a.kind == LET and varying and (p > 0 or alone):
            inner = a.inner if p > 0 else self.reciprocal(a.inner)
            parts = self.of(inner, fixed).items()
            apart = summed(product(Expr({z: Fraction(1)}), _as_polynomial(x)) for z, x in parts)
            return reduce(product, [apart] * abs(p))
        return only(a) ** p

    def _reciprocal(self, q: Expr) -> Expr:
        """Return 1/q as a polynomial in z and w, |w| <= 1, where q = q0 (1 + d), |d| <= δ < 1."""
        middle, spread = middle_and_spread(q)
        if spread >= abs(middle):
            raise NoReducedEnergy(NoEnergyReason.DIVISOR)
        delta, deviation = spread / abs(middle), q.scaled(1 / middle) - 1
        # 1/q = (1 - d + d² - ...)/q0 + w δⁿ/((1 - δ) |q0|), with n terms in brackets.
        series, power, n = expr(1), expr(1), 1
        while n < SERIES and delta**n > SMALL:
            power = power * -deviation
            series, n = series + power, n + 1
        w = variable(REMAINDERS + self.remainders).scaled(delta**n / (1 - delta))
        self.remainders += 1
        return series.scaled(1 / middle) + w.scaled(1 / abs(middle))


def middle_and_spread(q: Expr) -> tuple[Fraction, Fraction]:
    """Return q0 and a bound on |q - q0| for all bodies.

    Raises:
        NoReducedEnergy: It is no polynomial in the numbers z.
    """
    sizes = {z: x.constant for z, x in weighted(q).items()}
    middle = sizes.pop((), Fraction(0))
    if middle is None or None in sizes.values():
        raise NoReducedEnergy(NoEnergyReason.DIVISOR)
    return middle, sum((abs(c) for c in sizes.values() if c), Fraction(0))


def _is_number(a: Atom) -> bool:
    return a.kind == VAR and min(a.variables) >= FIRST


def _has_step(a: Atom) -> bool:
    return a.kind in STEPS or (a.kind != VAR and any(b.kind in STEPS for b in a.inner.all_atoms))


def _as_polynomial(e: Expr) -> Expr:
    """Return a polynomial as it is, and another sum as a factor."""
    return e if e.is_polynomial else as_factor(e)


def gathered(terms: Iterable[tuple[Monomial, Any]]) -> Weighted:
    """Return the sum of terms in z with coefficients of one kind, such as matrices."""
    total: Weighted = {}
    for z, x in terms:
        total[z] = total[z] + x if z in total else x
    return total


def plus(first: Mapping[Monomial, Any], second: Mapping[Monomial, Any]) -> Weighted:
    """Return the sum of two polynomials in z."""
    return gathered([*first.items(), *second.items()])


def multiplied(first: Mapping[Monomial, Any], second: Mapping[Monomial, Any]) -> Weighted:
    """Return the product of two polynomials in z."""
    pairs = pairs_of(first.items(), second.items())
    return gathered((times(p, q), x * y) for (p, x), (q, y) in pairs)


def in_chebyshev(of: Mapping[Monomial, Any]) -> Weighted:
    """Write Σ z^α x_α as Σ c_d(z) x_d, with products c_d of Chebyshev polynomials.

    The keys have their degrees in place of powers: z² = ½ + ½ c_2(z).
    """
    from flint import fmpq  # imported late: few commands make proofs

    def terms() -> Iterator[tuple[Monomial, Any]]:
        for z, x in of.items():
            for chosen in pairs_of(*([(a, k, w) for k, w in _chebyshev(p)] for a, p in z)):
                weight = prod((w for _, _, w in chosen), start=Fraction(1))
                degrees = tuple((a, k) for a, k, _ in chosen if k)
                yield degrees, x * fmpq(weight.numerator, weight.denominator)

    return gathered(terms())


@cache
def _chebyshev(power: int) -> list[tuple[int, Fraction]]:
    """Return the weights of zⁿ in c_k, by k; they are dyadic, so doubles hold them exactly."""
    weights = poly2cheb([0] * power + [1]).tolist()
    return [(k, Fraction(weight)) for k, weight in enumerate(weights) if weight]
