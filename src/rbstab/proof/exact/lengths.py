"""Lengths of lines that depend on the position of a body: springs of a body that is not held.

The energy ½ k (ℓ - ℓ₀)² of a spring is ½ k ℓ² and what is not quadratic, -k ℓ₀ ℓ. Counted from
where the quadratic part of the energy is least, ℓ = |z + r(Θ)|, and

    W(Θ, z) = U(Θ) + ½ z'Sz + N(Θ, z) - Σ w_j |z + r_j(Θ)|,    w_j = k_j ℓ₀_j > 0

with what elements of users and ligaments add to it in N.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from rbstab.proof.exact.atoms import COS, LET, OF, SIN, STEP, VAR, Atom, Monomial
from rbstab.proof.exact.expr import (
    Expr,
    as_factor,
    atom,
    mapped,
    only,
    product,
    summed,
    variable,
)
from rbstab.proof.exact.matrices import inverse_of_definite
from rbstab.proof.exact.rewriting import quadratic_in, spread, substituted
from rbstab.proof.passive.signs import is_convex

PLAIN = (VAR, SIN, COS)
"""The kinds of atoms of polynomials."""

ROOT = "sqrt"

ROUND_OFF = 1e-9
"""That of a computed eigenvalue, with a margin, relative to the largest."""


def with_lengths_apart(U: Expr, numbers: Sequence[int]) -> Expr:
    """Multiply out (ℓ - ℓ₀)² for lengths ℓ that depend on some variables."""
    few = frozenset(numbers)
    return summed(_length_apart(m, c, few) for m, c in U.terms.items())


def _length_apart(m: Monomial, c: Fraction, numbers: frozenset[int]) -> Expr:
    term = Expr({m: c})
    if len(m) != 1 or m[0][1] != 2 or m[0][0].kind != LET or not m[0][0].variables & numbers:
        return term
    inner = m[0][0].inner
    length = next((a for a in inner.atoms if a.kind == ROOT), None)
    if length is None or set(inner.terms) != {(), ((length, 1),)}:
        return term
    square = product(inner, inner).scaled(c)
    return mapped(square, lambda a, p: a.inner if p == 2 else only(a))  # √q√q is q


def with_squares(U: Expr, free: Sequence[int]) -> Expr:
    """Write roots of sums of squares of z as √(c + Σ a_i (z_i + r_i)²): far sharper bounds."""
    given = dict[Atom, Expr]()
    for a in U.all_atoms:
        if a.kind == ROOT and a.variables & set(free):
            squares = _squares_of(spread(a.inner), free)
            if squares is not None:
                given[a] = squares.function(ROOT)
    return substituted(U, given)


def _squares_of(q: Expr, free: Sequence[int]) -> Expr | None:
    """Return q as c + Σ a_i (z_i + r_i(Θ))² with numbers a_i > 0 and c >= 0; None if it is none."""
    z = [k for k in free if k in q.variables]
    parts = quadratic_in(q, z)
    a = [row[i] / 2 for i, row in enumerate(parts.H)]
    if not a or min(a) <= 0:
        return None
    r = [b.scaled(1 / (2 * factor)) for b, factor in zip(parts.b, a, strict=True)]
    squares = [as_factor(variable(k) + shift) ** 2 for k, shift in zip(z, r, strict=True)]
    square = summed(x.scaled(factor) for x, factor in zip(squares, a, strict=True))
    c = spread(q - square).constant
    return None if c is None or c < 0 else square + c


def _offset_of(q: Expr, free: Sequence[int]) -> tuple[tuple[Expr, ...], Fraction] | None:
    """Return r and the number c >= 0 of a polynomial |z + r|² + c; None if it is none."""
    if any(a.kind not in PLAIN for a in q.all_atoms):
        return None
    parts = quadratic_in(q, free)
    r = tuple(b.scaled(Fraction(1, 2)) for b in parts.b)
    c = (parts.rest - summed(component**2 for component in r)).constant
    if c is None or c < 0 or any(component.variables & set(free) for component in r):
        return None
    return (r, c) if [[2 * Fraction(i == j) for j in free] for i in free] == parts.H else None


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
        energies = []
        for line in self.lines:
            rest = Expr({m: c for m, c in U.terms.items() if m != line.monomial})
            places = zip(free, line.offset, strict=True)
            energies.append(substituted(rest, {atom(VAR, k): -r for k, r in places}))
        return energies


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
        if c < 0 and len(m) == 1 and m[0][0].kind == ROOT and m[0][1] == 1:
            offset = _offset_of(spread(m[0][0].inner), free)
            if offset is not None and offset[1] == 0:
                lines.append(Line(-c, m, offset[0]))
                continue
        if any(a.variables & z for a, _ in m):
            others[m] = c
    N, stiffness = Expr(others), _least_eigenvalue(parts.H)
    if lines and (stiffness is None or any(b.terms for b in parts.b)):
        raise NotSingleError("beside its springs nothing holds the position")
    # Terms with steps are the energies of ligaments, which are convex.
    plain = {m: c for m, c in others.items() if all(a.kind not in {OF, STEP} for a, _ in m)}
    if lines and not is_convex(Expr(plain), free):
        raise NotSingleError("an energy is not shown to be convex in the position, beside springs")
    return Springs(stiffness or Fraction(0), tuple(lines), N)


def _least_eigenvalue(H: Sequence[Sequence[Fraction]]) -> Fraction | None:
    """Return a lower bound of the least eigenvalue of a matrix; None if it is not definite."""
    near = np.linalg.eigvalsh(np.array(H, dtype=float))
    least = Fraction(float(near[0] - ROUND_OFF * near[-1]))
    moved = [[x - least * (i == j) for j, x in enumerate(row)] for i, row in enumerate(H)]
    return least if least > 0 and inverse_of_definite(moved) is not None else None
