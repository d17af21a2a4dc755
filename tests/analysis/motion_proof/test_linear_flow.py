"""Bounds on the linear part of a step hold at every time of it, with few terms as with many."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rbstab.analysis.motion_proof.linear_flow import (
    Frame,
    frame_of,
    frames_of,
    linear_bounds,
    linear_flow,
)
from rbstab.analysis.motion_proof.taylor import JacobianSeries

H = 0.4
TAUS = np.linspace(0, 1, 21)


def jacobian(tau):
    """Return J(τ), of which a series has only the first terms."""
    return np.array([[np.sin(tau), 2.0, 0.0], [-3.0, -1 / (3 - tau), 0.5], [0.2, np.cos(tau), -2]])


def series(terms):
    """Return the Taylor series of `jacobian`, by Cauchy's integral, with its rest for |τ| <= 1."""
    points = np.exp(2j * np.pi * np.arange(64) / 64)
    values = np.array([jacobian(2 * z) for z in points])
    # The aliasing error of 64 points at |τ| = 2 is 2⁻⁶⁴ of the values.
    found = [np.mean(values / (2 * points)[:, None, None] ** k, axis=0).real for k in range(40)]
    middle = np.array(found[:terms])
    rest = np.abs(found[terms:]).sum(axis=0)
    return JacobianSeries(middle, np.full_like(middle, 1e-14), rest + 1e-10)


def value(coefficients, tau):
    return sum(matrix * tau**k for k, matrix in enumerate(coefficients))


def slope(coefficients, tau):
    return sum(k * matrix * tau ** (k - 1) for k, matrix in enumerate(coefficients) if k)


def skew_frame() -> Frame:
    frame = frame_of(np.array([[1.0, 0.3, 0.0], [-0.2, 2.0, 0.1], [0.0, 0.4, 0.5]]))
    assert frame is not None
    return frame


FRAME = skew_frame()


def test_the_flow_is_that_of_the_linear_equation():
    flow = linear_flow(series(28), H)

    def rates(tau, Phi):
        return (H * jacobian(tau) @ Phi.reshape(3, 3)).ravel()

    solved = solve_ivp(rates, (0, 1), np.eye(3).ravel(), rtol=1e-12, atol=1e-12, method="DOP853")
    end, error = flow.forward_at_end
    assert end == pytest.approx(solved.y[:, -1].reshape(3, 3), abs=1e-9)
    assert value(flow.backward, 1.0) @ end == pytest.approx(np.eye(3), abs=1e-9)
    assert error.max() < 1e-9


@pytest.mark.parametrize("terms", [1, 2, 4, 12])
def test_every_bound_holds_at_every_time(terms):
    flow = linear_flow(series(terms), H)
    bounds = linear_bounds(flow, FRAME)
    Q, inverse = FRAME.matrix, np.linalg.inv(FRAME.matrix)
    integral = np.zeros((3, 3))
    before = None
    for tau in TAUS:
        Phi, Psi = value(flow.forward, tau), value(flow.backward, tau)
        assert np.all(np.abs(Phi @ Q) <= bounds.forward)
        assert np.all(np.abs(inverse @ Psi) <= bounds.backward)
        assert np.all(np.abs(np.eye(3) - Phi @ Psi) <= bounds.mismatch)
        residual = inverse @ (slope(flow.backward, tau) + H * Psi @ jacobian(tau))
        if before is not None:
            integral = integral + 0.05 * 0.5 * (before + residual)
        before = residual
        # The trapezoidal rule has a relative error of about 1e-3 here.
        assert np.all(np.abs(integral) <= bounds.residual * (1 + 5e-3))
    if terms == 1:
        assert np.abs(integral).max() > 0.05 * bounds.residual.max(), "the bound is far too wide"


def test_without_the_rest_of_the_series_the_bound_fails():
    short = series(1)
    flow = linear_flow(JacobianSeries(short.middle, short.radius, 0 * short.rest), H)
    with_rest, without = linear_bounds(linear_flow(short, H), FRAME), linear_bounds(flow, FRAME)
    assert np.all(without.residual < with_rest.residual)


def test_the_last_term_decides_by_scaled_states():
    flow = linear_flow(series(2), H)
    plain = flow.last_term(np.ones(3))
    assert plain == pytest.approx(np.linalg.norm(flow.forward[-1], 2))
    scale = np.array([1.0, 10.0, 0.1])
    expected = np.linalg.norm(np.diag(1 / scale) @ flow.forward[-1] @ np.diag(scale), 2)
    assert flow.last_term(scale) == pytest.approx(expected)


def test_a_singular_frame_is_refused():
    assert frame_of(np.array([[1.0, 1.0], [1.0, 1.0 + 1e-16]]) + np.diag([0, 1e-17])) is None


def test_frames_that_have_no_inverse_are_told_from_those_beside_them(rng):
    """Singular ones and such with NaN, among good ones, which stay as they are, bit for bit."""
    good = rng.uniform(-1, 1, (4, 5, 5)) + 3 * np.eye(5)
    singular = np.ones((5, 5))
    zero, nan, infinite, huge = np.zeros((5, 5)), good[0].copy(), good[0].copy(), good[0].copy()
    nan[1, 2], infinite[3, 3], huge[0, 0] = np.nan, -np.inf, 1e300
    nearly = singular + 1e-17 * np.eye(5)
    bad = [singular, nan, zero, infinite, nearly]
    for chosen in ([nan], [singular], bad, [infinite, zero], [nan, huge]):
        matrices = np.array([good[0], *chosen, *good[1:]])
        with np.errstate(all="ignore"):
            found = frames_of(matrices)
        count = len(chosen)
        for k, one in enumerate(chosen, start=1):
            if one is not huge:
                assert np.isinf(found.error[k]).all()
                assert not np.isfinite(found.inverse_size[k]).any()
        for k, one in [(0, good[0]), *((count + k, good[k]) for k in range(1, 4))]:
            alone = frame_of(one)
            assert alone is not None
            for name in ("matrix", "inverse", "error"):
                assert np.array_equal(getattr(found, name)[k], getattr(alone, name))
            assert found.inverse[k] @ one == pytest.approx(np.eye(5), abs=1e-12)
        assert np.array_equal(found.matrix, matrices, equal_nan=True)


def test_frames_have_any_number_of_axes_in_front(rng):
    matrices = rng.uniform(-1, 1, (2, 3, 4, 4)) + 3 * np.eye(4)
    matrices[1, 1] = 0.0
    found = frames_of(matrices)
    assert found.error.shape == found.inverse.shape == matrices.shape
    usable = np.isfinite(found.error).all(axis=(-2, -1))
    assert usable.tolist() == [[True] * 3, [True, False, True]]
    one = frames_of(matrices[1, 2])
    assert np.array_equal(one.inverse, found.inverse[1, 2])
