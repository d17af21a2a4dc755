"""Matrices of three rows in doubles: what is computed by them need not be exact."""

Rows = list[list[float]]

THREE = range(3)


def product(A: Rows, B: Rows) -> Rows:
    """Return AB."""
    return [[sum(A[i][k] * B[k][j] for k in THREE) for j in THREE] for i in THREE]


def turned(A: Rows) -> Rows:
    """Return the transpose."""
    return [[A[j][i] for j in THREE] for i in THREE]


def inverse(A: Rows) -> Rows:
    """Return the inverse by cofactors; 0 for a singular matrix."""
    (a, b, c), (d, e, f), (g, h, k) = A
    rows = [
        [e * k - f * h, c * h - b * k, b * f - c * e],
        [f * g - d * k, a * k - c * g, c * d - a * f],
        [d * h - e * g, b * g - a * h, a * e - b * d],
    ]
    determinant = a * rows[0][0] + b * rows[1][0] + c * rows[2][0]
    if determinant == 0:
        return [[0.0] * 3 for _ in THREE]
    return [[one / determinant for one in row] for row in rows]


def cholesky(A: Rows) -> Rows:
    """Return the lower triangle L with LL' = A, for a positive definite A."""
    L = [[0.0] * 3 for _ in THREE]
    for i in THREE:
        for j in range(i + 1):
            left = A[i][j] - sum(L[i][k] * L[j][k] for k in range(j))
            L[i][j] = max(left, 1e-300) ** 0.5 if i == j else left / L[j][j]
    return L
