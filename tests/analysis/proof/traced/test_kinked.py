"""Protects bounds over boxes on energies with kinks, against values and slopes at random points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.kinks import kinked, plane, sphere

from rbstab.analysis.proof.box_bounds import inverses
from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.soft import SoftEnergy
from rbstab.analysis.proof.least_value import lower_bounds, upper_bounds
from rbstab.analysis.proof.trigonometric import TrigonometricForm

GUARDS = (
    None,
    Guard(BarrierEnergy(0.3)),
    Guard(BarrierEnergy(0.3), (SoftEnergy(0.0, 3.0, 0.2), SoftEnergy(1.5, 0.0, 0.3))),
)

WAVE = [["theta", 0], ["theta", 2], ["sin", 0], ["cos", 1], ["*", 2, 3], ["exp", 4], ["-", 5, 1]]


def random_form(rng):
    bent = rng.uniform(-1, 1, (3, 3))
    parts = [
        plane(rng.uniform(-1, 1, 3), rng.uniform(-0.5, 0.5), rng.uniform(0.1, 5)),
        sphere(rng.uniform(0.2, 0.8), rng.uniform(0.1, 5)),
        WAVE,
    ]
    chosen = rng.permutation(3)[: rng.integers(1, 4)]
    return TrigonometricForm(
        bent + bent.T,
        rng.uniform(-1, 1, 3),
        rng.uniform(-1, 1, (3, 3, 3)),
        guard=GUARDS[rng.integers(0, 3)],
        lines=tuple(kinked(parts[k], ridge=bool(rng.integers(0, 2))) for k in chosen),
    )


def random_boxes(rng, count):
    centre = rng.uniform([-1, -1, -1], [1, 1, 1], (count, 3))
    reach = 10.0 ** rng.uniform(-6, -0.6, (count, 1)) * rng.uniform(0.1, 1, (count, 3))
    return Boxes(centre - reach, centre + reach)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32))
def test_bounds_hold_at_random_points(seed):
    rng = np.random.default_rng(seed)
    form = random_form(rng)
    boxes = random_boxes(rng, 30)
    found = enclosure(form, boxes)
    low, high = found.gradient_bounds
    least, most = lower_bounds(found), upper_bounds(found)
    for row in range(30):
        inside = rng.uniform(boxes.low[row], boxes.high[row], (50, 3))
        value, slope = form.approximate(inside, 1)
        noise = 1e-12 * (1 + np.abs(value).max() + np.abs(slope).max())
        assert np.all(low[row] - noise <= slope)
        assert np.all(slope <= high[row] + noise)
        assert np.all(least[row] - noise <= value)
        assert np.all(value <= most[row] + noise)
    if found.kinks is not None:
        _check_below(form, boxes, found.kinks, rng)


def _check_below(form, boxes, jumps, rng):
    """λh with the chosen λ is nowhere above max(h, 0), and nowhere below min(h, 0)."""
    flat, below = lower_bounds(jumps.flat), lower_bounds(jumps.below)
    for row in np.flatnonzero(jumps.anywhere):
        inside = rng.uniform(boxes.low[row], boxes.high[row], (50, 3))
        h = [kink.argument.approximate(inside, 0)[0] for kink in form.kinks]
        lines = [share * one for share, one in zip(jumps.share[row], h, strict=True)]
        exact = form.without_kinks.value(inside)
        noise = 1e-12 * (1 + np.abs(exact).max())
        for kink, value, line in zip(form.kinks, h, lines, strict=True):
            cut = np.minimum(value, 0) - line if kink.ridge else line - np.maximum(value, 0)
            assert np.all(cut <= noise)
        assert flat[row] <= np.min(exact + sum(lines)) + noise
        assert below[row] <= np.min(form.value(inside)) + noise


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32))
def test_a_box_with_a_rest_state_is_never_excluded(seed):
    """The load is chosen so that the body is held at a point of a plane and of a sphere, or one."""
    rng = np.random.default_rng(seed)
    Theta, normal = rng.uniform(-0.8, 0.8, 3), rng.uniform(-1, 1, 3)
    couples = 10.0 ** rng.uniform(-1, 1.5, 2)
    shares = rng.uniform(0, 1, 2) * [1, rng.integers(0, 2)]
    parts = [
        plane(normal, float(normal @ Theta), couples[0]),
        sphere(float(np.linalg.norm(Theta)), couples[1]),
    ]
    bent = rng.uniform(-2, 2, (3, 3))
    bent = bent + bent.T
    force = bent @ Theta + shares[0] * couples[0] * normal + shares[1] * couples[1] * 2 * Theta
    constant = np.zeros((1, 1, 1))
    lines = tuple(kinked(one, ridge=bool(rng.integers(0, 2))) for one in parts)
    form = TrigonometricForm(bent, -force, constant, lines=lines)
    reach = 10.0 ** rng.uniform(-6, -0.5, (2, 100, 3))
    boxes = Boxes(Theta - reach[0], Theta + reach[1])
    found = enclosure(form, boxes)
    assert found.kinks is not None
    assert np.all(found.kinks.anywhere)
    assert not np.any(found.kinks.excludes_zero)
    assert not np.any(found.monotonic)
    assert not np.any(found.preconditioned(inverses(found.hessian)).excludes_zero)


def test_where_a_slope_jumps_the_hessian_has_no_bound():
    form = TrigonometricForm(
        np.eye(3), np.zeros(3), np.zeros((1, 1, 1)), lines=(kinked(plane([1, 0, 0], 0.5, 2.0)),)
    )
    boxes = Boxes(np.array([[0.4, 0, 0], [0.6, 0, 0]]), np.array([[0.6, 1, 1], [0.7, 1, 1]]))
    found = enclosure(form, boxes)
    assert np.all(np.isinf(found.hessian_radius[0]))
    assert np.all(np.isfinite(found.hessian_radius[1]))
    np.testing.assert_allclose(found.gradient[1], [0.65 + 2.0, 0.5, 0.5])
    assert np.all(np.isinf(found.negated().hessian_radius[0]))
    assert not np.any(np.isnan(upper_bounds(found)))
    # In parts, too: each box has its own.
    chosen = found[np.array([1])]
    assert chosen.kinks is not None
    assert list(chosen.kinks.anywhere) == [False]


def test_a_formula_without_values_bounds_nothing():
    """The logarithm of an angle near zero."""
    log = [["theta", 0], ["log", 0]]
    form = TrigonometricForm(np.eye(3), np.zeros(3), np.zeros((1, 1, 1)), lines=(kinked(log),))
    boxes = Boxes(np.array([[-0.1, 0.1, 0.1]]), np.array([[0.1, 0.2, 0.2]]))
    found = enclosure(form, boxes)
    assert not found.monotonic[0] or found.gradient_bounds[0][0, 1] > 0
    assert lower_bounds(found)[0] == -np.inf
    assert found.kinks is not None
    assert not found.kinks.excludes_zero[0]


@pytest.mark.parametrize("ridge", [False, True])
@pytest.mark.parametrize("width", [1e-2, 1e-5])
def test_the_smooth_energy_of_a_descent_is_within_half_its_width(width, ridge):
    """It is above a valley, and below a ridge."""
    one = kinked(WAVE, ridge=ridge)
    Theta = np.random.default_rng(1).uniform(-1, 1, (500, 3))
    gap = one.smoothed(width).approximate(Theta, 0)[0] - one.approximate(Theta, 0)[0]
    gap = -gap if ridge else gap
    assert np.all(gap >= 0)
    assert np.all(gap <= 0.5 * width * (1 + 1e-9))
    _, slope, bent = one.smoothed(width).approximate(Theta, 2)
    step = 1e-4 * width
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        up, down = (one.smoothed(width).approximate(Theta + s, 1) for s in (shift, -shift))
        np.testing.assert_allclose((up[0] - down[0]) / (2 * step), slope[:, axis], atol=1e-6)
        rate = (up[1] - down[1]) / (2 * step)
        np.testing.assert_allclose(rate, bent[:, :, axis], rtol=1e-3, atol=1e-4 / width)
