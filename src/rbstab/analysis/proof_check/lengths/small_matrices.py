"""Small matrices in doubles: what is computed by them need not be exact."""

Rows = list[list[float]]

THREE = range(3)


def product(A: Rows, B: Rows) -> Rows:
    """Return AB."""
    return [
        [sum(a * b for a, b in zip(row, column, strict=True)) for column in turned(B)] for row in A
    ]


def turned(A: Rows) -> Rows:
    """Return the transpose."""
    return [list(column) for column in zip(*A, strict=True)]


def inverse(A: Rows) -> Rows:
    """Return the inverse of a matrix of three rows by cofactors; 0 for a singular one."""
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
    L = [[0.0] * len(A) for _ in A]
    for i in range(len(A)):
        for j in range(i + 1):
            left = A[i][j] - sum(L[i][k] * L[j][k] for k in range(j))
            L[i][j] = max(left, 1e-300) ** 0.5 if i == j else left / L[j][j]
    return L


def scaling(A: Rows) -> Rows:
    """Return the upper triangle B with B'AB = 1, so BB' = A⁻¹, for a positive definite A."""
    L, size = cholesky(A), range(len(A))
    found = [[0.0] * len(A) for _ in A]
    for j in size:
        for i in range(j, len(A)):
            left = float(i == j) - sum(L[i][k] * found[k][j] for k in range(j, i))
            found[i][j] = left / L[i][i]
    return turned(found)
