"""The index of a matrix is counted without round-off, or said to be unknown."""

from fractions import Fraction

import numpy as np
import pytest

from rbstab.proof.enclosures.index import negative_eigenvalues, proved_index

NO_ERROR = np.zeros((3, 3))


def congruent(rng, signs):
    """Return P'DP with integer entries: by Sylvester's law it has the signs of D."""
    while True:
        P = rng.integers(-4, 5, size=(3, 3)).astype(float)
        if round(np.linalg.det(P)) != 0:
            return P.T @ np.diag(signs) @ P


@pytest.mark.parametrize("index", range(4))
def test_signs_survive_a_change_of_coordinates(rng, index):
    for _ in range(50):
        scales = 2.0 ** rng.integers(-20, 20, size=3)
        signs = rng.permutation([-1.0] * index + [1.0] * (3 - index))
        assert proved_index(congruent(rng, signs * scales), NO_ERROR) == index


def test_zero_among_the_invariants_is_no_sign():
    # The trace vanishes, but no eigenvalue does.
    assert proved_index(np.diag([1.0, 1.0, -2.0]), NO_ERROR) == 1
    assert proved_index(np.diag([-1.0, -1.0, 2.0]), NO_ERROR) == 2
    # Here the sum of the principal minors vanishes: 2·2 - 2·1 - 2·1.
    assert proved_index(np.diag([2.0, 2.0, -1.0]), NO_ERROR) == 1


def test_singular_matrix_has_no_index():
    assert proved_index(np.diag([1.0, 0.0, -1.0]), NO_ERROR) is None
    assert negative_eigenvalues([[Fraction(0)] * 3] * 3) is None


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


def test_numbers_that_are_not_finite_have_no_index():
    assert proved_index(np.diag([1.0, np.inf, 1.0]), NO_ERROR) is None
    assert proved_index(np.eye(3), np.full((3, 3), np.nan)) is None
