"""Operations on 3-vectors and 3x3 matrices, for every kind of number (see `numbers`)."""

import numpy as np

from rbstab.mechanics.numbers import Array, Number, square

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
        substituted = sum((rows[k][j] * x[j] for j in range(k + 1, size)), start=0.0)
        x[k] = (rows[k][size] - substituted) / rows[k][k]
    return np.array(x)


def squared_norm(x: Array) -> Number:
    """Return x'x for a vector of shape (3,)."""
    x1, x2, x3 = x
    return square(x1) + square(x2) + square(x3)


def quadratic_form(matrix: Array, x: Array) -> Number:
    """Return x' M x for a vector of shape (3,) and a matrix of shape (3, 3).

    It is written in the squares and products of the entries: a compiled engine needs half as long
    for a square as for a product of two variables.
    """
    (m11, m12, m13), (m21, m22, m23), (m31, m32, m33) = matrix
    x1, x2, x3 = x
    squares = m11 * square(x1) + m22 * square(x2) + m33 * square(x3)
    # A zero comes first: where a product of two entries overflows, it stays zero.
    mixed = (m12 + m21) * x1 * x2 + (m23 + m32) * x2 * x3 + (m31 + m13) * x3 * x1
    return squares + mixed
