"""Expressions multiplied out by python-flint: whether they are zero, and what has their sign.

An expression is a quotient N/D: N is a polynomial over variables, sines, cosines, steps and other
functions, D a product of divisors. In N, sin² = 1 - cos², and the square of a root is what the root
is of. The expression is zero if N has no term. Identities between different functions, as of sin 2x
and sin x cos x, are not seen.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cache, reduce
from math import gcd, lcm
from operator import mul
from typing import Any

from rbstab.proof.exact.atoms import COS, LET, SIN, STEP, Atom, Monomial, monomial
from rbstab.proof.exact.expr import Expr, as_factor, atom
from rbstab.proof.exact.rewriting import substituted

MOST_TERMS = 20_000
"""A sum of more terms is not shown to be anything."""

MOST_PAIRS = 2_000_000
"""Sums with more pairs of terms are not multiplied."""


Polynomial = Any  # fmpq_mpoly


MOST_FACTORED = 4_000
"""Sums of more terms are not factored."""


class TooLargeError(Exception):
    """An expression has too many terms when it is multiplied out."""


def is_zero(e: Expr) -> bool:
    """Return whether an expression is shown to be zero wherever it has a value."""
    try:
        return not multiplied_out(e).terms
    except TooLargeError:
        return False


def multiplied_out(e: Expr, evenly: Callable[[Atom], bool] = lambda _: False) -> Expr:
    """Multiply an expression by its divisors, and multiply all sums out.

    Args:
        e: The expression.
        evenly: Whether it is multiplied by an even power of a divisor.

    Raises:
        TooLargeError: It has too many terms.
    """
    if e.is_polynomial:
        return e
    e = _with_common_exponentials(e)
    ring = _Ring(e)
    numerator, divisors = ring.quotient(e)
    for a, p in divisors.items():
        if p % 2 and (evenly(a) or (a.kind == LET and ring.quotient(a.inner)[1])):
            numerator = ring.product(numerator, ring.numerator(a))
    return ring.expression(numerator)


def as_product(e: Expr) -> Expr:
    """Return a polynomial as a product of powers of sums, if one has another power than 1."""
    if not e.is_polynomial or len(e.terms) > MOST_FACTORED:
        return e
    ring = _Ring(e)
    number, factors = ring.quotient(e)[0].factor_squarefree()
    if all(p == 1 for _, p in factors):
        return e
    powers = (as_factor(ring.expression(factor)) ** int(p) for factor, p in factors)
    return reduce(mul, powers, ring.expression(ring.context.constant(number)))


def lead(e: Expr) -> Fraction:
    """Return the coefficient of the first monomial of a sum, in an order of all monomials."""
    return e.terms[min(e.terms, key=order_of)]


def order_of(m: Monomial) -> tuple[int, list[tuple[tuple[int, str], int]]]:
    """Return what orders monomials: those of low degree come first."""
    return sum(abs(p) for _, p in m), [(a.order, p) for a, p in m]


def _with_common_exponentials(e: Expr) -> Expr:
    """Write exp(u), exp(2u) and exp(-u) as powers of one function."""
    groups: dict[Expr, dict[Atom, Fraction]] = {}
    for a in e.all_atoms:
        if a.kind == "exp" and a.inner.terms:
            c = lead(a.inner)
            groups.setdefault(a.inner.scaled(1 / c), {})[a] = c
    given = dict[Atom, Expr]()
    for direction, multiples in groups.items():
        over = lcm(*(c.denominator for c in multiples.values()))
        unit = Fraction(gcd(*(int(c * over) for c in multiples.values())), over)
        base = direction.scaled(unit).exp()
        given |= {a: base ** int(c / unit) for a, c in multiples.items() if c != unit}
    return substituted(e, given)


class _Ring:
    """The polynomials over the functions in an expression."""

    def __init__(self, e: Expr) -> None:
        from flint import fmpq_mpoly_ctx  # imported late: it takes a while

        functions = [a for a in e.all_atoms if a.kind != LET]
        cosines = [atom(COS, a.argument) for a in functions if a.kind == SIN]
        self.atoms = list(dict.fromkeys([*functions, *cosines]))
        self.context: Any = fmpq_mpoly_ctx.get([f"x{k}" for k in range(len(self.atoms))])
        self.of = dict(zip(self.atoms, self.context.gens(), strict=True))
        self.quotient = cache(self._quotient)
        self.squares: dict[int, Polynomial] = {}
        for k, a in enumerate(self.atoms):
            if a.kind in {SIN, STEP}:  # a step is its square
                cosine = self.of[atom(COS, a.argument)] if a.kind == SIN else None
                self.squares[k] = self.of[a] if cosine is None else 1 - cosine**2
        for k, a in enumerate(self.atoms):
            square, divisors = self.quotient(a.inner) if a.kind == "sqrt" else (None, None)
            if square is not None and not divisors:
                self.squares[k] = square

    def numerator(self, a: Atom) -> Polynomial:
        """Return what stands for an atom that divides."""
        return self.quotient(a.inner)[0] if a.kind == LET else self.of[a]

    def _quotient(self, e: Expr) -> tuple[Polynomial, Counter[Atom]]:
        """Return N and the divisors, with their powers, of which D is the product."""
        rows, common = list[tuple[Polynomial, Counter[Atom]]](), Counter[Atom]()
        for m, c in e.terms.items():
            above, below = Counter[Atom](), Counter[Atom]()
            for a, p in m:
                (above if p > 0 else below)[a] += abs(p)
                inner = self.quotient(a.inner)[1] if a.kind == LET else {}
                for b, n in inner.items():
                    (below if p > 0 else above)[b] += n * abs(p)
            rows.append((self._powers(above, self._number(c)), below))
            common |= below
        total = self.context.constant(0)
        for term, below in rows:
            total += self._powers(common - below, term)
            if len(total) > MOST_TERMS:
                raise TooLargeError
        return self._reduced(total), common

    def _number(self, c: Fraction) -> Polynomial:
        from flint import fmpq

        return self.context.constant(fmpq(c.numerator, c.denominator))

    def _powers(self, factors: Mapping[Atom, int], polynomial: Polynomial) -> Polynomial:
        for a, p in factors.items():
            for _ in range(p):
                polynomial = self.product(polynomial, self.numerator(a))
        return polynomial

    def product(self, first: Polynomial, second: Polynomial) -> Polynomial:
        """Return the product of two polynomials."""
        if len(first) * len(second) > MOST_PAIRS:
            raise TooLargeError
        return self._reduced(first * second)

    def _reduced(self, polynomial: Polynomial) -> Polynomial:
        """Put what squares are in place of them."""
        while True:
            degrees = polynomial.degrees()
            k = next((k for k in self.squares if degrees[k] > 1), None)
            if k is None:
                return polynomial
            by_power: dict[int, dict[tuple[int, ...], Any]] = {}
            for powers, c in polynomial.to_dict().items():
                count, left = divmod(int(powers[k]), 2)
                by_power.setdefault(count, {})[*powers[:k], left, *powers[k + 1 :]] = c
            polynomial = self.context.constant(0)
            for count, terms in by_power.items():
                polynomial += self.context.from_dict(terms) * self.squares[k] ** count

    def expression(self, polynomial: Polynomial) -> Expr:
        """Return a polynomial as an expression."""
        terms = polynomial.to_dict().items()
        return Expr(
            {
                monomial(zip(self.atoms, map(int, powers), strict=True)): Fraction(
                    int(c.p), int(c.q)
                )
                for powers, c in terms
            }
        )
