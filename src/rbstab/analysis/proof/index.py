"""The index of a symmetric matrix that is known up to an error, in rational numbers."""

from fractions import Fraction
from itertools import pairwise

import numpy as np

from rbstab.mechanics.numbers import Array


def proved_index(matrix: Array, error: Array) -> int | None:
    """Return the number of negative eigenvalues of every symmetric matrix within an error.

    If no eigenvalue of M is in [-s, s], and the error has a norm of at most s, then all these
    matrices have as many negative eigenvalues as M (Weyl), and none is singular. The eigenvalues
    of M below s and below -s are counted without round-off.

    Args:
        matrix: M, symmetric up to `error`, shape (3, 3), of doubles.
        error: The largest absolute error of each entry, shape (3, 3).

    Returns:
        The index; None if these matrices may differ in it.
    """
    rows, errors = _rational(matrix), _rational(error)
    if rows is None or errors is None:
        return None
    symmetric = [[(rows[i][j] + rows[j][i]) / 2 for j in range(3)] for i in range(3)]
    # The norm of a symmetric matrix is at most its largest sum of a row of magnitudes. The
    # symmetric part of an error has the mean of both errors.
    sums = [sum(errors[i][j] + errors[j][i] for j in range(3)) for i in range(3)]
    reach = Fraction(max(sums)) / 2
    below, above = (negative_eigenvalues(_shifted(symmetric, s)) for s in (reach, -reach))
    return below if below == above else None


def negative_eigenvalues(rows: list[list[Fraction]]) -> int | None:
    """Count the negative eigenvalues of a symmetric 3x3 matrix; None if it is singular.

    All roots of det(λI - M) = λ³ - tλ² + mλ - d are real. By Descartes' rule, the number of its
    negative roots is then the number of sign changes in 1, t, m, d.
    """
    (a, b, c), (_, d, e), (_, _, f) = rows
    minors = a * d - b * b + a * f - c * c + d * f - e * e
    determinant = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d)
    if determinant == 0:
        return None
    signs = [term > 0 for term in (Fraction(1), a + d + f, minors, determinant) if term != 0]
    return sum(one != other for one, other in pairwise(signs))


def _shifted(rows: list[list[Fraction]], shift: Fraction) -> list[list[Fraction]]:
    """Return M - shift I, which has as many negative eigenvalues as M has below the shift."""
    return [[rows[i][j] - shift * (i == j) for j in range(3)] for i in range(3)]


def _rational(matrix: Array) -> list[list[Fraction]] | None:
    if not np.all(np.isfinite(matrix)):
        return None
    return [[Fraction(entry) for entry in row] for row in matrix.tolist()]
