"""Bounds on rounding errors are above the errors, computed in rational numbers."""

from fractions import Fraction

import numpy as np
import pytest
from flint import fmpq, fmpq_mat

from rbstab.proof.motion.rounding import error_of_inverse, error_of_products, rounded_up


def test_errors_of_products_and_sums():
    rng = np.random.default_rng(1)
    for _ in range(50):
        a, b = rng.normal(size=(2, 12)) * 10.0 ** rng.integers(-8, 8, size=(2, 12))
        true = sum(Fraction(x) * Fraction(y) for x, y in zip(a.tolist(), b.tolist(), strict=True))
        size = sum(abs(Fraction(x) * Fraction(y)) for x, y in zip(a, b, strict=True))
        assert abs(Fraction(float(a @ b)) - true) <= Fraction(
            float(error_of_products(np.abs(a) @ np.abs(b)))
        )
        assert Fraction(float(rounded_up(np.abs(a) @ np.abs(b)))) >= size


@pytest.mark.parametrize("spread", [0, 3])
def test_the_error_of_an_inverse(spread):
    """It is known in rational numbers; of what is no inverse, and of no numbers, nothing is."""
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(4, 4)) * 10.0 ** rng.uniform(-spread, spread, size=(4, 1))
    inverse = np.linalg.inv(matrix)
    wrong = [inverse, 2.1 * inverse, np.nan * inverse]
    bound, *none = error_of_inverse(np.array([matrix] * 3), np.array(wrong))
    true = inverse_exactly(matrix)
    error = np.abs(true - inverse.astype(object) * Fraction(1))
    assert np.all(error <= bound)
    assert bound.max() < 1e-8 * np.abs(inverse).max()
    assert np.isinf(none).all()


def inverse_exactly(matrix):
    """Return the inverse of doubles in fractions."""
    rows = fmpq_mat([[fmpq(*x.as_integer_ratio()) for x in row] for row in matrix.tolist()])
    return np.array([[Fraction(int(x.p), int(x.q)) for x in row] for row in rows.inv().tolist()])
