"""Lengths of lines that depend on the position of a body: springs of a body that is not held.

The energy ½ k (ℓ - ℓ₀)² of a spring is ½ k ℓ² and what is not quadratic, -k ℓ₀ ℓ. Counted from
where the quadratic part of the energy is least, ℓ = |z + r(Θ)|, and

    W(Θ, z) = U(Θ) + ½ z'Sz + N(Θ, z) - Σ w_j |z + r_j(Θ)|,    w_j = k_j ℓ₀_j > 0

with what elements of users and ligaments add to it in N.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from rbstab.proof.exact.expr import (
    COS,
    LET,
    OF,
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
    summed,
    variable,
)
from rbstab.proof.exact.rewriting import Quadratic, inverse_of_definite, quadratic_in, substituted

PLAIN = (VAR, SIN, COS)
"""The kinds of atoms of polynomials."""

ROOT = "sqrt"

HALVINGS = 30
"""Halvings of the interval in which the least eigenvalue of S is looked for."""


def with_lengths_apart(U: Expr, numbers: Sequence[int]) -> Expr:
    """Multiply out (ℓ - ℓ₀)² for lengths ℓ that depend on some variables."""
    few = frozenset(numbers)
    return summed(_length_apart(m, c, few) for m, c in U.terms.items())


def _length_apart(m: Monomial, c: Fraction, numbers: frozenset[int]) -> Expr:
    term = Expr({m: c})
    if len(m) != 1 or m[0][1] != 2 or m[0][0].kind != LET or not m[0][0].variables & numbers:
        return term
    inner = m[0][0].inner
    lengths = [a for a in inner.atoms if a.kind == ROOT]
    c0 = inner.terms.get(())
    if len(lengths) != 1 or len(inner.terms) != 2 or c0 is None:
        return term
    length = lengths[0]
    factor = inner.terms.get(((length, 1),))
    if factor is None:
        return term
    both = only(length).scaled(2 * c0 * factor) + c0**2
    return (both + length.inner.scaled(factor**2)).scaled(c)  # √q√q is q


def with_squares(U: Expr, free: Sequence[int]) -> Expr:
    """Write each length of variables z as √(c + Σ (z_i + r_i)²), whose bounds are far sharper."""
    given = dict[Atom, Expr]()
    for a in U.all_atoms:
        if a.kind == ROOT and a.variables & set(free):
            squares = _squares_of(a.inner, free)
            if squares is not None:
                given[a] = squares.function(ROOT)
    return substituted(U, given)


def _squares_of(q: Expr, free: Sequence[int]) -> Expr | None:
    """Return q = |z|² + 2 r'z + |r|² + c with a number c >= 0 as a sum of squares, else None."""
    parts = _plain_quadratic(q, free)
    if parts is None or [[2 * Fraction(i == j) for j in free] for i in free] != parts.H:
        return None
    r = [b.scaled(Fraction(1, 2)) for b in parts.b]
    c = (parts.rest - sum((one**2 for one in r), expr(0))).constant
    if c is None or c < 0:
        return None
    squares = (as_factor(variable(k) + one) ** 2 for k, one in zip(free, r, strict=True))
    return sum(squares, expr(c))


def _plain_quadratic(q: Expr, free: Sequence[int]) -> Quadratic | None:
    """Return a polynomial as a quadratic function of z; None if it is none."""
    if any(a.kind not in PLAIN for a in q.all_atoms):
        return None
    parts = quadratic_in(q, free)
    return None if parts.rest.variables & set(free) else parts


@dataclass(frozen=True, eq=False)
class Line:
    """The energy -w|z + r(Θ)| of a line.

    Attributes:
        weight: w, N.
        monomial: Its length, as it stands in the energy.
        offset: r, m.
    """

    weight: Fraction
    monomial: Monomial
    offset: tuple[Expr, ...]


@dataclass(frozen=True, eq=False)
class Springs:
    """An energy with lines of springs, taken apart.

    Attributes:
        stiffness: A lower bound of the least eigenvalue of S, N/m.
        lines: The lines.
        convex: N.
    """

    stiffness: Fraction
    lines: tuple[Line, ...]
    convex: Expr

    def collapsed(self, U: Expr, free: Sequence[int]) -> list[Expr]:
        """Return the energy U where a line has no length, for each line: a function of Θ."""
        found = []
        for line in self.lines:
            rest = Expr({m: c for m, c in U.terms.items() if m != line.monomial})
            places = zip(free, line.offset, strict=True)
            found.append(substituted(rest, {atom(VAR, k): -r for k, r in places}))
        return found


class NotSingleError(ValueError):
    """It is not shown that an energy with springs has one minimiser."""


def springs_of(U: Expr, free: Sequence[int]) -> Springs:
    """Take an energy apart into lines of springs and all else.

    Raises:
        NotSingleError: It has lines, and S is not definite, or N is not convex in z.
    """
    parts = quadratic_in(U, free, constant=PLAIN)
    lines, others, z = list[Line](), dict[Monomial, Fraction](), frozenset(free)
    for m, c in parts.rest.terms.items():
        offset = _offset_of(m, free) if c < 0 else None
        if offset is not None:
            lines.append(Line(-c, m, offset))
        elif any(a.variables & z for a, _ in m):
            others[m] = c
    N, stiffness = Expr(others), _least_eigenvalue(parts.H)
    if lines and (stiffness is None or any(b.terms for b in parts.b)):
        raise NotSingleError("beside its springs nothing holds the position")
    if lines and not _shape(N, z).convex:
        raise NotSingleError("an energy is not shown to be convex in the position, beside springs")
    return Springs(stiffness or Fraction(0), tuple(lines), N)


class _Shape(NamedTuple):
    """What is known of a function of z: whether it is affine, or convex, or not negative too."""

    affine: bool
    convex: bool
    above: bool


_UNKNOWN, _CONSTANT = _Shape(False, False, False), _Shape(True, True, False)


def _shape(e: Expr, z: frozenset[int]) -> _Shape:
    """Return what is known of an expression, by the form of its terms."""
    affine = convex = True
    above = e.terms.get((), 0) >= 0
    for m, c in e.terms.items():
        if not m:
            continue
        one = _shape_of_product(m, z)
        affine = affine and one.affine
        convex = convex and (one.affine or (one.convex and c > 0))
        above = above and one.above and c > 0
    return _Shape(affine, convex, above)


def _shape_of_product(m: Monomial, z: frozenset[int]) -> _Shape:
    mine = [(a, p) for a, p in m if a.variables & z]
    if not mine:
        return _CONSTANT._replace(above=all(p % 2 == 0 for _, p in m))
    if any(a.kind in {OF, STEP} for a, _ in mine):
        return _Shape(False, True, False)  # the energy of a ligament
    (a, p), *others = mine
    found = _shape_of_atom(a, z)
    if p == 1 and not others and (found.affine or len(m) == 1):
        return found
    if others or len(m) > 1 or p < 0:
        return _UNKNOWN
    even = p % 2 == 0
    convex = (found.affine and even) or (found.convex and found.above)
    return _Shape(False, convex, even or found.above)


def _shape_of_atom(a: Atom, z: frozenset[int]) -> _Shape:
    if a.kind == VAR:
        return _CONSTANT
    inner = _shape(a.inner, z)
    if a.kind == LET:
        return inner
    if a.kind == "exp":
        return _Shape(False, inner.convex, True)
    if a.kind == ROOT:
        # The length of a vector that is affine in z.
        squares = inner.above and all(
            len(m) == 1 and m[0][1] == 2 and _shape_of_atom(m[0][0], z).affine
            for m in a.inner.terms
            if m
        )
        return _Shape(False, squares, True)
    return _UNKNOWN


def _offset_of(m: Monomial, free: Sequence[int]) -> tuple[Expr, ...] | None:
    """Return r of a monomial √(Σ (z_i + r_i)²); None if it is no such length."""
    if len(m) != 1 or m[0][0].kind != ROOT or m[0][1] != 1:
        return None
    q, found = m[0][0].inner, list[Expr]()
    for k in free:
        factor = next((s for s in q.terms if len(s) == 1 and k in s[0][0].variables), None)
        if factor is None or q.terms[factor] != 1 or factor[0][1] != 2:
            return None
        a = factor[0][0]
        r = (a.inner if a.kind == LET else only(a)) - variable(k)
        if r.variables & set(free):
            return None
        found.append(r)
    return tuple(found) if len(q.terms) == len(found) else None


def _least_eigenvalue(H: Sequence[Sequence[Fraction]]) -> Fraction | None:
    """Return a lower bound of the least eigenvalue of a matrix; None if it is not definite."""
    low, high = Fraction(0), min(row[i] for i, row in enumerate(H))
    if inverse_of_definite(H) is None:
        return None
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        moved = [[x - middle * (i == j) for j, x in enumerate(row)] for i, row in enumerate(H)]
        if inverse_of_definite(moved) is None:
            high = middle
        else:
            low = middle
    return low or None
