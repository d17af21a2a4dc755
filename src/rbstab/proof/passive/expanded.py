"""Expressions multiplied out by python-flint: whether they are zero, and what they are a power of.

An expression times its divisors is a polynomial over variables, sines, cosines, steps and other
functions; sin² = 1 - cos², and the square of a root is what the root is of. So it is zero if no
term is left. Identities between different functions, as of sin 2x and sin x cos x, are not seen.
"""

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from functools import cached_property
from math import gcd, lcm
from typing import TYPE_CHECKING

from rbstab.proof.exact.expr import (
    COS,
    LET,
    SIN,
    STEP,
    VAR,
    Atom,
    Expr,
    Monomial,
    atom,
    monomial,
    times,
)
from rbstab.proof.exact.rewriting import substituted

if TYPE_CHECKING:
    from flint import fmpq, fmpq_mpoly, fmpq_mpoly_ctx

MOST_TERMS = 20_000
"""A sum of more terms is not shown to be anything."""

MOST_PAIRS = 2_000_000
"""Sums with more pairs of terms are not multiplied."""

MOST_ROUNDS = 12
"""Of expressions with more functions inside one another nothing is shown."""


class TooLargeError(Exception):
    """An expression has too many terms when it is multiplied out."""


def is_zero(e: Expr) -> bool:
    """Return whether an expression is shown to be zero wherever it has a value."""
    # High powers of a sum often cancel as they are.
    high = frozenset(a for a, p in powers_in(e) if a.kind == LET and p > 2)
    for kept in dict.fromkeys((high, frozenset[Atom]())):
        try:
            left = _without_divisions(_with_common_exponentials(e), kept)
            for parts in (_apart(left), [left]):
                if all(not multiplied_out(one, kept=kept).terms for one in parts):
                    return True
        except TooLargeError:
            continue
    return False


def powers_in(e: Expr) -> Iterable[tuple[Atom, int]]:
    """Return the powers of all terms."""
    return (one for m in e.terms for one in m)


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
    for direction, found in groups.items():
        over = lcm(*(c.denominator for c in found.values()))
        unit = Fraction(gcd(*(int(c * over) for c in found.values())), over)
        base = direction.scaled(unit).exp()
        given |= {a: base ** int(c / unit) for a, c in found.items() if c != unit}
    return substituted(e, given)


def multiplied_out(
    e: Expr,
    raised: Callable[[Atom, int], int] = lambda _, power: power,
    kept: frozenset[Atom] = frozenset(),
) -> Expr:
    """Multiply an expression by its divisors, and multiply all sums out.

    Args:
        e: The expression.
        raised: The power of a divisor by which it is multiplied, from that in which it stands.
        kept: Sums that stay as they are.

    Raises:
        TooLargeError: It has too many terms.
    """
    e = _with_common_exponentials(e)
    for _ in range(MOST_ROUNDS):
        divisors: dict[Atom, int] = {}
        for a, p in powers_in(e):
            divisors[a] = max(divisors.get(a, 0), -p)
        factor = monomial((a, raised(a, p)) for a, p in divisors.items() if p)
        if _is_multiplied(e, kept) and not factor:
            return e
        e = _multiplied(e, factor, kept)
    raise TooLargeError


def _is_multiplied(e: Expr, kept: frozenset[Atom]) -> bool:
    sums = ((a, p) for a, p in powers_in(e) if p > 0 and a not in kept)
    return not any(a.kind == LET or (a.kind == "sqrt" and p > 1) for a, p in sums)


def _without_divisions(e: Expr, kept: frozenset[Atom]) -> Expr:
    """Multiply the sums out, without those that divide."""
    for _ in range(MOST_ROUNDS):
        if _is_multiplied(e, kept):
            return e
        e = _multiplied(e, (), kept)
    raise TooLargeError


def _apart(e: Expr) -> list[Expr]:
    """Return the parts of a sum that share no function: each is zero if the sum is, as a rule."""
    parts = list[tuple[set[Atom], dict[Monomial, Fraction]]]()
    for m, c in e.terms.items():
        mine = {a for a, _ in m if not _is_plain(a)}
        joined = {m: c}
        rest = []
        for atoms, terms in parts:
            if atoms & mine or not (atoms or mine):
                mine, joined = mine | atoms, terms | joined
            else:
                rest.append((atoms, terms))
        parts = [*rest, (mine, joined)]
    return [Expr(terms) for _, terms in parts]


def _is_plain(a: Atom) -> bool:
    return a.kind in {VAR, STEP} or (a.kind in {SIN, COS} and a.order[0] == 0)


class _Ring:
    """Polynomials over atoms, and over the inverses of those that divide.

    Args:
        atoms: The atoms, each with whether it divides.
    """

    def __init__(self, atoms: Mapping[Atom, bool]) -> None:
        self.generators = [(a, 1) for a in atoms]
        self.generators += [(a, -1) for a, divides in atoms.items() if divides]
        self.places = {one: k for k, one in enumerate(self.generators)}

    @cached_property
    def context(self) -> "fmpq_mpoly_ctx":
        from flint import fmpq_mpoly_ctx  # imported late: it takes a while

        return fmpq_mpoly_ctx.get([f"x{k}" for k in range(max(len(self.generators), 1))])

    def of(self, terms: Mapping[Monomial, Fraction]) -> "fmpq_mpoly":
        """Return a sum as a polynomial."""
        from flint import fmpq

        found = {}
        for m, c in terms.items():
            powers = [0] * max(len(self.generators), 1)
            for a, p in m:
                powers[self.places[a, 1 if p > 0 else -1]] = abs(p)
            found[tuple(powers)] = fmpq(c.numerator, c.denominator)
        return self.context.from_dict(found)

    def expression(self, polynomial: "fmpq_mpoly") -> Expr:
        """Return a polynomial as an expression."""
        total: dict[Monomial, Fraction] = {}
        for powers, c in polynomial.to_dict().items():
            found: dict[Atom, int] = {}
            for (a, sign), p in zip(self.generators, powers, strict=False):
                if p:
                    found[a] = found.get(a, 0) + sign * int(p)
            m = monomial(found.items())
            total[m] = total.get(m, Fraction(0)) + Fraction(int(c.p), int(c.q))
        return Expr(total)

    def reduced(self, polynomial: "fmpq_mpoly") -> "fmpq_mpoly":
        """Put 1 - cos² in place of sin², and a step in place of its square."""
        generators = self.context.gens()
        for (a, sign), k in self.places.items():
            if a.kind not in {SIN, STEP} or sign < 0 or polynomial.degrees()[k] < 2:
                continue
            square = generators[k]  # of a step
            if a.kind == SIN:
                square = 1 - generators[self.places[atom(COS, a.argument), 1]] ** 2
            total = self.context.constant(0)
            by_power: dict[int, dict[tuple[int, ...], fmpq]] = {}
            for powers, c in polynomial.to_dict().items():
                count, left = divmod(int(powers[k]), 2)
                rest = (*powers[:k], left, *powers[k + 1 :])
                by_power.setdefault(count, {})[rest] = c
            for count, terms in by_power.items():
                # A step to any power is the step.
                power = count if a.kind == SIN else min(count, 1)
                total += self.context.from_dict(terms) * square**power
            polynomial = total
            if a.kind == STEP:
                polynomial = self.reduced(polynomial)
        return polynomial


def _ring_of(terms: Iterable[Monomial]) -> _Ring:
    divides: dict[Atom, bool] = {}
    for m in terms:
        for a, p in m:
            divides[a] = divides.get(a, False) or p < 0
            if a.kind == SIN:
                divides.setdefault(atom(COS, a.argument), False)
    return _Ring(divides)


def _multiplied(e: Expr, factor: Monomial, kept: frozenset[Atom]) -> Expr:
    """Multiply a sum by a product, and multiply out the sums that stand as factors."""
    groups: dict[Monomial, dict[Monomial, Fraction]] = {}
    for m, c in e.terms.items():
        sums, rest = dict[Atom, int](), dict[Atom, int]()
        for a, p in times(m, factor):
            if p > 0 and a.kind == LET and a not in kept:
                sums[a] = p
            elif p > 1 and a.kind == "sqrt":
                sums[a], rest[a] = divmod(p, 2)
            else:
                rest[a] = p
        groups.setdefault(monomial(sums.items()), {})[monomial(rest.items())] = c
    sums_used = {a for key in groups for a, _ in key}
    ring = _ring_of(
        m for terms in (*groups.values(), *(a.inner.terms for a in sums_used)) for m in terms
    )
    inner = {a: ring.of(a.inner.terms) for a in sums_used}
    total = ring.context.constant(0)
    for key, terms in groups.items():
        found = ring.of(terms)
        for a, p in key:
            for _ in range(p):
                if len(found) * len(inner[a]) > MOST_PAIRS:
                    raise TooLargeError
                found = ring.reduced(found * inner[a])
        total += found
        if len(total) > MOST_TERMS:
            raise TooLargeError
    return ring.expression(ring.reduced(total))


def factors_of(e: Expr) -> list[tuple[Expr, int]]:
    """Return a polynomial as a product of powers: a number, and factors without square factors."""
    from flint import fmpq

    ring = _ring_of(e.terms)
    number, found = ring.of(e.terms).factor_squarefree()
    number = fmpq(number)
    constant = Expr({(): Fraction(int(number.p), int(number.q))})
    return [(constant, 1), *((ring.expression(one), int(p)) for one, p in found)]
