"""Symmetric matrices of rational numbers: their index, and the inverse of a definite one."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

Rows = Sequence[Sequence[Fraction]]


def rational_matrix(rows: Rows) -> Any:
    """Return a matrix of python-flint."""
    from flint import fmpq, fmpq_mat  # imported late: few commands make proofs

    return fmpq_mat([[fmpq(x.numerator, x.denominator) for x in row] for row in rows])


def negative_eigenvalues(rows: Rows) -> int | None:
    """Count the negative eigenvalues of a symmetric matrix; None if it is singular.

    All roots of p(λ) = det(λI - M) are real. By Descartes' rule, the number of its negative roots
    is then the number of sign changes in the coefficients of p(-λ).
    """
    coefficients = rational_matrix(rows).charpoly().coeffs()
    if coefficients[0] == 0:
        return None
    signs = [(c > 0) == (k % 2 == 0) for k, c in enumerate(coefficients) if c != 0]
    return sum(sign != other for sign, other in pairwise(signs))


def inverse_of_definite(rows: Rows) -> list[list[Fraction]] | None:
    """Return the inverse of a symmetric matrix; None if it is not positive definite."""
    if negative_eigenvalues(rows) != 0:
        return None
    inverse = rational_matrix(rows).inv().tolist()
    return [[Fraction(int(x.p), int(x.q)) for x in row] for row in inverse]
