"""Programs whose formulas are quadratics of Θ plus polynomials of its sines and cosines."""

from collections.abc import Callable, Mapping
from typing import Any

from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Polynomial, Ring
from rbstab.analysis.proof.traced.program import THETA, Operation, Program, computed
from rbstab.analysis.proof.traced.signs import meant
from rbstab.integrate.straight_line.number import ADD, DIVIDE, MULTIPLY, NEGATE, POWER, SUBTRACT

MOST_ENTRIES = 9
"""The entries of t = [1, cos θ, sin θ, ...]: U has at most four times an angle. One with more is
evaluated as a program, which is faster then."""


MOST_DEGREE = 20
"""A product of more sines, cosines and angles is not expanded: it may have millions of terms."""


class _NoPolynomialError(Exception):
    """An operation leads out of the polynomials."""


def is_polynomial(program: Program) -> bool:
    """Return whether a formula has this form."""
    energy = polynomial_of(program, Ring(3, 0))
    if energy is None:
        return False
    try:
        return len(form_of(energy).coefficients) <= MOST_ENTRIES
    except NotTrigonometric:
        return False


def polynomial_of(program: Program, ring: Ring) -> Polynomial | None:
    """Return a formula as a polynomial of a ring; None if it is none."""
    Theta = ring.variables().tolist()
    if max(_degrees(program)) > MOST_DEGREE:
        return None

    def leaf(operation: Operation) -> Polynomial:
        kind, number = operation
        found: Polynomial = Theta[number] if kind == THETA else ring.constant(meant(number))
        return found

    try:
        found: Polynomial = computed(program, leaf, _combined)[-1]
    except _NoPolynomialError:
        return None
    return found if found.known else None


def _degrees(program: Program) -> list[int]:
    """Return bounds on the degrees of all operations, as polynomials."""

    def combine(kind: str, x: int, *others: int) -> int:
        if kind == POWER:
            return x * max(others[0], 1)
        if kind == MULTIPLY:
            return x + others[0]
        return max(x, *others) if kind in {ADD, SUBTRACT} else x

    return computed(program, lambda leaf: int(leaf[0] == THETA), combine)


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
