"""Polynomials in sines and cosines become sums over multiple angles; other terms are refused."""

import numpy as np
import pytest

from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Ring
from rbstab.mechanics.numbers import cos, sin


@pytest.fixture
def angles():
    return Ring(3, 1).variables()[:3]


def test_powers_and_products_of_sines_and_cosines(angles, rng):
    (s1, s2, s3), (c1, c2, c3) = sin(angles), cos(angles)
    polynomial = (s1 * c2 - s3 * 0.7) * (c1 * s2 * s2 + c3 * c3 * c3 * 2 - 1) + s1 * s1 * c1 * c2
    Theta = rng.uniform(-3, 3, size=(20, 3))
    (s1, s2, s3), (c1, c2, c3) = np.sin(Theta).T, np.cos(Theta).T
    expected = (s1 * c2 - s3 * 0.7) * (c1 * s2**2 + c3**3 * 2 - 1) + s1**2 * c1 * c2
    np.testing.assert_allclose(form_of(polynomial).value(Theta), expected, rtol=0, atol=1e-14)


def test_square_of_sine_and_cosine_make_one(angles):
    form = form_of(sin(angles)[0] * sin(angles)[0] + cos(angles)[0] * cos(angles)[0])
    assert np.count_nonzero(form.coefficients) == 1
    assert form.coefficients[0, 0, 0] == 1


def test_quadratic_and_linear_parts(angles, rng):
    a, b, c = angles
    form = form_of(3 * a * a - a * b * 4 + c * c * 0.5 + b * 6 - 7)
    np.testing.assert_array_equal(form.quadratic, [[6, -4, 0], [-4, 0, 0], [0, 0, 1]])
    np.testing.assert_array_equal(form.linear, [0, 6, 0])
    Theta = rng.normal(size=(5, 3))
    a, b, c = Theta.T
    expected = 3 * a**2 - 4 * a * b + 0.5 * c**2 + 6 * b - 7
    np.testing.assert_allclose(form.value(Theta), expected, rtol=1e-14)


@pytest.mark.parametrize("power", [0, 1])
def test_other_terms_are_refused(angles, power):
    a, b, _ = angles
    with pytest.raises(NotTrigonometric):
        form_of(b * sin(angles)[0] if power else a * a * b)


@pytest.mark.parametrize("times_an_angle", [True, False])
def test_a_length_left_over_is_refused(angles, times_an_angle):
    length = angles[0].ring.variables()[3]
    with pytest.raises(NotTrigonometric):
        form_of(length * angles[0] if times_an_angle else length + cos(angles)[0])
