"""A lower bound of all matrices H_0 + Σ w_j H_j with |w_j| <= 1, as quadratic forms.

They are at least H_0 - Σ M_j for all M_j with -M_j <= H_j <= M_j. With the eigenvalues λ and any
vectors V, M = V|λ|V' is such a matrix for H = VλV'. If H has no negative eigenvalue, as that of a
stiffness, M is H: a change of all stiffnesses by a half leaves half. Bounds on single entries fail.
"""

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.index import negative_eigenvalues

GUESS = 1 - 1e-6
"""Factor on a computed eigenvalue, to get a bound that can be proved."""


class LowerBound(NamedTuple):
    """F H F' >= least > 0 for all matrices H of a family.

    Attributes:
        factor: F, shape (n, n), of doubles.
        least: The bound.
    """

    factor: Array
    least: float


def lower_bound(middle: Array, others: Array, error: Array) -> LowerBound | None:
    """Bound all matrices H_0 + Σ w_j H_j + E from below, with a proof in rational numbers.

    Args:
        middle: H_0, symmetric, shape (n, n).
        others: H_j, symmetric, shape (m, n, n).
        error: Bounds on the entries of |E|, shape (n, n).

    Returns:
        The bound; None if some of the matrices may not be positive definite.
    """
    if not (np.all(np.isfinite(middle)) and np.all(np.isfinite(others))):
        return None
    try:
        factor = np.linalg.inv(np.linalg.cholesky(middle))
    except np.linalg.LinAlgError:
        return None
    majorant, missing = _majorants(others)
    # The norm of a symmetric matrix is at most the largest sum of a row of magnitudes.
    left = (missing + float(error.sum(axis=1).max())) * (1 + 1e-12)
    if not np.all(np.isfinite(factor)) or not np.isfinite(left):
        return None
    one, F, H = np.eye(len(factor), dtype=int), _rational(factor), _rational(middle)
    least = F @ ((H + H.T) / 2 - majorant - Fraction(left) * one) @ F.T
    bound = float(np.linalg.eigvalsh(least.astype(float)).min()) * GUESS
    if not bound > 0 or negative_eigenvalues((least - Fraction(bound) * one).tolist()):
        return None
    return LowerBound(factor, bound)


def _majorants(matrices: Array) -> tuple[Array, float]:
    """Return a matrix M and e with -M - e <= Σ w_j H_j <= M + e for all |w_j| <= 1."""
    n = matrices.shape[-1]
    if not len(matrices):
        return _rational(np.zeros((n, n))), 0.0
    values, V = np.linalg.eigh(matrices)
    again = np.einsum("fik,fk,fjk->fij", V, values, V)
    size = np.einsum("fik,fk,fjk->fij", np.abs(V), np.abs(values), np.abs(V))
    majorants = np.einsum("fik,fk,fjk->fij", V, np.abs(values), V)
    # The rounding of both products; each entry is a sum of n products of three numbers.
    wrong = np.abs(matrices - again) + (4 * n + 16) * 2.0**-53 * (size + np.abs(matrices))
    # The sum over all is rounded too, and only its symmetric part counts.
    summed = majorants.sum(axis=0)
    lost = 2 * (len(matrices) + 4) * 2.0**-53 * np.abs(majorants).sum(axis=0)
    missing = float((wrong.sum(axis=0) + lost).sum(axis=1).max()) * (1 + 1e-9)
    return _rational(0.5 * (summed + summed.T)), missing + 1e-290


def _rational(matrix: Array) -> Array:
    return np.array([[Fraction(entry) for entry in row] for row in matrix.tolist()], dtype=object)
