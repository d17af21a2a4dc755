"""The energies of all bodies in a box: functions of Θ with coefficients in intervals.

U = Σ_μ (C_0 + Σ_j w_j C_j)_μ μ(Θ, z) + r with all weights |w_j| <= 1. The functions μ are products
of atoms, the z are numbers of the body inside of them, and |r| is bounded (`elimination`).

Each power of a number z outside of them is written in Chebyshev polynomials, which lie in [-1, 1]:
z² = ½ + ½ c_2(z). Products of these with proportional rows C are taken together.
"""

from fractions import Fraction
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rbstab.elements.spring import Spring
from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.exact.expr import STEP, Expr, Monomial, as_factor, expr, monomial, numbers
from rbstab.proof.model import stored_energy
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy, without_potential
from rbstab.proof.robust.elimination import Eliminated, Rows, eliminated
from rbstab.proof.robust.numbers import (
    FIRST,
    ONE,
    REMAINDERS,
    Members,
    Part,
    Powers,
    chebyshev,
    weighted,
)
from rbstab.systems.system import System

if TYPE_CHECKING:
    from flint import fmpq

    Row = dict[Monomial, fmpq]


class Forms(NamedTuple):
    """The energies of all bodies in a box.

    Attributes:
        functions: The functions μ.
        middle: C_0, shape (μ,).
        others: C_j, shape (forms, μ).
        linear: For each number of the box the coefficients of c_1 alone, shape (numbers, μ).
        left: What elimination leaves.
        inner: The variables z inside of functions.
        used: The numbers of the box on which U depends.
        stop: The double next above the largest |θ2| that a stop allows, rad; None without one.
    """

    functions: tuple[Expr, ...]
    middle: Array
    others: Array
    linear: Array
    left: Eliminated
    inner: tuple[int, ...]
    used: frozenset[int]
    stop: float | None


def forms_of(members: Members, part: Part) -> Forms:
    """Return the energies of all bodies in a box, each up to a constant.

    Args:
        members: Builds the system of a member.
        part: The box of bodies.

    Raises:
        NoReducedEnergy: They cannot be bounded, or the box is too wide for the series.
    """
    middle = members.own([float(number) for number in part.middle])
    for reason in without_potential(middle):
        raise NoReducedEnergy(reason)
    try:
        exact = partial(members.exact, part.expressions())
        total, size, end = stored_energy(middle, exact)
        _check_lengths(exact(numbers))
    except TypeError as error:
        raise NoReducedEnergy(NoEnergyReason.CODE) from error
    if end is not None and end.constant is None:
        raise NoReducedEnergy(NoEnergyReason.STOP_VARIES)
    left = eliminated(weighted(total), size)
    used = frozenset(v - FIRST for v in total.variables if v >= FIRST)
    stop = None if end is None or end.constant is None else _next_above(end.constant)
    return _collected(left, len(part.middle), used, stop)


def _next_above(angle: Fraction) -> float:
    """Return the least double above an angle: a face as thick as one double contains it."""
    x = float(angle)
    return x if Fraction(x) > angle else float(np.nextafter(x, np.inf))


def _check_lengths(exact: System) -> None:
    """Raise `NoReducedEnergy` if a spring of a held body may have no length at some attitude.

    Its ends are then at the same distance from the contact point, of a body in the box.
    """
    if not exact.coordinates.holds_contact:
        return
    c = exact.body.contact_point
    for element in exact.elements:
        if isinstance(element, Spring):
            arm, reach = element.point - c, element.anchor - c - exact.anchor
            of = weighted(expr(arm @ arm - reach @ reach))
            sizes = {powers: abs(x.constant or Fraction(0)) for powers, x in of.items()}
            apart = sizes.pop((), Fraction(0))
            if apart <= sum(sizes.values(), Fraction(0)):
                raise NoReducedEnergy(NoEnergyReason.NO_LENGTH_OF_SOME)


def _collected(left: Eliminated, count: int, used: frozenset[int], stop: float | None) -> Forms:
    by_degrees = {powers: _functions(row) for powers, row in _in_chebyshev(left.rows).items()}
    by_degrees.setdefault((), {})
    functions = tuple(dict.fromkeys(f for row in by_degrees.values() for f in row))
    place = {f: k for k, f in enumerate(functions)}
    rows = np.zeros((len(by_degrees), len(functions)))
    for found, row in zip(rows, by_degrees.values(), strict=True):
        for f, c in row.items():
            found[place[f]] = int(c.p) / int(c.q)
    linear, middle = np.zeros((count, len(functions))), np.zeros(len(functions))
    others = []
    for powers, found in zip(by_degrees, rows, strict=True):
        if not powers:
            middle = found
        elif found.any():
            others.append(found)
        if len(powers) == 1 and powers[0][1] == 1 and powers[0][0] < REMAINDERS:
            linear[powers[0][0] - FIRST] = found
    variables = frozenset[int]().union(
        *(f.variables for f in functions), *(a.variables for m in left.entries for a, _ in m)
    )
    inner = tuple(sorted(v for v in variables if v >= FIRST))
    forms = _joined(np.array(others).reshape(-1, len(functions)))
    return Forms(functions, middle, forms, linear, left, inner, used, stop)


def _joined(rows: Array) -> Array:
    """Take forms that are proportional together: the magnitudes of their factors add up."""
    if not rows.size:
        return rows
    lead = rows[np.arange(len(rows)), (rows != 0).argmax(axis=1)]
    scaled, group = np.unique(rows / lead[:, None], axis=0, return_inverse=True)
    sizes = np.bincount(group.ravel(), np.abs(lead)) * UP  # a sum of many is rounded
    return np.asarray(scaled * sizes[:, None])


def _functions(row: "Row") -> "dict[Expr, fmpq]":
    """Write a sum of products of atoms in functions: one for each product without a step.

    Terms with the same steps are one function, step·(θ2 - a): it is small where the step is not
    known, and its terms are not. A constant is left out.
    """
    found: dict[Expr, fmpq] = {}
    by_steps: dict[Monomial, Row] = {}
    for m, c in row.items():
        steps = tuple((a, p) for a, p in m if a.kind == STEP)
        rest = tuple((a, p) for a, p in m if a.kind != STEP)
        if steps:
            by_steps.setdefault(steps, {})[rest] = c
        elif m and c != 0:
            found[Expr({m: ONE})] = c
    for steps, terms in by_steps.items():
        kept = sorted(((m, c) for m, c in terms.items() if c != 0), key=_place)
        if kept:
            lead = kept[0][1]
            sum_ = Expr({m: Fraction(int((c / lead).p), int((c / lead).q)) for m, c in kept})
            ((one, factor),) = as_factor(sum_).terms.items()
            found[Expr({monomial([*steps, *one]): factor})] = lead
    return found


def _place(term: "tuple[Monomial, fmpq]") -> list[tuple[tuple[int, str], int]]:
    return [(a.order, p) for a, p in term[0]]


def _in_chebyshev(rows: Rows) -> "dict[Powers, Row]":
    """Write Σ z^α f_α(Θ) as Σ c_d(z) f_d(Θ), with products c_d of Chebyshev polynomials."""
    found: dict[Powers, Row] = {}
    for powers, row in rows.items():
        factors = [[(z, k, weight) for k, weight in chebyshev(n).items()] for z, n in powers]
        for chosen in product(*factors):
            degrees = tuple((z, k) for z, k, _ in chosen if k)
            target = found.setdefault(degrees, {})
            p = q = 1
            for _, _, weight in chosen:
                p, q = p * weight.numerator, q * weight.denominator
            for m, c in row.items():
                term = c * p / q
                target[m] = target[m] + term if m in target else term
    return found
