"""A lower bound of all matrices H_0 + Σ w_j H_j with |w_j| <= 1, as quadratic forms.

They are at least H_0 - Σ M_j for all M_j with -M_j <= H_j <= M_j. With the eigenvalues λ and any
vectors V, M = V|λ|V' is such a matrix for H = VλV'. If H has no negative eigenvalue, as that of a
stiffness, M is H: a change of all stiffnesses by a half leaves half. Bounds on single entries fail.
"""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import UP
from rbstab.proof.enclosures.index import proved_index

GUESS = 1 - 1e-6
"""Factor on a computed eigenvalue, to get a bound that can be proved."""

ROUNDING = 1e-14
"""That of sums of products of three entries of small matrices, relative to the magnitudes."""


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
        F = np.linalg.inv(np.linalg.cholesky(middle))
    except np.linalg.LinAlgError:
        return None
    values, V = np.linalg.eigh(others)
    again, majorants, sizes = (
        np.einsum("fik,fk,fjk->fij", A, a, A)
        for A, a in ((V, values), (V, np.abs(values)), (np.abs(V), np.abs(values)))
    )
    size = np.abs(middle) + (np.abs(others) + sizes).sum(axis=0)
    wrong = error + np.abs(others - again).sum(axis=0) + ROUNDING * (1 + len(others)) * size
    least = F @ (middle - majorants.sum(axis=0)) @ F.T
    left = np.abs(F) @ (wrong + ROUNDING * size) @ np.abs(F).T * UP + 1e-290
    bound = float(np.linalg.eigvalsh(least).min()) * GUESS
    if not bound > 0 or proved_index(least - bound * np.eye(len(F)), left) != 0:
        return None
    return LowerBound(F, bound)
