"""How the position of a tied body enters its energy: as a spring, and in the lines of elements.

Without the lengths of its lines the stored energy is quadratic in x = [X, D]. With z = X - X*(Θ)
and the least energy over D it is U(Θ) + ½ z'Sz, and a line has e = z + r(Θ).
"""

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Polynomial, fraction
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

POSITION = range(3)
"""The places of X in x."""


class PositionSpring(NamedTuple):
    """The part ½ z'Sz of an energy; each number is exact and rounded once.

    Attributes:
        stiffness: S = ((H⁻¹)_XX)⁻¹, shape (3, 3), N/m.
        compliance: S⁻¹, shape (3, 3), m/N.
        own: H_DD⁻¹H_DX, shape (own states, 3): D = D* minus this times z.
    """

    stiffness: Array
    compliance: Array
    own: Array


def position_spring(inverse: Sequence[Sequence[Polynomial]]) -> PositionSpring:
    """Return the spring that the position feels.

    Args:
        inverse: H⁻¹, whose entries are constants (`inverse_stiffness`).
    """
    rows = [[_number(entry) for entry in row] for row in inverse]
    block = [[rows[i][j] for j in POSITION] for i in POSITION]
    return PositionSpring(_rounded(_inverse(block)), _rounded(block), _own(rows))


def _rounded(rows: list[list[Fraction]]) -> Array:
    return np.array([[float(entry) for entry in row] for row in rows])


def offset(square: Polynomial, minimizer: Sequence[Polynomial]) -> tuple[TrigonometricForm, ...]:
    """Return r(Θ) of a line with the squared length |X + ρ(Θ)|²: ρ + X*.

    Raises:
        NotTrigonometric: The square is none of this form.
    """
    lengths = range(square.ring.lengths)
    shift = [square.length_coefficient(i) * 0.5 for i in POSITION]
    of_X = {(i, i): 1 for i in POSITION}
    zeros = [square.length_coefficient() - sum((one * one for one in shift), start=0 * square)]
    zeros += [square.length_coefficient(i) for i in lengths if i not in POSITION]
    zeros += [
        square.length_coefficient(i, j) - of_X.get((i, j), 0) for i in lengths for j in lengths[i:]
    ]
    # A form is unique, so it shows whether a polynomial in sines and cosines is zero.
    if square.degree > 2 or any(np.any(periodic(zero).coefficients) for zero in zeros):
        raise NotTrigonometric
    return tuple(periodic(one + minimizer[i]) for i, one in enumerate(shift))


def periodic(value: Polynomial) -> TrigonometricForm:
    """Return a form without powers of angles: bounds on lines hold for all Θ.

    Raises:
        NotTrigonometric: It has some.
    """
    form = form_of(value)
    if np.any(form.quadratic) or np.any(form.linear):
        raise NotTrigonometric
    return form


def _own(compliance: list[list[Fraction]]) -> Array:
    """Return H_DD⁻¹H_DX = -(H⁻¹)_DX ((H⁻¹)_XX)⁻¹."""
    C = np.array([[float(entry) for entry in row] for row in compliance])
    found: Array = -C[3:, :3] @ np.linalg.inv(C[:3, :3])
    return found


def _number(constant: Polynomial) -> Fraction:
    value = constant.constant_value
    assert value is not None
    return fraction(value)


def _inverse(rows: list[list[Fraction]]) -> list[list[Fraction]]:
    from flint import fmpq, fmpq_mat  # imported late, as in `polynomial`

    matrix = fmpq_mat([[fmpq(x.numerator, x.denominator) for x in row] for row in rows]).inv()
    return [[fraction(matrix[i, j]) for j in range(3)] for i in range(3)]
