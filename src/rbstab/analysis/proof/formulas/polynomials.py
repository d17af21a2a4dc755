"""Programs whose formulas are polynomials: of Θ, its sines and cosines, and x = [X, D]."""

from collections.abc import Callable, Mapping
from math import comb
from typing import Any

from rbstab.analysis.proof.formulas.program import (
    LENGTH,
    THETA,
    Operation,
    Program,
    computed,
    part_of,
)
from rbstab.analysis.proof.formulas.terms import meant
from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Polynomial, Ring
from rbstab.integrate.straight_line.number import (
    ADD,
    CONSTANT,
    DIVIDE,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
)

MOST_ENTRIES = 9
"""The entries of t = [1, cos θ, sin θ, ...]: U has at most four times an angle. One with more is
evaluated as a program, which is faster then."""


_BEGINS = {THETA: 0, LENGTH: 3}
"""Where the variables of a kind begin in q = [Θ, x]."""

MOST_DEGREE = 20
"""A product of more sines, cosines and angles is not expanded: it may have millions of terms."""


MOST_PARTS = 1000
"""A formula with more terms is not taken apart."""


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


def taken_apart(program: Program, ring: Ring) -> tuple[list[Program], Program | None]:
    """Return the terms of a sum that are quadratic in x, and the sum of all others.

    Args:
        program: The sum; a term may be a number times a sum.
        ring: The ring of Θ and x.

    Returns:
        The quadratic terms, and the rest; None if nothing is left.
    """
    operations = list(program.operations)
    terms = _terms(operations, len(operations) - 1)
    if len(terms) > MOST_PARTS:
        return [], program
    quadratic, rest = list[Program](), list[int]()
    for term in terms:
        index = _built(operations, *term)
        part = part_of(operations, index)
        polynomial = polynomial_of(part, ring)
        if polynomial is not None and is_quadratic(polynomial):
            quadratic.append(part)
        else:
            rest.append(index)
    if not rest:
        return quadratic, None
    total, *others = rest
    for one in others:
        operations.append((ADD, total, one))
        total = len(operations) - 1
    return quadratic, part_of(operations, total)


_Step = tuple[str, int | None]
"""An operation on a term: its kind, and the index of a constant."""


def _terms(operations: list[Operation], index: int) -> list[tuple[int, tuple[_Step, ...]]]:
    """Return the terms of a sum, each with what is done to it, last step first."""

    def is_constant(one: int) -> bool:
        return operations[one][0] == CONSTANT

    found = list[tuple[int, tuple[_Step, ...]]]()
    pending = [(index, tuple[_Step, ...]())]
    while pending and len(found) <= MOST_PARTS:
        one, steps = pending.pop()
        kind, *operands = operations[one]
        if kind in {ADD, SUBTRACT}:
            first, second = operands
            pending += [(first, steps)]
            pending += [(second, steps if kind == ADD else (*steps, (NEGATE, None)))]
        elif kind == NEGATE:
            pending.append((operands[0], (*steps, (NEGATE, None))))
        elif kind in {MULTIPLY, DIVIDE} and is_constant(operands[1]):
            pending.append((operands[0], (*steps, (kind, operands[1]))))
        elif kind == MULTIPLY and is_constant(operands[0]):
            pending.append((operands[1], (*steps, (kind, operands[0]))))
        else:
            found.append((one, steps))
    return found


def _built(operations: list[Operation], index: int, steps: tuple[_Step, ...]) -> int:
    """Add the operations of a term; return the index of the last one."""
    for kind, constant in reversed(steps):
        operations.append((kind, index) if constant is None else (kind, index, constant))
        index = len(operations) - 1
    return index


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
