"""The energies of all bodies in a box, with X and own states eliminated.

The stored energy is Π = ½ x'Hx + b'x + c, with H = H(z), and b, c functions of Θ and z. For *any*
x_0(Θ; z), with q = Hx_0 + b,

    U = min over x of Π = c + ½ x_0'(b + q) - ½ q'H⁻¹q.

Here x_0 is the minimiser's Taylor polynomial in z, with few functions e of Θ. So q is of a higher
order in z, and q'H⁻¹q of twice that order: what is left is bounded by F'F >= H⁻¹. Then

    U = Σ_μ (C_0 + Σ_j w_j C_j)_μ μ(Θ, z) - ½ q'Rq,    |w_j| <= 1,    0 <= R <= F'F,

where the functions μ are products of atoms, and the w_j products of Chebyshev polynomials of
numbers z: z² = ½ + ½ c_2(z).
"""

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from itertools import compress
from typing import Any, NamedTuple

import numpy as np

from rbstab.elements.spring import Spring
from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.exact.atoms import STEP, VAR, Monomial, monomial
from rbstab.proof.exact.expr import Expr, as_factor, atom, expr, numbers, product
from rbstab.proof.exact.rewriting import quadratic_in
from rbstab.proof.model import stored_energy
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy, without_potential
from rbstab.proof.robust.majorants import lower_bound
from rbstab.proof.robust.numbers import FIRST, Members, Part
from rbstab.proof.robust.weights import (
    in_chebyshev,
    middle_and_spread,
    multiplied,
    plus,
    weighted,
)
from rbstab.systems.system import System

PRODUCTS = 6_000
"""The order of x_0 is raised while it takes at most so many products of matrices."""

HIGHEST = 3
"""The highest order of x_0."""

Functions = dict[Monomial, Fraction]
"""The coefficients of functions of Θ, which are products of atoms."""

Matrix = Any  # fmpq_mat

Matrices = Mapping[Monomial, Matrix]
"""A polynomial in z whose coefficients are matrices."""


class Energies(NamedTuple):
    """The energies of all bodies in a box.

    Attributes:
        functions: The functions μ.
        middle: C_0, shape (μ,).
        others: C_j, shape (forms, μ); the first are those of c_1 of each number of the box alone.
        numbers: The number of these.
        entries: The functions e of Θ of which q consists.
        left: Fq = Σ z^α L_α e, for each α a matrix L_α, shape (α, n, entries).
        stop: The double next above the largest |θ2| that a stop allows, rad; None without one.
    """

    functions: tuple[Monomial, ...]
    middle: Array
    others: Array
    numbers: int
    entries: tuple[Monomial, ...]
    left: Array
    stop: float | None

    @property
    def inner(self) -> tuple[int, ...]:
        """The variables z inside of functions."""
        atoms = {a for m in (*self.functions, *self.entries) for a, _ in m}
        return tuple(sorted({v for a in atoms for v in a.variables if v >= FIRST}))


def energies_of(members: Members, part: Part) -> Energies:
    """Return the energies of all bodies in a box, each up to a constant.

    Args:
        members: Builds the system of a member.
        part: The box of bodies.

    Raises:
        NoReducedEnergy: They cannot be bounded: Π is not quadratic in x = [X, own states] with a
            stiffness that is constant in Θ, or that is not proved to be positive definite for all z
            (`lower_bound`); or the box is too wide for the series.
    """
    middle = members.from_doubles([float(number) for number in part.middle])
    for reason in without_potential(middle):
        raise NoReducedEnergy(reason)
    try:
        exact = partial(members.exact, part.expressions())
        total, size, end = stored_energy(middle, exact)
        _check_lengths(exact(numbers))
    except TypeError as error:
        raise NoReducedEnergy(NoEnergyReason.CODE) from error
    stop = None if end is None else end.constant
    if end is not None and stop is None:
        raise NoReducedEnergy(NoEnergyReason.STOP_VARIES)
    return _eliminated(total, range(3, size), len(part.middle), stop)


def _next_above(angle: Fraction) -> float:
    """Return the least double above an angle: a face as thick as one double contains it."""
    x = float(angle)
    return x if Fraction(x) > angle else float(np.nextafter(x, np.inf))


def _check_lengths(exact: System) -> None:
    """Raise `NoReducedEnergy` if a spring of a held body may have no length at some attitude."""
    if not exact.coordinates.holds_contact:
        return
    c = exact.body.contact_point
    for element in exact.elements:
        if isinstance(element, Spring):
            # Then both ends are at one distance from the contact point, for a body in the box.
            arm, reach = element.point - c, element.anchor - c - exact.anchor
            apart, spread = middle_and_spread(expr(arm @ arm - reach @ reach))
            if abs(apart) <= spread:
                raise NoReducedEnergy(NoEnergyReason.NO_LENGTH_OF_SOME)


def _eliminated(total: Expr, others: range, count: int, stop: Fraction | None) -> Energies:
    """Minimise Π over the variables x, and round what is left to doubles."""
    from flint import fmpq_mat  # imported late: few commands make proofs

    parts = {z: quadratic_in(e, others) for z, e in weighted(total).items()}
    x_atoms = {atom(VAR, k) for k in others}
    for part in parts.values():
        if any(x_atoms & e.all_atoms for e in (part.rest, *part.b)):
            raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
    slopes = {z: [_functions(e) for e in part.b] for z, part in parts.items()}
    rests = {z: [_functions(part.rest)] for z, part in parts.items()}
    entries = _names(slopes.values())
    as_sums = [Expr({e: Fraction(1, 2)}) for e in entries]
    halves = [_functions(product(e, f).scaled(Fraction(2))) for e in as_sums for f in as_sums]
    # Constants do not matter.
    functions = tuple(f for f in _names([*rests.values(), halves]) if f)
    U = {z: _matrix(rows, functions) for z, rows in rests.items()}
    left = np.zeros((1, 0, len(entries)))
    if others:
        H = _not_zero({z: _exact(part.H) for z, part in parts.items()})
        B = _not_zero({z: _matrix(rows, entries) for z, rows in slopes.items()})
        x, q = _minimiser(H, B)
        left = _bounded(H, q) if q else left
        pairs = multiplied({z: matrix.transpose() for z, matrix in x.items()}, plus(B, q))
        # One product of large matrices takes far less time than many.
        Q = fmpq_mat([matrix.entries() for matrix in pairs.values()]) * _matrix(halves, functions)
        U = plus(U, {z: fmpq_mat([row]) for z, row in zip(pairs, Q.tolist(), strict=True)})
    forms, zero = in_chebyshev(U), fmpq_mat(1, len(functions))
    alone = [((atom(VAR, FIRST + k), 1),) for k in range(count)]
    first = [forms.pop(z, zero) for z in ((), *alone)]
    rows = np.array([_doubles(matrix)[0] for matrix in (*first, *_not_zero(forms).values())])
    kept = np.any(rows, axis=0)
    return Energies(
        tuple(compress(functions, kept.tolist())),
        rows[0, kept],
        rows[1:, kept],
        count,
        entries,
        left,
        None if stop is None else _next_above(stop),
    )


def _functions(e: Expr) -> Functions:
    """Write a sum of products of atoms in functions: one for each product without a step."""
    functions: Functions = {}
    by_steps: dict[Monomial, Functions] = {}
    for m, c in e.terms.items():
        steps = tuple(factor for factor in m if factor[0].kind == STEP)
        if steps:
            by_steps.setdefault(steps, {})[tuple(factor for factor in m if factor not in steps)] = c
        else:
            functions[m] = c
    # Terms with the same steps are one function, step·(θ2 - a): it is small where the step is not
    # known, and its terms are not.
    for steps, terms in by_steps.items():
        lead = terms[min(terms, key=lambda m: [(a.order, p) for a, p in m])]
        ((rest, _),) = as_factor(Expr(terms).scaled(1 / lead)).terms.items()
        functions[monomial([*steps, *rest])] = lead
    return functions


def _names(parts: Iterable[Sequence[Functions]]) -> tuple[Monomial, ...]:
    """Return all functions in some rows, each once."""
    return tuple(dict.fromkeys(f for rows in parts for row in rows for f in row))


def _matrix(rows: Sequence[Functions], columns: Sequence[Monomial]) -> Matrix:
    """Return rows of coefficients as a matrix."""
    return _exact([[row.get(column, Fraction(0)) for column in columns] for row in rows])


def _exact(rows: Sequence[Sequence[Fraction]]) -> Matrix:
    from flint import fmpq, fmpq_mat  # imported late: few commands make proofs

    return fmpq_mat([[fmpq(c.numerator, c.denominator) for c in row] for row in rows])


def _minimiser(H: Matrices, B: Matrices) -> tuple[Matrices, Matrices]:
    """Return x_0 and q = Hx_0 + b, of the highest order that `PRODUCTS` allows."""
    try:
        inverse = H[()].inv()
    except (KeyError, ZeroDivisionError) as error:
        raise NoReducedEnergy(NoEnergyReason.NOT_HELD) from error
    x: Matrices = {}
    q = B
    for order in range(HIGHEST + 1):
        # The terms of x_0 of each order cancel those of q.
        step = {
            z: -1 * inverse * matrix for z, matrix in q.items() if sum(p for _, p in z) == order
        }
        more, left = {**x, **step}, _not_zero(plus(q, multiplied(H, step)))
        if order and len(more) * (len(left) + len(B)) > PRODUCTS:
            break
        x, q = more, left
    return x, q


def _not_zero(of: Matrices) -> Matrices:
    return {z: matrix for z, matrix in of.items() if matrix}


def _bounded(H: Matrices, q: Matrices) -> Array:
    """Return the matrices L_α of Fq, where F'F >= H(z)⁻¹ for all z, rounded."""
    middle = _doubles(H[()])
    others = np.array([_doubles(matrix) for z, matrix in H.items() if z]).reshape(-1, *middle.shape)
    error = 2.0**-52 * (np.abs(middle) + np.abs(others).sum(axis=0))
    bound = lower_bound(middle, others, error)
    if bound is None:
        raise NoReducedEnergy(NoEnergyReason.NOT_HELD)
    scale = Fraction(UP / np.sqrt(bound.least))
    F = _exact([[Fraction(c) * scale for c in row] for row in bound.factor.tolist()])
    return np.array([_doubles(F * matrix) for matrix in q.values()])


def _doubles(matrix: Matrix) -> Array:
    return np.array([[int(c.p) / int(c.q) for c in row] for row in matrix.tolist()])
