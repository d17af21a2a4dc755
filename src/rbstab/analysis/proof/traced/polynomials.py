"""Programs whose formulas are polynomials: of Θ, its sines and cosines, and x = [X, D]."""

from collections.abc import Callable, Mapping
from math import comb
from typing import Any

from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Polynomial, Ring
from rbstab.analysis.proof.traced.program import LENGTH, THETA, Operation, Program, computed
from rbstab.analysis.proof.traced.terms import meant
from rbstab.integrate.straight_line.number import ADD, DIVIDE, MULTIPLY, NEGATE, POWER, SUBTRACT

MOST_ENTRIES = 9
"""The entries of t = [1, cos θ, sin θ, ...]: U has at most four times an angle. One with more is
evaluated as a program, which is faster then."""


_BEGINS = {THETA: 0, LENGTH: 3}
"""Where the variables of a kind begin in q = [Θ, x]."""

MOST_DEGREE = 20
"""A product of more sines, cosines and angles is not expanded: it may have millions of terms."""


class _NoPolynomialError(Exception):
    """An operation leads out of the polynomials."""


def is_polynomial(program: Program) -> bool:
    """Return whether a formula of Θ is a quadratic plus a polynomial of sines and cosines."""
    energy = polynomial_of(program, Ring(3, 0))
    if energy is None:
        return False
    try:
        return len(form_of(energy).coefficients) <= MOST_ENTRIES
    except NotTrigonometric:
        return False


def polynomial_of(program: Program, ring: Ring) -> Polynomial | None:
    """Return a formula as a polynomial of a ring; None if it is none."""
    q = ring.variables().tolist()
    if max(_degrees(program)) > MOST_DEGREE:
        return None

    def leaf(operation: Operation) -> Polynomial:
        kind, number = operation
        if kind not in _BEGINS:
            return ring.constant(meant(number))
        found: Polynomial = q[_BEGINS[kind] + number]
        return found

    try:
        found: Polynomial = computed(program, leaf, _combined)[-1]
    except _NoPolynomialError:
        return None
    if not found.known:
        return None
    return found if program.of_angles else normal(found)


def is_quadratic(polynomial: Polynomial) -> bool:
    """Return whether a polynomial is quadratic in x, with constant second derivatives."""
    for powers, _ in polynomial.terms():
        term = polynomial.ring.split(powers)
        of_angles = any(term.angles + term.sines + term.cosines)
        if sum(term.lengths) > 2 - of_angles:
            return False
    return True


def normal(polynomial: Polynomial) -> Polynomial:
    """Return an equal polynomial in which no sine has a square: sin² θ = 1 - cos² θ."""
    ring = polynomial.ring
    found = dict[tuple[int, ...], Any]()
    for powers, coefficient in polynomial.terms():
        for term, factor in _without_squares(powers, range(ring.angles, 2 * ring.angles)):
            found[term] = found.get(term, 0) + coefficient * factor
    return Polynomial(ring, ring.context.from_dict(found))


def _without_squares(powers: tuple[int, ...], sines: range) -> list[tuple[tuple[int, ...], int]]:
    """Return a product of powers as a sum of such products, each with a whole number."""
    terms = [(powers, 1)]
    for place in sines:
        half, cosine = powers[place] // 2, place + len(sines)
        terms = [
            (_shifted(term, {place: -2 * half, cosine: 2 * k}), factor * (-1) ** k * comb(half, k))
            for term, factor in terms
            for k in range(half + 1)
        ]
    return terms


def _shifted(powers: tuple[int, ...], changes: Mapping[int, int]) -> tuple[int, ...]:
    return tuple(power + changes.get(place, 0) for place, power in enumerate(powers))


def _degrees(program: Program) -> list[int]:
    """Return bounds on the degrees of all operations, as polynomials."""

    def combine(kind: str, x: int, *others: int) -> int:
        if kind == POWER:
            return x * max(others[0], 1)
        if kind == MULTIPLY:
            return x + others[0]
        return max(x, *others) if kind in {ADD, SUBTRACT} else x

    return computed(program, lambda leaf: int(leaf[0] in _BEGINS), combine)


def _combined(kind: str, *operands: Any) -> Polynomial:
    if kind not in _OPERATIONS:
        raise _NoPolynomialError
    return _OPERATIONS[kind](*operands)


def _power(base: Polynomial, exponent: int) -> Polynomial:
    if not 0 < exponent <= MOST_ENTRIES:
        raise _NoPolynomialError
    found = base
    for _ in range(exponent - 1):
        found = found * base
    return found


_OPERATIONS: Mapping[str, Callable[..., Polynomial]] = {
    ADD: Polynomial.__add__,
    SUBTRACT: Polynomial.__sub__,
    MULTIPLY: Polynomial.__mul__,
    DIVIDE: Polynomial.__truediv__,
    NEGATE: Polynomial.__neg__,
    POWER: _power,
    "sin": Polynomial.sin,
    "cos": Polynomial.cos,
}
