"""Signs and convexity of exact expressions, seen from their form.

Each function says that something holds wherever the expression has a value, or that it is not seen.
A polynomial is never negative if it is a sum of squares with positive weights: squares are
completed one after the other, exactly, e = c (p + q/2c)² + (r - q²/4c) for e = c p² + p q + r. A
function is convex if its second derivative along any direction is never negative.
"""

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache

import numpy as np

from rbstab.analysis.exact import kernel
from rbstab.proof.exact.expr import (
    COS,
    LET,
    POSITIVE,
    SIN,
    STEP,
    VAR,
    Atom,
    Expr,
    Monomial,
    as_factor,
    atom,
    expr,
    only,
    product,
    times,
    variable,
)
from rbstab.proof.exact.rewriting import derivative, inverse_of_definite, quadratic_in
from rbstab.proof.passive.expanded import (
    MOST_TERMS,
    TooLargeError,
    factors_of,
    lead,
    multiplied_out,
    order_of,
    powers_in,
)

NOT_NEGATIVE = frozenset({STEP, POSITIVE, "sqrt", "exp"})

PITCH = atom(COS, variable(1))
"""cos θ2, which is positive for |θ2| < π/2."""

MOST_SQUARES = 60

MOST_FACTORED = 4_000
"""Sums of more terms are not factored."""

DIRECTIONS = 10_000
"""The number of the first variable that stands for an entry of a direction."""


# -- signs -----------------------------------------------------------------------------------------


@lru_cache(4096)
def never_negative(e: Expr) -> bool:
    """Return whether an expression is shown to be never negative."""
    try:
        u = odd_argument(e)
        return (u is not None and never_negative(u)) or _split(e) is not None
    except RecursionError:  # thousands of functions inside one another
        return False


@lru_cache(4096)
def positive(e: Expr) -> bool:
    """Return whether an expression is shown to be above zero, where |θ2| < π/2."""
    certain = [m for m, c in e.terms.items() if c > 0 and all(_positive(a) for a, _ in m)]
    if any(never_negative(e - Expr({m: e.terms[m]})) for m in certain):
        return True
    found = _completed_squares(e) if certain else None
    return found is not None and any(all(_positive(a) for a, _ in m) for m in found[1].terms)


def _positive(a: Atom) -> bool:
    if a.kind in {LET, "sqrt"}:
        return positive(a.inner)
    return a.kind == "exp" or a is PITCH


def _split(e: Expr) -> list[Expr] | None:
    """Return forms that are zero where a sum is; None if it is not shown to be never negative.

    If the sum is not seen to be one of squares as it stands, it is multiplied by its divisors.
    """
    found = _weighted_squares(e)
    if found is not None or all(_is_plain(a, p) for a, p in powers_in(e)):
        return found
    try:
        return _weighted_squares(multiplied_out(e, _kept_sign))
    except TooLargeError:
        return None


def _as_product(e: Expr) -> list[Expr] | None:
    """Return the same of a polynomial that is a product of powers, of which some are even."""
    if not all(a.kind in {VAR, SIN, COS} for a in e.atoms) or len(e.terms) > MOST_FACTORED:
        return None
    factors = factors_of(e)
    if all(p == 1 for _, p in factors):
        return None
    above = True
    for f, p in factors:
        if p % 2 and not never_negative(f):
            if not never_negative(-f):
                return None
            above = not above
    zeros = [f for f, _ in factors if not (positive(f) or positive(-f))]
    if not above:
        return None
    return [*zeros, *_inside(as_factor(zeros[0]))] if len(zeros) == 1 else []


def _is_plain(a: Atom, p: int) -> bool:
    return p > 0 and a.kind not in {LET, "sqrt", "exp"}


def _kept_sign(a: Atom, p: int) -> int:
    """Return a power of a divisor that is never negative."""
    return p if a.kind in NOT_NEGATIVE or _positive(a) else p + p % 2


def odd_argument(e: Expr) -> Expr | None:
    """Return u if an expression has the sign of u by its form: c sinh(u), c tanh(u), c atan(u)."""
    if len(e.terms) == 1:
        ((m, c),) = e.terms.items()
        of_one = len(m) == 1 and m[0][0].kind == "atan" and m[0][1] % 2
        return m[0][0].inner.scaled(Fraction(1 if c > 0 else -1)) if of_one else None
    if len(e.terms) != 2:
        return None
    (m1, c1), (m2, c2) = sorted(e.terms.items(), key=lambda one: len(one[0]))
    if len(m2) != 1:
        return None
    a, p = m2[0]
    if not m1 and a.kind == LET and p == -1 and c2 == -2 * c1:  # 1 - 2/(exp(2u) + 1)
        rest = a.inner - 1
        if len(rest.terms) == 1 and rest.atoms and next(iter(rest.atoms)).kind == "exp":
            (b,) = rest.atoms
            if rest == only(b):
                return b.inner.scaled(Fraction(1 if c1 > 0 else -1))
    if len(m1) == 1 and c1 == -c2 and p == m1[0][1] == 1 and a.kind == m1[0][0].kind == "exp":
        b = m1[0][0]
        if not (a.inner + b.inner).terms:
            return a.inner if c2 > 0 else b.inner
    return None


class _Sign:
    """The sign of a product: a number, times what may have either sign."""

    def __init__(self) -> None:
        self.above = True
        self.unknown = dict[str, Expr]()
        self.odd = set[str]()
        self.divides = False
        self.squares = list[Expr]()

    def times(self, m: Monomial, c: Fraction) -> "_Sign":
        self.above = self.above == (c > 0)
        for a, p in m:
            self._factor(a, p)
        return self

    def _factor(self, a: Atom, p: int) -> None:
        if a.kind in NOT_NEGATIVE or a is PITCH:
            self._may_vanish(a, p)
        elif a.kind == LET:
            u = odd_argument(a.inner)
            if u is not None:
                self._sum(u, p)
            elif never_negative(a.inner):
                self._may_vanish(a, p)
            else:
                self._sum(a.inner, p)
        elif a.kind == "atan":
            self._sum(a.inner, p)
        else:
            self._toggle(only(a), p)

    def _may_vanish(self, a: Atom, p: int) -> None:
        if not _positive(a):
            self.divides = self.divides or p < 0
            self.squares.append(only(a))

    def _sum(self, u: Expr, p: int) -> None:
        if len(u.terms) == 1:
            ((m, c),) = u.terms.items()
            self.above = self.above == (c > 0 or p % 2 == 0)
            for a, power in m:
                self._factor(a, power * p)
            return
        inner = odd_argument(u)
        if inner is not None:
            self._sum(inner, p)
            return
        if never_negative(u) or never_negative(-u):
            self.above = self.above == (p % 2 == 0 or never_negative(u))
            if not (positive(u) or positive(-u)):
                self.divides = self.divides or p < 0
                self.squares.append(u)
            return
        first = lead(u)
        self.above = self.above == (first > 0 or p % 2 == 0)
        self._toggle(u.scaled(1 / first), p)

    def _toggle(self, u: Expr, p: int) -> None:
        self.unknown[u.digest] = u
        self.divides = self.divides or p < 0
        if p % 2:
            self.odd ^= {u.digest}

    @property
    def never_negative(self) -> bool:
        return self.above and not self.odd

    @property
    def zero(self) -> Expr | None:
        """What is zero where the product is, if that is one thing."""
        found = [*self.unknown.values(), *self.squares]
        return found[0] if len(found) == 1 and not self.divides else None


def _alone(m: Monomial, c: Fraction) -> bool:
    """Return whether a term is never negative by itself, as x², exp(x) or x tanh(x) is."""
    if all(p % 2 == 0 or a.kind in NOT_NEGATIVE for a, p in m):
        return c > 0
    return _Sign().times(m, c).never_negative


def _weighted_squares(e: Expr) -> list[Expr] | None:
    """Return forms that are zero where a sum is; None if it is not shown to be never negative."""
    groups: dict[Monomial, dict[Monomial, Fraction]] = {}
    for m, c in e.terms.items():
        weight = tuple((a, p) for a, p in m if p % 2 and _is_weight(a))
        rest = tuple(one for one in m if one not in weight)
        groups.setdefault(weight, {})[rest] = c
    forms = list[Expr]()
    for weight, terms in groups.items():
        found = _as_product(Expr(terms))
        if found is None:
            found = _squares(Expr(terms))
        if found is None:
            return None
        if all(_positive(a) for a, _ in weight):
            forms += found
        elif all(_alone(m, c) for m, c in terms.items()):
            forms += _zeros(Expr({times(weight, m): c for m, c in terms.items()}))
    return forms


def _is_weight(a: Atom) -> bool:
    if a.kind == LET:
        return odd_argument(a.inner) is None and never_negative(a.inner)
    return a.kind in NOT_NEGATIVE or a is PITCH


def _squares(e: Expr) -> list[Expr] | None:
    """Return forms that are zero where a sum of squares is; None if it is not seen to be one."""
    found = _completed_squares(e)
    return None if found is None else [*found[0], *_zeros(found[1])]


def _completed_squares(e: Expr) -> tuple[list[Expr], Expr] | None:
    """Return forms whose squares a sum has, and what is left, of which no term is negative."""
    forms = list[Expr]()
    for _ in range(MOST_SQUARES):
        signs = {m: _alone(m, c) for m, c in e.terms.items()}
        if all(signs.values()):
            return forms, e
        left = None if len(e.terms) > MOST_TERMS else _completed(e, signs)
        if left is None:
            return None
        form, e = left
        forms.append(form)
    return None


def _completed(e: Expr, signs: Mapping[Monomial, bool]) -> tuple[Expr, Expr] | None:
    """Return p + q/2c, and what is left of a sum without its square."""
    crossed = [m for m, alone in signs.items() if not alone]
    even = [m for m, c in e.terms.items() if c > 0 and all(p % 2 == 0 for _, p in m)]
    roots = {tuple((a, p // 2) for a, p in m): e.terms[m] for m in even}

    def other(m: Monomial, root: Monomial) -> Monomial | None:
        """Return the other factor of a product, if its square may be another term."""
        left = divided(m, root)
        # sin² is not a term: it is written as 1 - cos².
        sines = left is not None and any(a.kind == SIN for a, _ in left)
        return left if sines or left in roots else None

    # What has no sines may leave them, and the constant, as squares: not the other way round.
    fixed = {root: all(a.kind in {SIN, COS} for a, _ in root) for root in roots}
    for root in sorted(roots, key=lambda m: (fixed[m], order_of(m))):
        if all(other(m, root) is None for m in crossed):
            continue
        c, square = roots[root], times(root, root)
        shares = ((other(m, root), x) for m, x in e.terms.items() if m != square)
        q = Expr({m: x for m, x in shares if m is not None})
        form = Expr({root: Fraction(1)}) + q.scaled(1 / (2 * c))
        if len(form.terms) ** 2 > MOST_TERMS:
            return None
        return form, e - product(form, form).scaled(c)
    return None


def divided(m: Monomial, root: Monomial) -> Monomial | None:
    """Return a monomial divided by another one; None if that does not divide it."""
    found = times(m, tuple((a, -p) for a, p in root))
    powers = dict(found)
    return None if any(powers.get(a, 0) < 0 <= p for a, p in root) else found


def _zeros(e: Expr) -> list[Expr]:
    """Return what is zero where terms are zero that are never negative, each by itself."""
    forms = list[Expr]()
    for m, c in e.terms.items():
        zero = _Sign().times(m, c).zero
        if zero is not None:
            forms += [zero, *_inside(zero)]
    return forms


def _inside(zero: Expr) -> list[Expr]:
    """Return what is zero where a sum is, or what it stands for, which is never negative."""
    a = next(iter(zero.atoms))
    inner = a.inner if zero == only(a) and a.kind == LET else zero
    return vanishing(inner) if len(inner.terms) > 1 and never_negative(inner) else []


def vanishing(e: Expr) -> list[Expr]:
    """Return expressions that are zero wherever one is zero that is shown to be never negative."""
    return _split(e) or []


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
    found = [[-x for x in v[:n]] for v in vectors if any(v[n:])]
    return found if len(found) == len(wanted) else None


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
    parts = quadratic_in(a.inner, numbers)
    inverse = inverse_of_definite(parts.H)
    if inverse is None or any(x.variables & set(numbers) for x in (*parts.b, parts.rest)):
        return False
    n = range(len(numbers))
    fall = sum((parts.b[i] * parts.b[j].scaled(inverse[i][j]) for i in n for j in n), expr(0))
    return never_negative(parts.rest - fall.scaled(Fraction(1, 2)))
