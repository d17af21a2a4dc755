"""The least value of a form over a box has a proved lower bound, close to the value found."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.rest import random_rest_system
from support.systems import VARIANTS

from rbstab.analysis.proof.box_bounds import Enclosure
from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import least_value, lower_bounds, upper_bounds
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.trigonometric import TrigonometricForm

NO_WAVES = np.zeros((1, 1, 1))
LIMIT = 20_000


def box(low, high):
    return Boxes(np.array([low], dtype=float), np.array([high], dtype=float))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32))
def test_nothing_in_the_box_is_below_the_bound(seed):
    rng = np.random.default_rng(seed)
    form = reduced_energy(random_rest_system(rng, rng.choice(VARIANTS))).form
    radius = 10.0 ** rng.uniform(-6, 0, size=(100, 3))
    # Half of them are flat, like a face.
    radius[np.arange(50), rng.integers(0, 3, size=50)] = 0.0
    centre = rng.uniform(-1, 1, size=(100, 3)) * [3, 1.5, 3]
    boxes = Boxes(centre - radius, centre + radius)
    weights = rng.random(size=(100, 40, 3))
    weights[:, :20] = np.round(weights[:, :20])
    points = boxes.low[:, None] + weights * (boxes.high - boxes.low)[:, None]
    values = form.value(points.reshape(-1, 3)).reshape(100, 40)
    bounds = lower_bounds(enclosure(form, boxes))
    round_off = 1e-13 * np.abs(values).max()
    assert np.all(values.min(axis=1) >= bounds - round_off)


def test_errors_of_rounding_are_counted():
    r = np.array([[0.1, 0.2, 0.3]])
    flat = np.zeros((1, 3)), np.zeros((1, 3, 3)), np.zeros((1, 3, 3, 3))
    slope, bend = np.array([1.0, 2.0, 3.0]), np.full((3, 3), 4.0)
    over = Enclosure(r, np.array([7.0]), np.array(0.5), flat[0], slope, flat[1], bend, flat[2])
    # 0.5 + (0.1 + 0.4 + 0.9) + ½ 4 (0.1 + 0.2 + 0.3)²
    assert lower_bounds(over)[0] == pytest.approx(7 - 0.5 - 1.4 - 0.72, rel=1e-11)


def test_bound_is_near_where_the_box_is_small(rng):
    form = reduced_energy(random_rest_system(rng, "permanent")).form
    centre = rng.uniform(-1, 1, size=(50, 3))
    for radius in (1e-3, 1e-6):
        over = enclosure(form, Boxes(centre - radius, centre + radius))
        steepest = np.abs(over.gradient).sum(axis=1) * radius
        lost = over.value - lower_bounds(over)
        assert np.all(lost <= 1.5 * steepest + 1e3 * radius**2 + 1e-10)


def test_bowl_in_a_box_with_its_bottom():
    bowl = TrigonometricForm(np.diag([2.0, 3, 5]), np.array([-2.0, 0, -1]), NO_WAVES)
    found = least_value(bowl, box([-3, -1, -3], [3, 1, 3]), LIMIT)
    assert found.closed
    np.testing.assert_allclose(found.Theta, [1, 0, 0.2], rtol=0, atol=1e-6)
    assert found.value == pytest.approx(-1.1, rel=1e-12)
    assert found.lower_bound <= -1.1 <= found.value + 1e-12
    assert found.value - found.lower_bound < 1e-6


def test_bowl_cut_by_a_face():
    # θ2 is fixed at 0.5, and the best θ1 lies outside the box.
    bowl = TrigonometricForm(np.diag([2.0, 3, 5]), np.array([-8.0, 0, -1]), NO_WAVES)
    found = least_value(bowl, box([-3, 0.5, -3], [3, 0.5, 3]), LIMIT)
    np.testing.assert_allclose(found.Theta, [3, 0.5, 0.2], rtol=0, atol=1e-6)
    exact = 9 - 24 + 1.5 * 0.25 - 0.1
    assert found.value == pytest.approx(exact, rel=1e-12)
    assert exact - 1e-6 < found.lower_bound <= exact


def test_lowest_of_many_valleys():
    # Waves of one height on a slope: the lowest valley is at the far end.
    coefficients = np.zeros((5, 5, 5))
    coefficients[3, 0, 3] = 1.0
    form = TrigonometricForm(np.zeros((3, 3)), np.array([0.05, 0.0, -0.03]), coefficients)
    face = box([-3, 0, -3], [3, 0, 3])
    found = least_value(form, face, LIMIT)
    grid = np.stack(np.meshgrid(np.linspace(-3, 3, 400), [0], np.linspace(-3, 3, 400)), axis=-1)
    least = form.value(grid.reshape(-1, 3)).min()
    assert found.closed
    assert found.value <= least < found.value + 1e-3
    assert found.value - 1e-7 < found.lower_bound <= found.value


@pytest.mark.parametrize("variant", VARIANTS)
def test_no_sample_of_a_face_is_lower(rng, variant):
    form = reduced_energy(random_rest_system(rng, variant)).form
    axis = rng.integers(0, 3)
    low, high = np.array([-3.0, -1.5, -3.0]), np.array([3.0, 1.5, 3.0])
    low[axis] = high[axis]
    found = least_value(form, box(low, high), LIMIT)
    samples = form.value(rng.uniform(low, high, size=(20_000, 3)))
    assert found.closed
    assert np.all((low <= found.Theta) & (found.Theta <= high))
    assert form.value(found.Theta[None])[0] == pytest.approx(found.value, rel=1e-12)
    assert samples.min() >= found.lower_bound
    assert samples.min() >= found.value - 1e-9 * np.abs(samples).max()
    assert found.lower_bound >= found.value - 2e-9 * np.abs(samples).max()


def test_limit_leaves_a_bound_that_is_weak_but_true():
    coefficients = np.zeros((5, 5, 5))
    coefficients[3, 3, 3] = 1.0
    form = TrigonometricForm(0.01 * np.eye(3), np.zeros(3), coefficients)
    whole = box([-3, -1.5, -3], [3, 1.5, 3])
    exact = least_value(form, whole, 200_000)
    assert exact.closed
    for limit in (0, 1, 10, 100):
        found = least_value(form, whole, limit)
        assert not found.closed
        assert found.lower_bound <= exact.lower_bound <= exact.value <= found.value + 1e-12


def test_a_box_without_a_bound_leaves_nothing_known():
    """A minimum of Python drops what is no number, and so all that was not bounded."""
    form = reduced_energy(random_rest_system(np.random.default_rng(1), "embedded")).form
    boxes = Boxes(np.full((3, 3), -0.1), np.full((3, 3), 0.1))
    enclosed = enclosure(form, boxes)
    value = enclosed.value.copy()
    value[1] = np.nan
    unknown = replace(enclosed, value=value)
    found = lower_bounds(unknown)
    assert np.isfinite(found[[0, 2]]).all()
    assert found[1] == -np.inf
    assert upper_bounds(unknown)[1] == np.inf
