"""Operations on 3-vectors and 3x3 matrices, for every kind of number (see `numbers`)."""

import numpy as np

from rbstab.mechanics.numbers import Array, Number

ZERO = np.zeros(3)
ZERO.flags.writeable = False
IDENTITY = np.eye(3)
IDENTITY.flags.writeable = False
ZERO_MATRIX = np.zeros((3, 3))
ZERO_MATRIX.flags.writeable = False


def cross(a: Array, b: Array) -> Array:
    """Return a × b for two vectors of shape (3,); `numpy.cross` is eight times slower."""
    a1, a2, a3 = a
    b1, b2, b3 = b
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


def cross_matrix(a: Array) -> Array:
    """Return the matrix ǎ of shape (3, 3) with ǎ b = a × b (ˇ as in the paper)."""
    a1, a2, a3 = a
    return np.array([[0.0, -a3, a2], [a3, 0.0, -a1], [-a2, a1, 0.0]])


def inverse(matrix: Array) -> Array:
    """Invert a 3x3 matrix by cofactors.

    A pivoting solver would branch on values. The matrices here (inertias, gains, mobilities) are
    symmetric positive definite and well conditioned, so cofactors lose no accuracy.
    """
    a, b, c = matrix.T
    rows = np.array([cross(b, c), cross(c, a), cross(a, b)])
    return rows / (a @ rows[0])


def solved(matrix: Array, right: Array) -> Array:
    """Return the x with M x = b, for a symmetric positive definite matrix of any size.

    Such a matrix needs no pivots, so there is no branch on a value.

    Args:
        matrix: M, shape (n, n).
        right: b, shape (n,).
    """
    rows = [[*row, entry] for row, entry in zip(matrix.tolist(), right.tolist(), strict=True)]
    size = len(rows)
    for k in range(size):
        for i in range(k + 1, size):
            factor = rows[i][k] / rows[k][k]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    x: list[Number] = [0.0] * size
    for k in reversed(range(size)):
        known = sum((rows[k][j] * x[j] for j in range(k + 1, size)), start=0.0)
        x[k] = (rows[k][size] - known) / rows[k][k]
    return np.array(x)


def quadratic_form(matrix: Array, x: Array) -> Number:
    """Return x' M x."""
    return x @ matrix @ x
