"""Small matrices of balls. A comparison with what has no bound is false."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from flint import arb_mat

from rbstab.proof.check.taylor import Ball

Matrix = Any
"""An `arb_mat` of python-flint."""


def column(entries: Sequence[Ball]) -> Matrix:
    """Return a column."""
    return arb_mat([[x] for x in entries])


def part(M: Matrix, rows: Sequence[int], columns: Sequence[int] = (0,)) -> Matrix:
    """Return some rows and columns of a matrix.

    Args:
        M: The matrix.
        rows: The numbers of the rows.
        columns: The numbers of the columns; without them the first one.
    """
    return arb_mat([[M[i, j] for j in columns] for i in rows])


def inverse(H: Matrix) -> Matrix:
    """Return a matrix near the inverse of another; of no bounds if there is none."""
    return H.mid().inv(nonstop=True).mid()


def residual(Y: Matrix, H: Matrix) -> Matrix:
    """Return I - YH."""
    return arb_mat(Y.nrows(), Y.nrows(), 1) - Y * H


def negative(H: Matrix) -> int | None:
    """Return the number of negative eigenvalues of each symmetric matrix in H, or None.

    All roots of its characteristic polynomial are real. So as many are positive as its coefficients
    change their signs (Descartes); between opposite signs any coefficient adds none.
    """
    signs = [1 if c > 0 else -1 if c < 0 else 0 for c in H.charpoly()]
    inner = range(1, len(signs) - 1)
    signs = [
        s for k, s in enumerate(signs) if s or not (k in inner and signs[k - 1] * signs[k + 1] < 0)
    ]
    changes = sum(a != b for a, b in pairwise(signs))
    return None if 0 in signs else H.nrows() - changes
