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
        matrix: M, symmetric up to `error`, shape (n, n), of doubles.
        error: The largest absolute error of each entry, shape (n, n).

    Returns:
        The index; None if these matrices may differ in it.
    """
    rows, errors = _rational(matrix), _rational(error)
    if rows is None or errors is None:
        return None
    places = range(len(rows))
    symmetric = [[(rows[i][j] + rows[j][i]) / 2 for j in places] for i in places]
    # The norm of a symmetric matrix is at most its largest sum of a row of magnitudes. The
    # symmetric part of an error has the mean of both errors.
    sums = [sum(errors[i][j] + errors[j][i] for j in places) for i in places]
    reach = Fraction(max(sums)) / 2
    below, above = (negative_eigenvalues(_shifted(symmetric, s)) for s in (reach, -reach))
    return below if below == above else None


def negative_eigenvalues(rows: list[list[Fraction]]) -> int | None:
    """Count the negative eigenvalues of a symmetric matrix; None if it is singular.

    All roots of p(λ) = det(λI - M) are real. By Descartes' rule, the number of its negative roots
    is then the number of sign changes in the coefficients of p(-λ).
    """
    from flint import fmpq, fmpq_mat  # imported late, as in `polynomial`

    matrix = fmpq_mat([[fmpq(x.numerator, x.denominator) for x in row] for row in rows])
    coefficients = matrix.charpoly().coeffs()
    if coefficients[0] == 0:
        return None
    signs = [(c > 0) == (k % 2 == 0) for k, c in enumerate(coefficients) if c != 0]
    return sum(one != other for one, other in pairwise(signs))


def _shifted(rows: list[list[Fraction]], shift: Fraction) -> list[list[Fraction]]:
    """Return M - shift I, which has as many negative eigenvalues as M has below the shift."""
    return [[x - shift * (i == j) for j, x in enumerate(row)] for i, row in enumerate(rows)]


def _rational(matrix: Array) -> list[list[Fraction]] | None:
    if not np.all(np.isfinite(matrix)):
        return None
    return [[Fraction(entry) for entry in row] for row in matrix.tolist()]
