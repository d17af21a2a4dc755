"""Polynomials in angles, their sines and cosines, and lengths have exact coefficients."""

from fractions import Fraction

import numpy as np
import pytest

from rbstab.analysis.proof.polynomial import Polynomial, Ring, fraction
from rbstab.mechanics.attitude import rate_matrix, rotation
from rbstab.mechanics.numbers import cos, sin


@pytest.fixture
def ring():
    return Ring(3, 2)


@pytest.fixture
def variables(ring):
    return ring.variables()


def at(polynomial, Theta, x):
    """Return the value in floats, summed term by term."""
    values = np.concatenate([Theta, np.sin(Theta), np.cos(Theta), x])
    return sum(
        float(fraction(coefficient)) * np.prod(values ** np.array(powers))
        for powers, coefficient in polynomial.terms()
    )


def test_arithmetic_means_what_it_says(variables, rng):
    values = rng.normal(size=5)
    a, b, c, x, y = variables
    p, q, r, s, t = values
    expression = (1 - a * 0.3 + b) * (x - y) / 7 - 2.5 * (-c) * y + (x * 0.1 - 4)
    expected = (1 - p * 0.3 + q) * (s - t) / 7 - 2.5 * (-r) * t + (s * 0.1 - 4)
    assert at(expression, values[:3], values[3:]) == pytest.approx(expected, rel=1e-13)


def test_rotation_of_polynomials_is_that_of_floats(variables, rng):
    Theta = rng.uniform(-3, 3, size=3)
    rotated = rotation(variables[:3]) @ np.array([0.15, 0.1, -0.42])
    found = [at(entry, Theta, np.zeros(2)) for entry in rotated]
    expected = rotation(Theta) @ np.array([0.15, 0.1, -0.42])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)


def test_coefficients_are_exact(ring):
    x = ring.variables()[3]
    (_, coefficient), *others = (x * 0.1 + x * 0.2).terms()
    assert not others
    # In doubles 0.1 + 0.2 is rounded.
    assert fraction(coefficient) == Fraction(0.1) + Fraction(0.2)


def test_what_cancels_is_gone(variables):
    a, b = variables[3:]
    assert list(((a + b) * (a - b) - a * a + b * b).terms()) == []


def test_arrays_of_polynomials_multiply_entry_by_entry(ring, variables):
    scaled = ring.constant(2.0) * variables
    assert scaled.shape == (5,)
    assert all(isinstance(entry, Polynomial) for entry in scaled)
    assert at(variables @ variables, np.arange(3.0), np.arange(2.0)) == 6


@pytest.mark.parametrize("unknown", [lambda a: 1.0 / a, lambda a: (a + 1).sin(), lambda a: a / a])
def test_what_is_no_polynomial_is_unknown_and_stays_so(variables, unknown):
    a, x = variables[0], variables[3]
    lost = unknown(a)
    assert not lost.known
    for later in (lost + 1, 1 - lost, x * lost, -lost, lost / 2, 2 / lost, lost.sin(), lost.cos()):
        assert not later.known


def test_lengths_have_no_sine(variables):
    assert not variables[3].sin().known
    assert variables[2].cos().known


def test_rate_matrix_may_be_formed(variables):
    known = [[entry.known for entry in row] for row in rate_matrix(variables[:3])[:, :2]]
    assert known == [[False, False], [True, True], [False, False]]


def test_division_by_a_constant(ring, variables):
    x = variables[3]
    for divisor in (4, 4.0, ring.constant(4)):
        assert at(x / divisor, np.zeros(3), np.array([2.0, 0.0])) == 0.5
    assert at(1 / ring.constant(4), np.zeros(3), np.zeros(2)) == 0.25
    assert not (x / 0).known


def test_division_by_a_constant_that_is_zero(ring, variables):
    assert not (variables[3] / ring.constant(0)).known


def test_coefficients_of_the_lengths(variables):
    a, b, _, x, y = variables
    energy = a * 3 + b * x * 5 + x * x * 7 + x * y * 11 + sin(variables[:3])[0] * y
    assert energy.degree == 2
    Theta, nowhere = np.array([0.3, 0.5, 0.7]), np.array([9.0, 9.0])
    assert at(energy.length_coefficient(), Theta, nowhere) == pytest.approx(0.9)
    assert at(energy.length_coefficient(0), Theta, nowhere) == pytest.approx(2.5)
    assert at(energy.length_coefficient(1), Theta, nowhere) == pytest.approx(np.sin(0.3))
    assert fraction(energy.length_coefficient(0, 0).constant_value) == 7
    assert fraction(energy.length_coefficient(1, 0).constant_value) == 11
    assert fraction(energy.length_coefficient(1, 1).constant_value) == 0


def test_constant_value(ring, variables):
    assert fraction(ring.constant(0.1).constant_value) == Fraction(0.1)
    assert fraction((variables[0] * 0).constant_value) == 0
    assert cos(variables[:3])[1].constant_value is None
    assert (1 / variables[0]).constant_value is None


def test_degree_counts_lengths_alone(variables):
    a, _, _, x, y = variables
    assert (a * a * a).degree == 0
    assert (x * y * y + a).degree == 3
    assert (a * 0).degree == 0
