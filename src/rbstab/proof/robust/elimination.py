"""Elimination of X and own states for all bodies in a box.

The stored energy is Π = ½ x'Hx + b'x + c, with H = H(z), and b, c functions of Θ and z. For *any*
x_0(Θ; z), with q = Hx_0 + b,

    U = min over x of Π = c + ½ x_0'(b + q) - ½ q'H⁻¹q.

Here x_0 is the minimiser's Taylor polynomial in z, with few functions e of Θ. So q is of a higher
order in z, and q'H⁻¹q of twice that order: what is left is bounded by F'F/μ >= H⁻¹.
"""

from collections.abc import Mapping
from fractions import Fraction
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.expr import VAR, Expr, Monomial, atom
from rbstab.proof.exact.rewriting import quadratic_in
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy
from rbstab.proof.robust.majorants import lower_bound
from rbstab.proof.robust.numbers import (
    ONE,
    Powers,
    Weighted,
    add,
    times,
)

if TYPE_CHECKING:
    from flint import fmpq, fmpq_mat

PRODUCTS = 6_000
"""The order of x_0 is raised while it takes at most so many products of matrices."""

HIGHEST = 3
"""The highest order of x_0."""

Rows = dict[Powers, "dict[Monomial, fmpq]"]
"""The coefficients of functions of Θ, for each product of powers of z."""


class Eliminated(NamedTuple):
    """U of all bodies in a box: `rows` - ½ q'Rq, where 0 <= R(z) <= F'F.

    Attributes:
        rows: A polynomial in z, with functions of Θ as products of atoms.
        entries: The functions e of Θ of which q consists.
        left: Fq = Σ z^α L_α e, for each α a matrix L_α, shape (α, n, entries).
        rounding: A bound on the rounding of Σ |L_α|, shape (n, entries).
    """

    rows: Rows
    entries: tuple[Monomial, ...]
    left: Array
    rounding: Array


class _Quadratic(NamedTuple):
    """H and b as sums of products of z: b = Σ z^α B_α e."""

    H: "dict[Powers, fmpq_mat]"
    B: "dict[Powers, fmpq_mat]"
    entries: tuple[Monomial, ...]


def eliminated(energy: Weighted, size: int) -> Eliminated:
    """Minimise the stored energy of all bodies in a box over x = [X, own states].

    Args:
        energy: Π, with the entries of a configuration as variables.
        size: The number of entries of a configuration.

    Raises:
        NoReducedEnergy: Π is not quadratic in x with a stiffness that is constant in Θ, or that is
            not proved to be positive definite for all z (`majorants.lower_bound`).
    """
    rows, quadratic = _taken_apart(energy, list(range(3, size)))
    if size == 3:
        return Eliminated(rows, (), np.zeros((0, 0, 0)), np.zeros((0, 0)))
    x, q = _minimiser(quadratic)
    pairs: dict[Powers, fmpq_mat] = {}
    both = dict(q)
    for powers, matrix in quadratic.B.items():
        add(both, powers, matrix)
    for one, left in x.items():
        transposed = left.transpose()
        for other, right in both.items():
            add(pairs, times(one, other), transposed * right)
    _multiplied_out(rows, pairs, quadratic.entries)
    return Eliminated(rows, quadratic.entries, *_bounded(quadratic, q))


def _taken_apart(energy: Weighted, numbers: list[int]) -> tuple[Rows, _Quadratic]:
    from flint import fmpq_mat  # imported late: few commands make proofs

    n = len(numbers)
    variables = {atom(VAR, k) for k in numbers}
    rows: Rows = {}
    H, b = dict[Powers, fmpq_mat](), dict[Powers, list[Expr]]()
    for powers, e in energy.items():
        parts = quadratic_in(e, numbers)
        if any(a in variables for a in parts.rest.all_atoms):
            raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
        if any(a in variables for one in parts.b for a in one.all_atoms):
            raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
        rows[powers] = {m: _fmpq(c) for m, c in parts.rest.terms.items()}
        if any(c for row in parts.H for c in row):
            H[powers] = fmpq_mat([[_fmpq(c) for c in row] for row in parts.H])
        if any(one.terms for one in parts.b):
            b[powers] = parts.b
    functions = tuple(dict.fromkeys(m for of in b.values() for one in of for m in one.terms))
    place = {m: k for k, m in enumerate(functions)}
    B = dict[Powers, fmpq_mat]()
    for powers, of in b.items():
        matrix = fmpq_mat(n, max(1, len(functions)))
        for i, one in enumerate(of):
            for m, c in one.terms.items():
                matrix[i, place[m]] = _fmpq(c)
        B[powers] = matrix
    return rows, _Quadratic(H, B, functions)


def _minimiser(of: _Quadratic) -> "tuple[dict[Powers, fmpq_mat], dict[Powers, fmpq_mat]]":
    """Return x_0 and q, of the highest order that `PRODUCTS` allows."""
    inverse = _inverse(of)
    found = _of_order(of, inverse, 0)
    for order in range(1, HIGHEST + 1):
        if not found[1]:  # x_0 is the minimiser
            break
        x, q = _of_order(of, inverse, order)
        if len(x) * (len(q) + len(of.B)) > PRODUCTS:
            break
        found = x, q
    return found


def _inverse(of: _Quadratic) -> "fmpq_mat":
    """Return H_0⁻¹, where H_0 is the stiffness of the body in the middle."""
    try:
        inverse: fmpq_mat = of.H[()].inv()
    except (KeyError, ZeroDivisionError) as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_HELD) from error
    return inverse


def _fmpq(c: Fraction) -> "fmpq":
    from flint import fmpq

    return fmpq(c.numerator, c.denominator)


def _of_order(
    of: _Quadratic, inverse: "fmpq_mat", order: int
) -> "tuple[dict[Powers, fmpq_mat], dict[Powers, fmpq_mat]]":
    """Return x_0 up to an order in z, and q = Hx_0 + b, in which all lower orders cancel."""
    x, q = dict[Powers, "fmpq_mat"](), dict(of.B)
    pending = {powers for powers in q if _order(powers) <= order}
    while pending:
        powers = min(pending, key=lambda one: (_order(one), one))
        pending.remove(powers)
        if not _is_zero(q.get(powers)):
            step = -1 * inverse * q[powers]
            x[powers] = step
            for other, matrix in of.H.items():
                place = times(powers, other)
                add(q, place, matrix * step)
                if _order(place) <= order and place != powers:
                    pending.add(place)
    return x, {powers: matrix for powers, matrix in q.items() if not _is_zero(matrix)}


def _order(powers: Powers) -> int:
    return sum(n for _, n in powers)


def _is_zero(matrix: "fmpq_mat | None") -> bool:
    return matrix is None or all(c == 0 for c in matrix.entries())


def _multiplied_out(
    rows: Rows, pairs: "Mapping[Powers, fmpq_mat]", entries: tuple[Monomial, ...]
) -> None:
    """Add ½ e'Qe to the rows, for each Q."""
    whole = dict[tuple[int, int], list[tuple[Monomial, "fmpq"]]]()
    n = range(len(entries))
    for powers, Q in pairs.items():
        row = rows.setdefault(powers, {})
        for i, j in combinations_with_replacement(n, 2):
            c = (Q[i, j] + Q[j, i]) / (4 if i == j else 2)
            if c != 0:
                if (i, j) not in whole:
                    e = Expr({entries[i]: ONE}) * Expr({entries[j]: ONE})
                    whole[i, j] = [(m, _fmpq(x)) for m, x in e.terms.items()]
                for m, x in whole[i, j]:
                    add(row, m, c * x)


def _bounded(of: _Quadratic, q: "Mapping[Powers, fmpq_mat]") -> tuple[Array, Array]:
    """Return the matrices L_α of Fq, where F'F >= H(z)⁻¹ for all z, and their rounding."""
    middle = _doubles(of.H[()])
    others = np.array([_doubles(H) for powers, H in of.H.items() if powers])
    others = others.reshape(-1, *middle.shape)
    error = 2.0**-52 * (np.abs(middle) + np.abs(others).sum(axis=0))
    bound = lower_bound(middle, others, error)
    if bound is None:
        raise NoReducedEnergy(NoEnergyReason.NOT_HELD)
    F, n = bound.factor / np.sqrt(bound.least), len(middle)
    columns = max(1, len(of.entries))
    matrices = np.array([_doubles(matrix) for matrix in q.values()]).reshape(-1, n, columns)
    matrices = matrices[:, :, : len(of.entries)]
    rounding = 1e-14 * np.einsum("ij,ajk->ik", np.abs(F), np.abs(matrices))
    return np.einsum("ij,ajk->aik", F, matrices), rounding


def _doubles(matrix: "fmpq_mat") -> Array:
    return np.array([[int(c.p) / int(c.q) for c in row] for row in matrix.tolist()])
