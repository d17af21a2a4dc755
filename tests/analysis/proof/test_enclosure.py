"""Enclosures bound gradient and Hessian over a box, and decide rightly whether it has a zero."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.rest import random_rest_system
from support.systems import VARIANTS

from rbstab.analysis.proof.box_bounds import Enclosure, inverses
from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.trigonometric import TrigonometricForm

seeds = st.integers(0, 2**32)


def random_form(rng):
    """Return a random reduced energy, or one wave, whose bounds are nearly reached."""
    if rng.random() < 0.5:
        return reduced_energy(random_rest_system(rng, rng.choice(VARIANTS))).form
    coefficients = np.zeros((5, 5, 5))
    coefficients[tuple(rng.integers(0, 5, size=3))] = 100.0
    return TrigonometricForm(np.zeros((3, 3)), np.zeros(3), coefficients)


def random_boxes(rng, count):
    centre = rng.uniform(-1, 1, size=(count, 3)) * [3, 1.5, 3]
    radius = 10.0 ** rng.uniform(-4, 0, size=(count, 3))
    return Boxes(centre - radius, centre + radius)


def points_in(rng, boxes, count=60):
    """Return corners and inner points of each box, shape (boxes, count, 3)."""
    weights = rng.random(size=(len(boxes), count, 3))
    weights[:, : count // 2] = np.round(weights[:, : count // 2])
    return boxes.low[:, None] + weights * (boxes.high - boxes.low)[:, None]


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_bounds_hold_everywhere_in_the_box(seed):
    rng = np.random.default_rng(seed)
    form, boxes = random_form(rng), random_boxes(rng, 40)
    over, points = enclosure(form, boxes), points_in(rng, boxes)
    _, gradient, hessian, third = (
        values.reshape(*points.shape[:2], *values.shape[1:])
        for values in form.approximate(points.reshape(-1, 3), 3)
    )
    round_off = 1e-9 * np.abs(gradient).max()
    delta = points - boxes.centre[:, None]
    linear = over.gradient[:, None] + np.einsum("mkj,mpj->mpk", over.hessian, delta)
    assert np.all(np.abs(gradient - linear) <= over.curvature[:, None] + round_off)
    change = np.abs(hessian - over.hessian[:, None])
    assert np.all(change <= over.hessian_radius[:, None] + round_off)
    assert np.all(np.abs(third) <= over.third[:, None] + round_off)


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_no_zero_is_promised_only_where_none_is(seed):
    # If a test excludes a zero, one component of ∇U or Y∇U has one sign in the whole box.
    rng = np.random.default_rng(seed)
    form, boxes = random_form(rng), random_boxes(rng, 200)
    over, points = enclosure(form, boxes), points_in(rng, boxes)
    bounds = over.preconditioned(inverses(over.hessian))
    gradient = form.approximate(points.reshape(-1, 3), 1)[1].reshape(points.shape)
    kept_sign = np.abs(np.sign(gradient).sum(axis=1)) == points.shape[1]
    assert np.all(np.any(kept_sign, axis=1)[over.monotonic])
    transformed = np.einsum("mkl,mpl->mpk", inverses(over.hessian), gradient)
    kept_sign = np.abs(np.sign(transformed).sum(axis=1)) == points.shape[1]
    assert np.all(np.any(kept_sign, axis=1)[bounds.excludes_zero])


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_slope_stays_near_one_over_the_box(seed):
    rng = np.random.default_rng(seed)
    form, boxes = random_form(rng), random_boxes(rng, 40)
    over, points = enclosure(form, boxes), points_in(rng, boxes)
    Y = inverses(over.hessian)
    bounds = over.preconditioned(Y)
    hessian = form.approximate(points.reshape(-1, 3), 2)[2].reshape(*points.shape, 3)
    residual = np.abs(np.eye(3) - np.einsum("mkl,mplj->mpkj", Y, hessian))
    usual = np.isfinite(bounds.box_residual).all(axis=(1, 2)) & (np.abs(Y).max(axis=(1, 2)) < 1e6)
    assert np.all(residual[usual] <= (bounds.box_residual * (1 + 1e-9) + 1e-9)[usual, None])


def uncertain(rng, count, rounding):
    """Return bounds over boxes, with errors so large that each of them matters."""
    scale = 10.0 ** rng.uniform(-2, 1, size=(count, 1))
    hessian = rng.normal(size=(count, 3, 3))
    return Enclosure(
        10.0 ** rng.uniform(-1, 0, size=(count, 3)),
        rng.normal(size=count),
        np.array(rounding * 0.1),
        rng.normal(size=(count, 3)) * scale,
        rounding * rng.uniform(size=3) * 0.1,
        np.eye(3) + 0.3 * hessian + 0.3 * hessian.transpose(0, 2, 1),
        rounding * np.full((3, 3), 0.05),
        np.abs(rng.normal(size=(count, 3, 3, 3))) * 0.1,
    )


def gradients_within(rng, over, count=200):
    """Return points of the boxes and the most extreme gradients allowed, (boxes, count, 3) each."""

    def signs(*shape):
        return rng.choice([-1.0, 1.0], size=(len(over.radius), count, *shape))

    delta = signs(3) * over.radius[:, None]
    # One sign for each row: the errors add up, where random signs would cancel.
    row = signs(3)
    along = row[..., None] * np.sign(delta)[:, :, None, :]
    hessian = over.hessian[:, None] + along * over.hessian_error
    bend = row[..., None, None] * np.sign(np.einsum("mpi,mpj->mpij", delta, delta))[:, :, None]
    third = bend * over.third[:, None]
    gradient = over.gradient[:, None] + row * over.gradient_error
    gradient = gradient + np.einsum("mpkj,mpj->mpk", hessian, delta)
    return delta, gradient + 0.5 * np.einsum("mpkij,mpi,mpj->mpk", third, delta, delta)


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from([0.0, 1.0]))
def test_every_error_is_counted(seed, rounding):
    rng = np.random.default_rng(seed)
    over = uncertain(rng, 200, rounding)
    delta, gradient = gradients_within(rng, over)
    slack = 1 + 1e-9
    linear = over.gradient[:, None] + np.einsum("mkj,mpj->mpk", over.hessian, delta)
    assert np.all(np.abs(gradient - linear) <= over.curvature[:, None] * slack)
    # Some gradient reaches the bound, so the bound is not too large.
    assert np.all(np.abs(gradient - linear).max(axis=1) >= 0.999 * over.curvature)
    flips = gradient.min(axis=1) * gradient.max(axis=1) <= 0
    assert not np.any(np.all(flips, axis=1) & over.monotonic)
    Y = inverses(over.hessian)
    transformed = np.einsum("mkl,mpl->mpk", Y, gradient)
    flips = transformed.min(axis=1) * transformed.max(axis=1) <= 0
    bounds = over.preconditioned(Y)
    assert not np.any(np.all(flips, axis=1) & bounds.excludes_zero)
    # If a box passes the test, Krawczyk's map takes each of its points into the box.
    image = np.abs(delta - transformed).max(axis=1)
    assert np.all((image < over.radius)[bounds.at_least_one_zero(over.radius)])


def slopes_within(rng, over, Y, count=100):
    """Return the most extreme I - YH that the bounds allow, shape (boxes, count, 3, 3)."""
    signs = rng.choice([-1.0, 1.0], size=(len(over.radius), count, 3, 3))
    hessian = over.hessian[:, None] + signs * over.hessian_radius[:, None]
    return np.eye(3) - np.einsum("mkl,mplj->mpkj", Y, hessian)


@settings(max_examples=20, deadline=None)
@given(seeds, st.booleans())
def test_slope_is_bounded_whatever_the_preconditioner(seed, exact):
    rng = np.random.default_rng(seed)
    over = uncertain(rng, 100, 1.0)
    Y = inverses(over.hessian) if exact else rng.normal(size=(100, 3, 3))
    bounds = over.preconditioned(Y)
    residual = np.abs(slopes_within(rng, over, Y))
    assert np.all(residual <= bounds.box_residual[:, None] * (1 + 1e-9))
    rows = residual.sum(axis=3).max(axis=(1, 2))
    assert np.all(rows[bounds.at_most_one_zero] < 1)
    np.testing.assert_array_equal(
        bounds.at_most_one_zero, bounds.box_residual.sum(axis=2).max(axis=1) * (1 + 1e-12) < 1
    )


def test_preconditioner_need_not_be_the_inverse():
    # Y = 2 H⁻¹ reverses every point: a bound without I - YH(m) would accept this.
    over = enclosure(wave(), cube([0, 0, 0], 0.1))
    bounds = over.preconditioned(2.0 * inverses(over.hessian))
    assert not bounds.at_most_one_zero[0]
    assert not bounds.at_least_one_zero(np.full((1, 3), 0.1))[0]
    beside = enclosure(wave(), cube([0.15, 0, 0], 0.1))
    assert beside.preconditioned(inverses(beside.hessian)).excludes_zero[0]
    over = enclosure(wave(), cube([0.05, 0, 0], 0.1))
    assert not over.preconditioned(20.0 * inverses(over.hessian)).excludes_zero[0]


def wave():
    """Return U = -cos θ1 cos θ2 cos θ3, with a minimum at 0, the one zero within ±π/2."""
    coefficients = np.zeros((5, 5, 5))
    coefficients[1, 1, 1] = -1.0
    return TrigonometricForm(np.zeros((3, 3)), np.zeros(3), coefficients)


def cube(centre, radius):
    centre = np.asarray(centre, dtype=float)[None]
    return Boxes(centre - radius, centre + radius)


def decisions(form, box):
    over = enclosure(form, box)
    bounds = over.preconditioned(inverses(over.hessian))
    exists = bounds.at_least_one_zero(box.inner_radius)[0]
    return exists, bounds.at_most_one_zero[0], bounds.excludes_zero[0]


def test_box_about_the_zero_holds_one():
    assert decisions(wave(), cube([0, 0, 0], 0.15)) == (True, True, False)
    assert decisions(wave(), cube([0.01, -0.01, 0.01], 0.15)) == (True, True, False)


def test_box_beside_the_zero_holds_none():
    assert decisions(wave(), cube([0.2, 0, 0], 0.1)) == (False, True, True)


def test_zero_at_the_border_of_the_box_is_not_claimed():
    # The zero lies on the face; Krawczyk's test needs it inside.
    assert decisions(wave(), cube([0.1, 0, 0], 0.1))[0] == np.False_
    assert decisions(wave(), cube([0.1, 0, 0], 0.1))[2] == np.False_


def test_box_with_two_zeros_is_not_said_to_hold_one_at_most():
    # The zeros are (0, 0, 0) and (π, 0, 0).
    assert decisions(wave(), cube([np.pi / 2, 0, 0], 1.6))[1] == np.False_
    assert decisions(wave(), cube([0, 0, 0], 3.2))[1] == np.False_


def test_singular_hessian_decides_nothing():
    flat = TrigonometricForm(np.zeros((3, 3)), np.zeros(3), np.zeros((1, 1, 1)))
    with np.errstate(all="ignore"):
        assert decisions(flat, cube([0, 0, 0], 0.2)) == (False, False, False)
    assert not enclosure(flat, cube([0, 0, 0], 0.2)).monotonic[0]


def test_gradient_of_round_off_is_no_gradient():
    # The slope is half a unit in the last place of a sum of large terms.
    form = TrigonometricForm(np.zeros((3, 3)), np.full(3, 1e-17), wave().coefficients * 1e3)
    assert not enclosure(form, cube([0, 0, 0], 0.0)).monotonic[0]


def test_third_derivatives_may_be_off_by_round_off():
    form = wave()
    over = enclosure(form, cube([0, 0, 0], 0.0))
    assert np.all(over.third >= form.round_off[3])
    assert np.all(over.third < 1e-12)


@pytest.mark.parametrize("size", [1e-200, 1.0, 1e200])
def test_inverses(rng, size):
    matrices = rng.normal(size=(20, 3, 3)) * size
    np.testing.assert_allclose(
        inverses(matrices) @ matrices, np.broadcast_to(np.eye(3), (20, 3, 3)), atol=1e-10
    )
