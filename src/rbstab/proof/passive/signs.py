"""Signs and convexity of exact expressions, seen from their form.

Each function says that something holds wherever the expression has a value, or that it is not seen.
A sum is never negative if it is one of squares with positive weights, and of products whose factors
have known signs. Squares are completed one after the other, exactly (as LDL' does it): for
e = c p² + p q + r, e = c (p + q/2c)² + (r - q²/4c). A function is convex if its second derivative
along any direction is never negative.
"""

from collections.abc import Collection, Iterable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rbstab.analysis.exact import kernel
from rbstab.proof.exact.atoms import COS, LET, POSITIVE, SIN, STEP, Atom, Monomial, times
from rbstab.proof.exact.expr import Expr, atom, expr, only, product, variable
from rbstab.proof.exact.matrices import inverse_of_definite
from rbstab.proof.exact.rewriting import derivative, quadratic_in, spread
from rbstab.proof.passive.expanded import (
    MOST_TERMS,
    TooLargeError,
    as_product,
    lead,
    multiplied_out,
    order_of,
)

NOT_NEGATIVE = frozenset({STEP, POSITIVE, "sqrt", "exp"})

PITCH = atom(COS, variable(1))
"""cos θ2, which is positive for |θ2| < π/2."""

MOST_SQUARES = 60

DIRECTIONS = 10_000
"""The number of the first variable that stands for an entry of a direction."""


class Sign(NamedTuple):
    """What is seen of an expression that is never negative.

    Attributes:
        above: Whether it is never zero, where |θ2| < π/2.
        zeros: Expressions that are zero wherever it is.
    """

    above: bool
    zeros: tuple[Expr, ...]


def never_negative(e: Expr) -> bool:
    """Return whether an expression is shown to be never negative."""
    return _sign(e) is not None


def positive(e: Expr) -> bool:
    """Return whether an expression is shown to be above zero, where |θ2| < π/2."""
    sign = _sign(e)
    return sign is not None and sign.above


def vanishing(e: Expr) -> tuple[Expr, ...]:
    """Return expressions that are zero wherever one is zero that is shown to be never negative."""
    sign = _sign(e)
    return () if sign is None else sign.zeros


@lru_cache(4096)
def _sign(e: Expr) -> Sign | None:
    """Return what is seen of an expression; None if it may be negative."""
    try:
        core = _core(e)
        if core is not e:
            return _sign(core)
        sign = _of_sum(e)
        if sign is None and not e.is_polynomial:
            sign = _of_sum(multiplied_out(e, lambda a: not _is_weight(a)))
    except (TooLargeError, RecursionError):  # thousands of functions inside one another
        return None
    return sign


def _core(e: Expr) -> Expr:
    """Return u if an expression has the sign of u by its form: c sinh(u), c tanh(u), c atan(u)."""
    inner, c = None, Fraction(1)
    match sorted(e.terms.items(), key=lambda term: len(term[0])):
        case [(((Atom() as a, 1),), c)] if a.kind in {LET, "atan"}:
            inner = a.inner
        case [(((Atom() as b, 1),), k), (((Atom() as a, 1),), c)]:
            if k == -c and a.kind == b.kind == "exp" and not (a.inner + b.inner).terms:
                inner = a.inner
        case [((), c), (((Atom() as a, -1),), k)] if k == -2 * c and a.kind == LET:
            match list((a.inner - 1).terms.items()):  # 1 - 2/(exp(2u) + 1)
                case [(((Atom() as b, 1),), 1)] if b.kind == "exp":
                    inner = b.inner
    return e if inner is None else _core(inner.scaled(Fraction(1 if c > 0 else -1)))


def _of_atom(a: Atom) -> Sign | None:
    if a.kind == "exp" or a is PITCH:
        return Sign(True, ())
    if a.kind == "sqrt":
        return _sign(a.inner) or Sign(False, ())
    return _sign(a.inner) if a.kind == LET else Sign(False, ()) if a.kind in NOT_NEGATIVE else None


def _of_product(m: Monomial, c: Fraction) -> Sign | None:
    """Return what is seen of a product: odd powers of what may have either sign are in pairs."""
    above, odd, zeros, divides = c > 0, set[str](), dict[str, tuple[Expr, ...]](), False
    pending = [(only(a), p) for a, p in m]
    while pending:
        u, p = pending.pop()
        u = _core(u)
        if not u.terms:
            return Sign(False, ())
        first, k = next(iter(u.terms.items()))
        if len(u.terms) > 1:
            sign, k = _sign(u), Fraction(1)
            if sign is None:
                sign = _sign(-u)
                k = lead(u) if sign is None else Fraction(-1)
        elif len(first) == 1 and first[0][1] == 1:
            sign = _of_atom(first[0][0])
        else:
            pending += [(only(a), n * p) for a, n in first]
            sign = Sign(True, ())
        above ^= k < 0 and p % 2 == 1
        u = u.scaled(1 / k)
        if sign is None:
            odd ^= {u.digest} if p % 2 else set()
        if sign is None or not sign.above:
            zeros[u.digest] = (u, *(sign.zeros if sign else ()))
            divides = divides or p < 0
    if odd or not above:
        return None
    return Sign(not zeros, next(iter(zeros.values())) if len(zeros) == 1 and not divides else ())


def _is_alone(m: Monomial, c: Fraction) -> bool:
    """Return whether a term is never negative by itself, as x², exp(x) or x tanh(x) is."""
    if all(p % 2 == 0 or a.kind in NOT_NEGATIVE for a, p in m):
        return c > 0
    return _of_product(m, c) is not None


def _is_weight(a: Atom) -> bool:
    return a.kind in NOT_NEGATIVE or a is PITCH or (a.kind == LET and never_negative(a.inner))


def _of_sum(e: Expr) -> Sign | None:
    """Return what is seen of a sum of squares, and of products, with weights."""
    groups: dict[Monomial, dict[Monomial, Fraction]] = {}
    for m, c in e.terms.items():
        weight = tuple((a, p) for a, p in m if p % 2 and _is_weight(a))
        rest = tuple(factor for factor in m if factor not in weight)
        groups.setdefault(weight, {})[rest] = c
    above, zeros = False, list[Expr]()
    for weight, terms in groups.items():
        completed = _completed(as_product(Expr(terms)))
        if completed is None:
            return None
        forms, left = completed
        if all((sign := _of_atom(a)) is not None and sign.above for a, _ in weight):
            zeros += forms
        for m, c in left.terms.items():
            sign = _of_product(times(weight, m), c)
            if sign is None:
                return None
            above = above or sign.above
            zeros += sign.zeros
    return Sign(above, tuple(zeros))


def _completed(e: Expr) -> tuple[list[Expr], Expr] | None:
    """Return forms whose squares a sum has, and what is left, of which no term is negative."""
    forms = list[Expr]()
    for _ in range(MOST_SQUARES):
        crossed = [m for m, c in e.terms.items() if not _is_alone(m, c)]
        if not crossed:
            return forms, e
        roots = {
            tuple((a, p // 2) for a, p in m): c
            for m, c in e.terms.items()
            if c > 0 and all(p % 2 == 0 for _, p in m)
        }
        # What has no sines may leave them, and the constant, as squares: not the other way round.
        order = sorted(roots, key=lambda m: (all(a.kind in {SIN, COS} for a, _ in m), order_of(m)))
        useful = (
            root for root in order if any(_other(m, root, roots) is not None for m in crossed)
        )
        root = next(useful, None)
        if root is None:
            return None
        c, square = roots[root], times(root, root)
        others = ((_other(m, root, roots), x) for m, x in e.terms.items() if m != square)
        q = Expr({m: x for m, x in others if m is not None})
        form = Expr({root: Fraction(1)}) + q.scaled(1 / (2 * c))
        if max(len(form.terms) ** 2, len(e.terms)) > MOST_TERMS:
            return None
        forms.append(form)
        e = e - product(form, form).scaled(c)
    return None


def _other(m: Monomial, root: Monomial, roots: Collection[Monomial]) -> Monomial | None:
    """Return the other factor of a product, if its square may be another term."""
    powers = dict(m)
    if any(powers.get(a, 0) < p if p > 0 else powers.get(a, 0) > p for a, p in root):
        return None
    cofactor = times(m, tuple((a, -p) for a, p in root))
    # sin² is not a term: it is written as 1 - cos².
    return cofactor if cofactor in roots or any(a.kind == SIN for a, _ in cofactor) else None


def spanned(wanted: Sequence[Expr], forms: Iterable[Expr]) -> bool:
    """Return whether expressions are sums of others with rational factors: zero where these are."""
    return in_terms_of(tuple(forms), wanted) is not None


def in_terms_of(forms: Sequence[Expr], wanted: Sequence[Expr]) -> list[list[Fraction]] | None:
    """Return the factors of each wanted expression as a sum of others; None if one is no such sum.

    Of others that depend on those before them the factor is 0.
    """
    columns = [e.terms for e in (*forms, *wanted)]
    keys = dict.fromkeys(m for column in columns for m in column)
    rows = [[column.get(m, Fraction(0)) for column in columns] for m in keys]
    vectors = kernel(np.array(rows or [[Fraction(0)] * len(columns)], dtype=object))
    # Each relation between the columns has a factor 1 at the last of them.
    n = len(forms)
    factors = [[-x for x in v[:n]] for v in vectors if any(v[n:])]
    return factors if len(factors) == len(wanted) else None


# -- convexity -------------------------------------------------------------------------------------


def is_convex(e: Expr, numbers: Sequence[int]) -> bool:
    """Return whether an expression is shown to be convex in some variables x, for all others.

    Norms √(|Lx + m|² + s) with s >= 0 are; of all else the second derivative is not negative.
    """
    norms: dict[Monomial, Fraction] = {
        m: c
        for m, c in e.terms.items()
        if c > 0 and len(m) == 1 and m[0][1] == 1 and _is_norm(m[0][0], numbers)
    }
    e = e - Expr(norms)
    direction = {k: variable(DIRECTIONS + k) for k in numbers}
    return never_negative(derivative(derivative(e, direction), direction))


def _is_norm(a: Atom, numbers: Sequence[int]) -> bool:
    """Return whether an atom is √(½x'Hx + b'x + r) with H definite and r - ½b'H⁻¹b >= 0."""
    if a.kind != "sqrt":
        return False
    parts = quadratic_in(spread(a.inner), numbers)
    inverse = inverse_of_definite(parts.H)
    if inverse is None or any(x.variables & set(numbers) for x in (*parts.b, parts.rest)):
        return False
    n = range(len(numbers))
    fall = sum((parts.b[i] * parts.b[j].scaled(inverse[i][j]) for i in n for j in n), expr(0))
    return never_negative(parts.rest - fall.scaled(Fraction(1, 2)))
