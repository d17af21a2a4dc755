"""The numbers of a box of bodies, and expressions as polynomials in them.

A number with a tolerance is p = middle + radius z with |z| <= 1, and z is one more variable of the
traced expressions. Where z stands in a polynomial, it is a *weight*; inside a function it stays.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any, NamedTuple

from numpy.polynomial.chebyshev import poly2cheb

from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.expr import (
    LET,
    POSITIVE,
    STEP,
    VAR,
    Atom,
    Expr,
    as_factor,
    expr,
    monomial,
    only,
    variable,
)
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy
from rbstab.systems.system import System

ONE = Fraction(1)

FIRST = 2000
"""The first variable z; those before it are Θ, X and own states."""

REMAINDERS = 5000
"""The first variable that stands for the remainder of a series; it is in [-1, 1] too."""

STEPS = frozenset({STEP, POSITIVE})
"""The kinds of atoms that are not smooth."""

SERIES = 8
"""The largest number of terms of the series of a reciprocal."""

SMALL = Fraction(1, 10_000)
"""The size of the remainder, relative to the reciprocal, at which a series ends."""

Powers = tuple[tuple[int, int], ...]
"""A product of powers of variables z: their numbers, ascending, with their powers."""

Weighted = dict[Powers, Expr]
"""A polynomial in z whose coefficients are expressions."""


class Members(NamedTuple):
    """The functions that build the system of a member.

    Attributes:
        exact: Builds it without elements of users. Its arguments are the numbers that have a
            tolerance, in any kind of number, and the conversion of arrays of all numbers. Such an
            array may contain doubles and numbers that are converted already.
        own: Builds it with them, from doubles.
    """

    exact: Callable[[Sequence[Any], Callable[[Array], Array]], System]
    own: Callable[[Sequence[float]], System]


@dataclass(frozen=True)
class Part:
    """A box of bodies: the number p_k is in [middle_k - radius_k, middle_k + radius_k]."""

    middle: tuple[Fraction, ...]
    radius: tuple[Fraction, ...]

    def halves(self, axis: int) -> "tuple[Part, Part]":
        """Cut the box in two along one number. The halves share a face, so they cover the box."""
        radius = list(self.radius)
        radius[axis] /= 2
        found = []
        for sign in (-1, 1):
            middle = list(self.middle)
            middle[axis] += sign * radius[axis]
            found.append(Part(tuple(middle), tuple(radius)))
        return found[0], found[1]

    def share_of(self, whole: "Part") -> Fraction:
        """Return the volume of this part over that of the box of which it is a part."""
        pairs = zip(self.radius, whole.radius, strict=True)
        return math.prod((own / of_whole for own, of_whole in pairs if of_whole), start=Fraction(1))

    def without_width(self) -> "Part":
        """Return the body in the middle, as a box without width."""
        return Part(self.middle, (Fraction(0),) * len(self.middle))

    def expressions(self) -> list[Expr]:
        """Return the numbers p_k = middle_k + radius_k z_k."""
        pairs = zip(self.middle, self.radius, strict=True)
        return [expr(p) + variable(FIRST + k).scaled(r) for k, (p, r) in enumerate(pairs)]


def weighted(e: Expr) -> Weighted:
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
    return _Splitting(placing).split(e, frozenset())


class _Splitting:
    """The taking apart of one expression; equal reciprocals share a remainder.

    Args:
        placing: The numbers that stay in terms with steps.
    """

    def __init__(self, placing: frozenset[int]) -> None:
        self.placing, self.remainders = placing, 0
        self.reciprocals: dict[Expr, Expr] = {}

    def split(self, e: Expr, fixed: frozenset[int]) -> Weighted:
        """Return an expression as a polynomial in all numbers but the fixed ones."""
        found: Weighted = {}
        for m, c in e.terms.items():
            stay = fixed | (self.placing if any(_has_step(a) for a, _ in m) else frozenset())
            apart = [any(v >= FIRST for v in a.variables - stay) for a, _ in m]
            plain = [one for one, varies in zip(m, apart, strict=True) if not varies]
            term: Weighted = {(): Expr({monomial(plain): c})}
            for (a, p), varies in zip(m, apart, strict=True):
                if varies:
                    term = _product(term, self._power(a, p, stay))
            for powers, x in term.items():
                add(found, powers, x)
        return found

    def _power(self, a: Atom, p: int, fixed: frozenset[int]) -> Weighted:
        if a.kind == VAR:
            if p < 0:
                raise NoReducedEnergy(NoEnergyReason.DIVISOR)
            assert isinstance(a.argument, int)
            return {((a.argument, p),): expr(1)}
        alone = min(a.variables) >= FIRST and not a.variables & fixed
        if a.kind == LET and p < 0 and alone:
            return self.split(self._reciprocal(a.inner) ** -p, fixed)
        if a.kind != LET or p < 0:
            return {(): only(a) ** p}
        base = {powers: _as_one(x) for powers, x in self.split(a.inner, fixed).items()}
        found: Weighted = {(): expr(1)}
        for _ in range(p):
            found = _product(found, base)
        return found

    def _reciprocal(self, q: Expr) -> Expr:
        """Return 1/q as a polynomial in z and w with |w| <= 1, where q = q0 (1 + d), |d| <= δ < 1.

        1/q = (1 - d + d² - ...)/q0 + w δⁿ/((1 - δ) |q0|), with n terms in brackets.
        """
        if q not in self.reciprocals:
            of = self.split(q, frozenset())
            if any(x.constant is None for x in of.values()):
                raise NoReducedEnergy(NoEnergyReason.DIVISOR)
            sizes = {powers: x.constant or Fraction(0) for powers, x in of.items()}
            middle = sizes.pop((), Fraction(0))
            spread = sum((abs(c) for c in sizes.values()), Fraction(0))
            if spread >= abs(middle):
                raise NoReducedEnergy(NoEnergyReason.DIVISOR)
            delta = spread / abs(middle)
            deviation = q.scaled(1 / middle) - 1
            series, power, n = expr(1), expr(1), 1
            while n < SERIES and delta**n > SMALL:
                power = power * -deviation
                series, n = series + power, n + 1
            w = variable(REMAINDERS + self.remainders).scaled(delta**n / (1 - delta))
            self.remainders += 1
            self.reciprocals[q] = series.scaled(1 / middle) + w.scaled(1 / abs(middle))
        return self.reciprocals[q]


def _has_step(a: Atom) -> bool:
    return a.kind in STEPS or (a.kind != VAR and any(b.kind in STEPS for b in a.inner.all_atoms))


def _as_one(e: Expr) -> Expr:
    """Return a polynomial as it is, and another sum as a factor."""
    return e if e.is_polynomial else as_factor(e)


def _product(one: Weighted, other: Weighted) -> Weighted:
    found: Weighted = {}
    for (p, x), (q, y) in product(one.items(), other.items()):
        add(found, times(p, q), x * y)
    return found


def add(total: dict[Any, Any], place: Any, term: Any) -> None:
    """Add a term to the sum at its place, of any kind of number."""
    total[place] = total[place] + term if place in total else term


def times(p: Powers, q: Powers) -> Powers:
    """Return the product of two products of powers."""
    found = dict(p)
    for z, n in q:
        found[z] = found.get(z, 0) + n
    return tuple(sorted(found.items()))


def chebyshev(power: int) -> dict[int, Fraction]:
    """Return the weights of zⁿ in c_k, by k; they are dyadic, so doubles hold them exactly."""
    weights = poly2cheb([0] * power + [1]).tolist()
    return {k: Fraction(weight) for k, weight in enumerate(weights) if weight}
