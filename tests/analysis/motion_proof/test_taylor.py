"""The polynomial of a step, and the bounds around it, against values at many points."""

import numpy as np
import pytest
from flint import acb, arb

from rbstab.analysis.motion_proof.dual import Dual
from rbstab.analysis.motion_proof.taylor import (
    defect,
    disc_bounds,
    jacobian_series,
    jacobian_slopes,
    polynomial,
    step_for,
)

START = [0.5, -0.25]
H = 0.25
RATIO = 2.0
MARGIN = np.array([0.02, 0.01])


def field(y):
    """A smooth field with a pole at y2 = 2, for any kind of number."""
    a, b = y
    sine = a.sin() if isinstance(a, Dual) else np.sin(a)
    out = np.empty(2, dtype=object if isinstance(a, Dual) else np.result_type(a, b, float))
    out[0], out[1] = b * (1.0 / (2.0 - b)), sine - 0.5 * b * b
    return out


def jacobian(y):
    a, b = y
    return np.array([[0, 2 / (2 - b) ** 2], [np.cos(a), -b]])


def value(p, t):
    return np.array([sum(float(c) * t**k for k, c in enumerate(row)) for row in p])


def derivative(p, t):
    return np.array([sum(k * float(c) * t ** (k - 1) for k, c in enumerate(row) if k) for row in p])


def p_of(order):
    return polynomial(field, [arb(x) for x in START], order)


def bounds_of(p):
    return disc_bounds(field, p, H, RATIO, MARGIN)


def test_the_polynomial_follows_the_motion():
    p = p_of(12)
    for t in np.linspace(0, 0.1, 5):
        assert derivative(p, t) == pytest.approx(field(value(p, t)), abs=1e-10)
    assert [float(row[0]) for row in p] == START


@pytest.mark.parametrize("order", [1, 2, 3, 6])
def test_the_defect_is_below_its_bound(order):
    """With few terms, much of the bound is Cauchy's estimate of the terms that are left out."""
    p = p_of(order)
    bound = defect(field, p, H, RATIO, bounds_of(p))
    seen = [np.abs(field(value(p, t)) - derivative(p, t)) for t in np.linspace(0, H, 50)]
    assert np.all(np.max(seen, axis=0) <= bound)
    assert np.all(bound < 1e4 * np.max(seen, axis=0))


def test_the_terms_that_are_left_out_count():
    """The computed part alone, without Cauchy's estimate, is below the defect of this field."""
    p = p_of(1)
    bounds = bounds_of(p)
    computed = defect(field, p, H, RATIO, type(bounds)(0 * bounds.rates, bounds.jacobian))
    seen = np.abs(field(value(p, H)) - derivative(p, H))
    assert np.any(computed < seen)


def test_terms_that_cancel_at_the_end_of_a_step_count():
    """ẋ = t² - t³/h ends with the same slope as it begins, but p has the slope 0 in between."""

    def cancelling(y):
        t, _ = y
        out = np.empty(2, dtype=object)
        out[0], out[1] = 0.0 * t + 1.0, t * t - t * t * t * (1.0 / H)
        return out

    p = polynomial(cancelling, [arb(0), arb(0)], 2)
    bounds = disc_bounds(cancelling, p, H, 64.0, MARGIN)
    assert defect(cancelling, p, H, 64.0, bounds)[1] >= 4 / 27 * H**2


@pytest.mark.parametrize("terms", [1, 2, 5])
def test_the_jacobian_along_the_polynomial(terms):
    p = p_of(6)
    J = jacobian_series(jacobian_slopes(field, p, terms), terms, H, RATIO, bounds_of(p))
    for tau in np.linspace(0, 1, 20):
        powers = (tau ** np.arange(terms))[:, np.newaxis, np.newaxis]
        error = np.abs(jacobian(value(p, H * tau)) - (J.middle * powers).sum(axis=0))
        assert np.all(error <= J.radius.sum(axis=0) + J.rest)
    if terms == 1:
        end = np.abs(jacobian(value(p, H)) - J.middle[0])
        assert np.any(end > 1e-3), "the further terms must matter, or nothing is tested"


def test_the_bounds_hold_for_complex_times_and_states():
    p, rng = p_of(6), np.random.default_rng(7)
    bounds = bounds_of(p)
    for _ in range(300):
        t = RATIO * H * np.exp(1j * rng.uniform(0, 2 * np.pi)) * rng.uniform(0, 1) ** 0.2
        shift = MARGIN * np.exp(1j * rng.uniform(0, 2 * np.pi, 2))
        y = value(p, t) + shift
        assert np.all(np.abs(field(y)) <= bounds.rates)
        assert np.all(np.abs(jacobian(y)) <= bounds.jacobian)
    assert bounds.finite


def test_the_bounds_are_larger_off_the_real_axis():
    """sin is at most 1 for real numbers only."""

    def waves(y):
        out = np.empty(2, dtype=object)
        out[0], out[1] = 0.0 * y[0] + 1.0, (8.0 * y[0]).sin()
        return out

    p = polynomial(waves, [arb(0), arb(0)], 3)
    bounds = disc_bounds(waves, p, H, RATIO, MARGIN)
    assert bounds.rates[1] >= np.sinh(8 * RATIO * H)
    assert bounds.jacobian[1, 0] >= 8 * np.cosh(8 * RATIO * H)


def test_a_disc_that_reaches_a_pole_has_no_bounds():
    p = p_of(6)
    assert not disc_bounds(field, p, H, RATIO, np.array([0.02, 3.0])).finite


def test_the_last_terms_have_the_wanted_size():
    p = p_of(8)
    h = step_for(p, 1e-6, np.array([1.0, 2.0]))
    sizes = [
        abs(float(row[k])) * h**k / s for row, s in zip(p, (1, 2), strict=True) for k in (7, 8)
    ]
    assert max(sizes) == pytest.approx(1e-6, rel=1e-6)


def test_balls_of_both_kinds_are_accepted():
    y = np.array([Dual(acb(0.5)), Dual(acb(-0.25))], dtype=object)
    assert float(field(y)[1].value.real) == pytest.approx(field(np.array(START))[1])
