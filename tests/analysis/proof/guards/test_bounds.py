"""Protects the bounds on U over boxes with soft guards and stops."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.guards import parabola_with
from support.rest import random_rest_system
from support.systems import VARIANTS

from rbstab.analysis.proof.box_bounds import inverses
from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.soft import SoftEnergy
from rbstab.analysis.proof.least_value import least_value, lower_bounds, upper_bounds
from rbstab.analysis.proof.reduced_energy import reduced_energy

seeds = st.integers(0, 2**32)

STOP = SoftEnergy(np.inf, 0.0, 0.9)


def random_soft(rng):
    couple, stiffness = 10.0 ** rng.uniform(0, 3, 2) * (rng.random(2) < 0.7)
    return SoftEnergy(couple, stiffness, rng.uniform(0.2, 0.8))


def random_guard(rng):
    """Return one to three soft guards, perhaps with a barrier or a stop."""
    soft = [random_soft(rng) for _ in range(rng.integers(1, 4))]
    barrier = BarrierEnergy(10.0 ** rng.uniform(-1, 2)) if rng.random() < 0.3 else None
    if rng.random() < 0.3:
        soft.append(STOP)
    return Guard(barrier, tuple(soft))


def with_guard(rng, guard=None):
    form = reduced_energy(random_rest_system(rng, rng.choice(VARIANTS))).form
    return replace(form, guard=guard or random_guard(rng))


def random_boxes(rng, guard, count):
    """Return boxes inside a stop, most of them with the angle of a guard."""
    size = 10.0 ** rng.uniform(-5, 0, size=(count, 3))
    centre = rng.uniform(-3, 3, size=(count, 3))
    angles = np.array([one.angle for one in guard.soft])
    centre[:, 1] = rng.choice(angles, count) * rng.choice([-1, 1], count)
    centre += size * rng.uniform(-1.2, 1.2, size=(count, 3))
    end = min(1.5, guard.stop or np.inf)
    low, high = np.clip(centre - size, -end, end)[:, 1], np.clip(centre + size, -end, end)[:, 1]
    found = Boxes(centre - size, centre + size)
    found.low[:, 1], found.high[:, 1] = np.minimum(low, end - 1e-6), np.maximum(high, 1e-6 - end)
    return found


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_bounds_hold_everywhere_in_the_box(seed):
    rng = np.random.default_rng(seed)
    guard = random_guard(rng)
    form, boxes = with_guard(rng, guard), random_boxes(rng, guard, 12)
    with np.errstate(all="ignore"):
        found = enclosure(form, boxes)
        low, high = lower_bounds(found), upper_bounds(found)
        turned = found.preconditioned(inverses(found.hessian))
        excluded = turned.excludes_zero
        least, most = found.gradient_bounds
    weights = rng.random(size=(12, 30, 3))
    weights[:, :15] = np.round(weights[:, :15])
    for n in range(12):
        points = boxes.low[n] + weights[n] * (boxes.high - boxes.low)[n]
        value, gradient = form.approximate(points, 1)
        size = 1e-9 * (1 + max(np.abs(part).max() for part in (value, gradient)))
        assert np.all(value >= low[n] - size)
        assert np.all(value <= high[n] + size)
        assert np.all((gradient >= least[n] - size) | ~np.isfinite(least[n]))
        assert np.all((gradient <= most[n] + size) | ~np.isfinite(most[n]))
        if found.monotonic[n] or excluded[n]:
            # No convex combination of the gradients in the box is zero along all axes.
            assert np.abs(gradient).max(axis=1).min() > 0
        if found.monotonic[n]:
            assert np.any(gradient.min(axis=0) * gradient.max(axis=0) > 0)


@pytest.mark.parametrize("couple", [5.0, np.inf])
def test_the_least_value_at_a_kink_is_found_to_the_last_digits(couple):
    """At a kink U is not smooth: without a line below it, boxes would become too many there."""
    form = parabola_with(Guard(None, (SoftEnergy(couple, 0.0, 0.5),)), [0.3, 0.7, -0.2])
    box = Boxes(np.array([[-1.0, -0.5, -1.0]]), np.array([[1.0, 0.5, 1.0]]))
    if couple < np.inf:
        box.high[0, 1] = 1.0
    found = least_value(form, box, 5000)
    assert found.closed
    assert found.value == pytest.approx(0.5 * 0.2**2, rel=1e-9)
    assert found.lower_bound <= 0.5 * 0.2**2
    assert found.examined < 2000


def test_no_slope_is_known_where_a_stop_acts_but_that_it_is_inwards():
    form = parabola_with(Guard(None, (STOP,)), [0.3, 0.7, -0.2])
    touching = Boxes(np.array([[-1.0, 0.8, -1.0]]), np.array([[1.0, 0.9, 1.0]]))
    with np.errstate(all="ignore"):
        # The energy rises towards the stop: nothing rests there.
        assert enclosure(form, touching).monotonic[0]
        pressing = parabola_with(form.guard, [0.3, 1.2, -0.2])
        assert not enclosure(pressing, touching).monotonic[0]
        lower = Boxes(np.array([[-1.0, -0.9, -1.0]]), np.array([[1.0, -0.8, 1.0]]))
        assert enclosure(pressing, lower).monotonic[0]


def test_nothing_is_unique_over_a_jump():
    form = parabola_with(Guard(None, (SoftEnergy(5.0, 0.0, 0.5),)), [0.3, 0.7, -0.2])
    box = Boxes(np.array([[-1.0, 0.4, -1.0]]), np.array([[1.0, 0.6, 1.0]]))
    with np.errstate(all="ignore"):
        found = enclosure(form, box)
        turned = found.preconditioned(inverses(found.hessian))
        assert found.hessian_radius[0, 1, 1] == np.inf
        assert not turned.at_most_one_zero[0]
        assert not turned.at_least_one_zero(box.inner_radius)[0]
        smooth = enclosure(form.unguarded, box)
        assert smooth.preconditioned(inverses(smooth.hessian)).at_most_one_zero[0]
