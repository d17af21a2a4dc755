"""Bounds on rounding errors are above the errors, computed in rational numbers."""

import math
from fractions import Fraction

import numpy as np
import pytest
from flint import acb, arb, fmpq, fmpq_mat

from rbstab.proof.motion.rounding import (
    error_of_inverse,
    error_of_products,
    magnitude_of,
    middle_and_radius,
    rounded_up,
)


@pytest.mark.parametrize(
    ("ball", "largest"),
    [
        (arb(0), 0.0),
        (arb(-3, 2), 5.0),
        (acb(arb(0, 3), arb(0, 4)), 5.0),
        (arb("1e-400"), 0.0),
        (1 / arb(0, 1), math.inf),
    ],
)
def test_the_upper_bound_is_above_every_number_of_a_ball(ball, largest):
    """A ball that contains zero is neither equal to zero nor different from it."""
    assert largest <= magnitude_of(ball) <= largest * (1 + 1e-7) + 1e-300
    assert magnitude_of(ball) > 0 or ball == arb(0)


def test_a_ball_is_within_its_radius_of_its_middle():
    ball = arb(1) / 3
    middle, radius = middle_and_radius(ball)
    assert abs(ball - middle) <= radius
    assert 0 < radius < 1e-16


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
