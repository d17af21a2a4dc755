"""Derivatives of trigonometric forms are within their proved errors, which are near round-off."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbstab.analysis.proof.trigonometric import (
    ROUND_OFF,
    TrigonometricForm,
    rigorous_basis,
    trigonometric_basis,
)

ORDERS = range(4)


def random_form(rng, size=5):
    root = rng.normal(size=(3, 3))
    coefficients = rng.normal(size=(size,) * 3) * 10.0 ** rng.integers(-3, 4)
    return TrigonometricForm(root + root.T, rng.normal(size=3), coefficients)


def exact_derivative(form, Theta, axes):
    """Return the derivative along some axes in fifty digits, as a sum of shifted cosines."""
    with mpmath.workdps(50):
        total = mpmath.mpf(0)
        for place in np.ndindex(form.coefficients.shape):
            term = mpmath.mpf(float(form.coefficients[place]))
            for axis, index in enumerate(place):
                k, count = (index + 1) // 2, axes.count(axis)
                # The n-th derivative of cos kθ is cos(kθ + nπ/2) kⁿ; a sine lags a quarter turn.
                lag = count - (index > 0 and index % 2 == 0)
                phase = k * mpmath.mpf(float(Theta[axis])) + lag * mpmath.pi / 2
                term *= mpmath.cos(phase) * mpmath.mpf(k) ** count if k or count == 0 else 0
            total += term
        return total + polynomial_derivative(form, Theta, axes)


def polynomial_derivative(form, Theta, axes):
    Q, q = mpmath.matrix(form.quadratic.tolist()), mpmath.matrix(form.linear.tolist())
    x = mpmath.matrix(Theta.tolist())
    if len(axes) == 0:
        return (x.T * Q * x)[0] / 2 + (q.T * x)[0]
    if len(axes) == 1:
        return (Q * x)[axes[0]] + q[axes[0]]
    return Q[axes[0], axes[1]] if len(axes) == 2 else mpmath.mpf(0)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32), st.sampled_from([1, 3, 5]))
def test_derivatives_are_within_their_errors(seed, size):
    rng = np.random.default_rng(seed)
    form, Theta = random_form(rng, size), rng.uniform(-3.2, 3.2, size=3)
    for order, found in enumerate(form.rigorous(Theta[np.newaxis], 3)):
        for axes in [tuple(rng.integers(0, 3, size=order).tolist()) for _ in range(3)]:
            off = mpmath.mpf(float(found.values[(0, *axes)])) - exact_derivative(form, Theta, axes)
            assert abs(off) <= found.error[axes]


@pytest.mark.parametrize("order", ORDERS)
def test_errors_are_near_round_off(rng, order):
    form = random_form(rng)
    magnitude = np.abs(form.coefficients).sum() * 2**order + 16 * np.abs(form.quadratic).sum()
    assert np.all(form.round_off[order] < 1e-13 * magnitude)


def test_errors_grow_with_every_part(rng):
    # The error must count each of the three parts.
    for part in range(3):
        factors = [1e6 if part == k else 1e-6 for k in range(3)]
        form = random_form(rng)
        form = TrigonometricForm(
            form.quadratic * factors[0],
            form.linear * factors[1],
            form.coefficients / np.abs(form.coefficients).max() * factors[2],
        )
        assert np.all(form.round_off[1] > 1e-16 * 1e6 * 0.05)


def test_third_derivatives_change_no_faster_than_bounded(rng):
    form = random_form(rng)
    Theta = rng.uniform(-3, 3, size=(2000, 3))
    h = 1e-5
    for axis, shift in enumerate(h * np.eye(3)):
        ahead, behind = (form.approximate(Theta + sign * shift, 3)[3] for sign in (1, -1))
        seen = np.abs(ahead - behind).max(axis=0) / (2 * h)
        assert np.all(seen <= form.fourth_derivative_bound[..., axis] * (1 + 1e-6))


def test_fourth_derivative_bound_is_reached_by_one_wave():
    coefficients = np.zeros((5, 5, 5))
    coefficients[3, 1, 0], coefficients[4, 1, 0] = 3.0, 4.0
    form = TrigonometricForm(np.eye(3), np.ones(3), coefficients)
    # 5 cos(2θ1 - φ) cos θ2
    assert form.fourth_derivative_bound[0, 0, 0, 0] == pytest.approx(5 * 16)
    assert form.fourth_derivative_bound[0, 1, 1, 0] == pytest.approx(5 * 4)
    assert form.fourth_derivative_bound[0, 1, 2, 0] == 0


def test_round_off_of_sines_is_proved():
    Theta = np.random.default_rng(0).uniform(-4, 4, size=(100, 3))
    found = rigorous_basis(Theta, 2)
    with mpmath.workdps(40):
        for (row, axis), angle in np.ndenumerate(Theta):
            exact = [f(k * mpmath.mpf(angle)) for k in (1, 2) for f in (mpmath.cos, mpmath.sin)]
            off = [abs(mpmath.mpf(x) - y) for x, y in zip(found[row, axis, 1:], exact, strict=True)]
            assert max(off) <= ROUND_OFF
    np.testing.assert_array_equal(found[..., 0], 1)
    np.testing.assert_allclose(found, trigonometric_basis(Theta, 2), rtol=0, atol=1e-15)


def test_one_point_at_a_time_or_many_is_the_same(rng):
    form, Theta = random_form(rng), rng.uniform(-3, 3, size=(7, 3))
    together = form.approximate(Theta, 2)
    for row in range(7):
        for many, one in zip(together, form.approximate(Theta[row : row + 1], 2), strict=True):
            np.testing.assert_allclose(many[row], one[0], rtol=1e-11, atol=1e-11)


def test_no_points_at_all():
    form, nowhere = random_form(np.random.default_rng(0)), np.zeros((0, 3))
    for derivatives in (form.approximate(nowhere, 3), form.rigorous(nowhere, 3)):
        assert len(derivatives) == 4
    assert [d.values.shape for d in form.rigorous(nowhere, 2)] == [(0,), (0, 3), (0, 3, 3)]
