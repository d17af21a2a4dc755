"""Whether the own states of an element of a user move down its energy while the body is at rest.

With the energy W, quadratic in the own states D, it is shown that

    dD/dt = -M ∂W/∂D,        M constant, M + M' positive definite,

where Ω = 0 and V = 0. So D is at rest exactly where ∂W/∂D = 0, and dW/dt < 0 elsewhere.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.exact import is_positive_definite
from rbstab.analysis.proof.formulas.polynomials import normal, polynomial_of
from rbstab.analysis.proof.formulas.program import Program, part_of
from rbstab.analysis.proof.polynomial import Polynomial, fraction
from rbstab.integrate.straight_line.number import CONSTANT, DIVIDE

if TYPE_CHECKING:
    from flint import fmpq_mat


def relaxes(energy: Polynomial, own: range, rates: Sequence[Program]) -> bool:
    """Return whether this is shown.

    Args:
        energy: W, in normal form.
        own: The entries of x that are D.
        rates: dD/dt where Ω = 0 and V = 0, as formulas of Θ and x that have a value everywhere.
    """
    ring = energy.ring
    found = [polynomial_of(_without_zeros(rate), ring) for rate in rates]
    known = [normal(rate) for rate in found if rate is not None]
    if len(known) < len(own):
        return False
    slopes = [energy.slope(i) for i in own]
    curvature = _constants([[one.slope(j) for j in own] for one in slopes])
    moves = _constants([[one.slope(j) for j in own] for one in known])
    if curvature is None or moves is None or curvature.det() == 0:
        return False
    M = -moves * curvature.inv()
    for i, rate in enumerate(known):
        moved = (ring.number(M[i, j]) * slope for j, slope in enumerate(slopes))
        if not normal(sum(moved, start=rate)).is_zero:
            return False
    rows = [[fraction(M[i, j]) for j in range(len(own))] for i in range(len(own))]
    return is_positive_definite(np.array(rows, dtype=object))


def _without_zeros(program: Program) -> Program:
    """Return a formula without quotients 0/x, such as the rate of a line at rest."""
    operations = program.operations
    zero = (CONSTANT, 0.0)
    return part_of(
        [
            zero if kind == DIVIDE and operations[operands[0]] == zero else (kind, *operands)
            for kind, *operands in operations
        ],
        len(operations) - 1,
    )


def _constants(rows: Sequence[Sequence[Polynomial]]) -> "fmpq_mat | None":
    """Return a matrix of constants; None if an entry is no constant."""
    values = [[one.constant_value for one in row] for row in rows]
    known = all(value is not None for row in values for value in row)
    return _matrix(values) if known else None


def _matrix(rows: Sequence[Sequence[Any]]) -> "fmpq_mat":
    from flint import fmpq_mat  # imported late, as in `polynomial`

    return fmpq_mat(rows)
