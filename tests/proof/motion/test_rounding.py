"""Bounds on rounding errors are above the errors, computed in rational numbers."""

import math
from fractions import Fraction

import numpy as np
import pytest
from flint import acb, arb

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
        (arb(0, 1), 1.0),
        (arb(-3, 2), 5.0),
        (arb(3), 3.0),
        (acb(arb(0, 3), arb(0, 4)), 5.0),
        (arb("1e-400"), 0.0),
    ],
)
def test_the_upper_bound_is_above_every_number_of_a_ball(ball, largest):
    """A ball that contains zero is neither equal to zero nor different from it."""
    assert largest <= magnitude_of(ball) <= largest * (1 + 1e-7) + 1e-300
    assert magnitude_of(ball) > 0


def test_zero_and_what_is_not_finite():
    assert magnitude_of(arb(0)) == 0.0
    assert magnitude_of(arb("nan")) == math.inf
    assert magnitude_of(1 / arb(0, 1)) == math.inf
    assert magnitude_of(arb("1e400")) == math.inf


def test_a_ball_is_within_its_radius_of_its_middle():
    ball = arb(1) / 3
    middle, radius = middle_and_radius(ball)
    assert abs(ball - middle) <= radius
    assert 0 < radius < 1e-16


def exact(matrix):
    return [[Fraction(x) for x in row] for row in matrix.tolist()]


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
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(4, 4)) * 10.0 ** rng.uniform(-spread, spread, size=(4, 1))
    inverse = np.linalg.inv(matrix)
    bound = error_of_inverse(matrix, inverse)
    assert bound is not None
    true = exact_inverse(exact(matrix))
    error = [
        [abs(t - x) for t, x in zip(*rows, strict=True)]
        for rows in zip(true, exact(inverse), strict=True)
    ]
    assert all(
        e <= Fraction(b)
        for rows in zip(error, bound.tolist(), strict=True)
        for e, b in zip(*rows, strict=True)
    )
    assert bound.max() < 1e-8 * np.abs(inverse).max()


def test_an_inverse_that_is_not_proved():
    assert np.isinf(error_of_inverse(np.eye(2), 2.1 * np.eye(2))).all()
    assert np.isinf(error_of_inverse(np.eye(2), np.full((2, 2), np.nan))).all()


def test_many_inverses_at_once():
    matrices = np.array([np.eye(2), 3 * np.eye(2)])
    errors = error_of_inverse(matrices, np.array([np.eye(2), 2 * np.eye(2)]))
    assert np.isfinite(errors[0]).all()
    assert np.isinf(errors[1]).all()


def exact_inverse(rows):
    """Invert a matrix of fractions by Gauss and Jordan."""
    n = len(rows)
    work = [row[:] + [Fraction(int(i == k)) for i in range(n)] for k, row in enumerate(rows)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(work[i][k]))
        work[k], work[pivot] = work[pivot], work[k]
        work[k] = [x / work[k][k] for x in work[k]]
        for i in range(n):
            if i != k:
                work[i] = [x - work[i][k] * y for x, y in zip(work[i], work[k], strict=True)]
    return [row[n:] for row in work]
