"""The index of a symmetric matrix that is known up to an error, in rational numbers."""

from fractions import Fraction

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.matrices import negative_eigenvalues


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
    if not np.isfinite([matrix, error]).all():
        return None
    M, errors = (
        np.array([[Fraction(x) for x in row] for row in entries.tolist()])
        for entries in (matrix, error)
    )
    # The norm of a symmetric matrix is at most its largest sum of a row of magnitudes. The
    # symmetric part of an error has the mean of both errors.
    reach = (errors + errors.T).sum(axis=1).max() / 2 * np.eye(len(M), dtype=int)
    below, above = (
        negative_eigenvalues(((M + M.T) / 2 + shift).tolist()) for shift in (-reach, reach)
    )
    return below if below == above else None
