"""The index of a matrix is counted without round-off, or said to be unknown."""

import numpy as np
import pytest

from rbstab.proof.enclosures.index import proved_index

NO_ERROR = np.zeros((3, 3))


@pytest.mark.parametrize(
    ("diagonal", "index"),
    [
        ([1, 1, -2], 1),
        ([-1, -1, 2], 2),
        ([2, 2, -1], 1),
        ([1, 0, -1], None),
        ([1, np.inf, 1], None),
    ],
)
def test_the_index_of_a_diagonal_matrix(diagonal, index):
    """Also where the trace or the sum of the principal minors vanishes, and where none is known."""
    assert proved_index(np.diag(np.array(diagonal, dtype=float)), NO_ERROR) == index


def test_eigenvalue_within_the_error_leaves_it_open():
    matrix = np.diag([4.0, -3.0, 1e-3])
    for size, expected in ((0.9e-3, 1), (1.1e-3, None)):
        assert proved_index(matrix, size * np.eye(3)) == expected
        # The same error in the other entries of the row counts as well.
        assert proved_index(matrix, np.full((3, 3), size / 3)) == expected


def test_errors_are_never_exceeded(rng):
    """Every matrix within the error has the proved index."""
    proved = 0
    for _ in range(100):
        root = rng.normal(size=(3, 3))
        matrix, error = root + root.T, 0.3 * np.abs(rng.normal(size=(3, 3)))
        index = proved_index(matrix, error)
        if index is None:
            continue
        proved += 1
        for _ in range(20):
            shift = error * rng.choice([-1.0, 1.0], size=(3, 3))
            other = matrix + 0.5 * (shift + shift.T)
            assert np.sum(np.linalg.eigvalsh(other) < 0) == index
    assert proved > 30


def test_round_off_does_not_decide():
    """The smallest eigenvalue is 1e-17 of the largest, and eigenvalues in doubles miss its sign."""
    tiny = 2.0**-52
    rows = [[1.0, 1.0, 0.0], [1.0, 1.0 + tiny, 0.0], [0.0, 0.0, 1.0]]
    assert proved_index(np.array(rows), NO_ERROR) == 0
    rows[1][1] = 1.0 - tiny
    assert proved_index(np.array(rows), NO_ERROR) == 1
