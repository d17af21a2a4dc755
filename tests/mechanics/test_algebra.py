"""Vector and matrix helpers give the textbook results, and their constants are read-only."""

from fractions import Fraction

import numpy as np
from support.differences import relative_error

from rbstab.mechanics.algebra import (
    cross,
    cross_matrix,
    inverse,
    quadratic_form,
    squared_norm,
)


def test_the_cross_product_and_its_matrix_are_numpy_s(rng):
    a, b = rng.normal(size=(2, 3))
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))
    assert relative_error(cross_matrix(a) @ b, np.cross(a, b)) < 1e-15


def test_inverse_is_exact_in_fractions_and_needs_no_symmetry():
    matrix = np.array([[2, -1, 3], [5, 4, -2], [1, 7, 6]]) * Fraction(1, 3)
    np.testing.assert_array_equal(inverse(matrix) @ matrix, np.eye(3))
    np.testing.assert_array_equal(matrix @ inverse(matrix), np.eye(3))


def test_quadratic_form_in_integers():
    matrix = np.array([[1, 2, 3], [4, 5, 6], [7, 8, 10]])
    # 1·1·1 + 2·(2 + 4) - (3 + 7) + 4·5 - 2·(6 + 8) + 10
    assert quadratic_form(matrix, np.array([1, 2, -1])) == 5


def test_squared_norm_of_a_pythagorean_quadruple():
    assert squared_norm(np.array([2, 3, -6])) == 7**2
