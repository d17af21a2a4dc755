"""Protects the bounds of a barrier on θ2: at angles, over intervals, over boxes, near ±π/2.

The derivatives are held against closed forms in sine and cosine, and against the couple of the
element itself, in balls of many bits.
"""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb, ctx, fmpq
from hypothesis import given, settings
from hypothesis import strategies as st
from support.rest import random_rest_system
from support.systems import VARIANTS

from rbstab.analysis.proof.box_bounds import Enclosure, inverses
from rbstab.analysis.proof.boxes import Boxes, box_around
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.least_value import lower_bounds, upper_bounds
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.elements.guards.barrier import Barrier
from rbstab.mechanics.motion import Motion

seeds = st.integers(0, 2**32)

PLACES = [(slice(None),), (slice(None), 1), (slice(None), 1, 1)]
"""The derivatives along θ2 in arrays of values, gradients and Hessians."""


@pytest.fixture(autouse=True)
def _precision():
    with ctx.workprec(400):
        yield


def exact(stiffness, angle):
    """Return ½ k tan² θ and three derivatives by θ, as balls, by formulas in sine and cosine."""
    k, x = arb(stiffness), arb(angle)
    s, c = x.sin(), x.cos()
    return [
        k * (1 / (2 * c * c) - fmpq(1, 2)),
        k * s / c**3,
        k * (3 - 2 * c * c) / c**4,
        k * s * (12 - 4 * c * c) / c**5,
    ]


def closed_forms(stiffness, angles):
    """Return the same in doubles, of shape (4, n)."""
    rows = [[float(value) for value in exact(stiffness, angle)] for angle in angles.tolist()]
    return np.array(rows).reshape(-1, 4).T


def random_angles(rng, count):
    """Return angles between -π/2 and π/2, half of them close to an end."""
    near = np.pi / 2 - 10.0 ** rng.uniform(-12, 0, count)
    angles = np.where(rng.random(count) < 0.5, near, rng.uniform(0, np.pi / 2, count))
    return angles * rng.choice([-1.0, 1.0], count)


@pytest.mark.parametrize("stiffness", [1.0, 0.1, 7e5, 1e-9])
def test_bounds_at_angles_contain_the_closed_forms_and_are_tight(stiffness):
    angles = random_angles(np.random.default_rng(1), 100)
    low, high = BarrierEnergy(stiffness).at(angles, 3)
    for n, angle in enumerate(angles.tolist()):
        for order, value in enumerate(exact(stiffness, angle)):
            assert arb(float(low[order, n])) <= value <= arb(float(high[order, n]))
    assert np.all(high - low <= 2e-15 * np.abs(low) + 1e-300)
    near = BarrierEnergy(stiffness).approximate(angles, 3)
    assert np.all(np.abs(near - low) <= 1e-3 * np.abs(low))
    inner = np.abs(angles) < 1.5
    assert np.all(np.abs(near - low)[:, inner] <= 1e-12 * np.abs(low)[:, inner])


def test_each_number_that_rounds_to_the_stiffness_is_covered():
    """1 ± 2⁻⁵³ are the farthest numbers that round to 1; rounding the results is not enough."""
    angles = random_angles(np.random.default_rng(2), 200)
    low, high = BarrierEnergy(1.0).at(angles, 3)
    above, below = 1 + arb(2) ** -53, 1 - arb(2) ** -54
    for n, angle in enumerate(angles.tolist()):
        for order, value in enumerate(exact(1.0, angle)):
            for number in (above, below):
                assert arb(float(low[order, n])) <= number * value <= arb(float(high[order, n]))


@pytest.mark.parametrize("angle", [-1.5, -0.3, 0.0, 0.7, 1.57])
def test_energy_and_slope_are_those_of_the_element(angle):
    """With B = I, the couple is minus the gradient of the energy."""
    nothing, unit = np.zeros(3), np.eye(3)
    Theta = np.array([arb("0.1"), arb(angle), arb(-2)], dtype=object)
    motion = Motion(Theta, nothing, nothing, nothing, unit, unit, nothing, nothing)
    element = Barrier(name="range", stiffness=arb(3), outer_stiffness=arb(0))
    low, high = BarrierEnergy(3.0).at(np.array([angle]), 1)
    values = [element.stored(motion, nothing), -element.wrench(motion, nothing).couple[1]]
    for order, value in enumerate(values):
        assert arb(float(low[order, 0])) <= value <= arb(float(high[order, 0]))


@pytest.mark.parametrize("angle", [-3.0, -0.3, 0.0, 0.7, 3.14])
@pytest.mark.parametrize("axis", [0, 2])
def test_energy_and_slopes_on_the_other_angles_are_those_of_the_element(angle, axis):
    """The slope follows from the couple, the others by differences of it in many digits."""
    nothing, unit = np.zeros(3), np.eye(3)

    def element(x):
        Theta = np.array([arb(0)] * 3, dtype=object)
        Theta[axis] = x
        motion = Motion(Theta, nothing, nothing, nothing, unit, unit, nothing, nothing)
        one = Barrier(name="range", stiffness=arb(0), outer_stiffness=arb(3))
        return one.stored(motion, nothing), -one.wrench(motion, nothing).couple[axis]

    found = BarrierEnergy(3.0, half=True)
    low, high = found.at(np.array([angle]), 3)
    h = arb(2) ** -100
    before, here, after = (element(arb(angle) + step)[1] for step in (-h, 0, h))
    values = [element(arb(angle))[0], here, (after - before) / (2 * h)]
    values.append((after - 2 * here + before) / h**2)
    for order, value in enumerate(values):
        error = arb(0, 1e-12) * (1 + abs(value))
        assert (value + error).overlaps(arb(float(low[order, 0])).union(arb(float(high[order, 0]))))
        assert high[order, 0] - low[order, 0] <= 1e-13 * (1 + abs(high[order, 0]))
    assert np.all(found.at(np.array([np.nextafter(np.pi, 4)]), 1)[1] == np.inf)


def test_a_form_with_barriers_on_all_angles_adds_each_along_its_axis():
    rng = np.random.default_rng(4)
    bare = reduced_energy(random_rest_system(rng, "permanent")).form
    guard = Guard(BarrierEnergy(2.0), (), BarrierEnergy(5.0, half=True))
    form = replace(bare, guard=guard)
    Theta = rng.uniform(-1, 1, (20, 3)) * [3.0, 1.5, 3.0]
    t = np.tan(Theta * [0.5, 1.0, 0.5])
    k = np.array([5.0, 2.0, 5.0])
    ss, share = 1 + t * t, np.array([0.5, 1.0, 0.5])
    parts = [0.5 * k * t * t, k * share * t * ss, k * share**2 * ss * (1 + 3 * t * t)]
    found, without = form.rigorous(Theta, 2), bare.rigorous(Theta, 2)
    near = form.approximate(Theta, 2)
    np.testing.assert_allclose(found[0].values - without[0].values, parts[0].sum(axis=1), rtol=1e-9)
    np.testing.assert_allclose(found[1].values - without[1].values, parts[1], rtol=1e-9, atol=1e-9)
    added = found[2].values - without[2].values
    for axis in range(3):
        np.testing.assert_allclose(added[:, axis, axis], parts[2][:, axis], rtol=1e-9, atol=1e-8)
    for one, other in zip(found, near, strict=True):
        np.testing.assert_allclose(one.values, other, rtol=1e-9, atol=1e-8)
    low, high = Theta - 0.02, Theta + 0.02
    with np.errstate(all="ignore"):
        over = enclosure(form, Boxes(low, high))
        least, most = lower_bounds(over), upper_bounds(over)
        slopes = over.gradient_bounds
    for n in range(20):
        points = rng.uniform(low[n], high[n], (30, 3))
        value, gradient = form.approximate(points, 1)
        assert np.all((value >= least[n] - 1e-6) & (value <= most[n] + 1e-6))
        assert np.all((gradient >= slopes[0][n] - 1e-6) & (gradient <= slopes[1][n] + 1e-6))
        if over.monotonic[n]:
            assert np.any(gradient.min(axis=0) * gradient.max(axis=0) > 0)


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_bounds_over_an_interval_hold_inside_and_are_attained(seed):
    rng = np.random.default_rng(seed)
    ends = np.sort(random_angles(rng, 2))
    low, high = BarrierEnergy(2.0).over(ends[:1], ends[1:])
    inside = np.concatenate([ends, rng.uniform(ends[0], ends[1], 40), np.clip([0.0], *ends)])
    values = closed_forms(2.0, inside)
    slack = 1e-14 * np.abs(values)
    assert np.all(values >= low - slack)
    assert np.all(values <= high + slack)
    np.testing.assert_allclose(values.min(axis=1), low[:, 0], rtol=1e-13, atol=1e-300)
    np.testing.assert_allclose(values.max(axis=1), high[:, 0], rtol=1e-13, atol=1e-300)


@pytest.mark.parametrize("high", [np.nextafter(np.pi / 2, 2), 2.0, 5.0])
def test_nothing_is_bounded_where_an_interval_reaches_the_end(high):
    low, most = BarrierEnergy(2.0).over(np.array([1.0]), np.array([high]))
    assert np.all(most == np.inf)
    least = closed_forms(2.0, np.array([1.0]))
    assert np.all(low <= least)
    system = random_rest_system(np.random.default_rng(3), "permanent")
    form = replace(reduced_energy(system).form, guard=Guard(BarrierEnergy(2.0)))
    box = Boxes(np.array([[-0.1, 1.0, -0.1]]), np.array([[0.1, high, 0.1]]))
    with np.errstate(all="ignore"):
        found = enclosure(form, box)
        bounds = found.preconditioned(inverses(found.hessian))
        assert not bounds.at_most_one_zero[0]
        assert not bounds.at_least_one_zero(box.inner_radius)[0]
        assert not bounds.excludes_zero[0]
        assert not upper_bounds(found)[0] < np.inf


def guarded_form(rng):
    """Return a random energy with a barrier, and the same without it."""
    bare = reduced_energy(random_rest_system(rng, rng.choice(VARIANTS))).form
    return replace(bare, guard=Guard(BarrierEnergy(10.0 ** rng.uniform(-2, 3)))), bare


def random_boxes(rng, count):
    """Return boxes with |θ2| < π/2."""
    size = 10.0 ** rng.uniform(-4, 0, size=(count, 3))
    centre = rng.uniform(-3, 3, size=(count, 3))
    ends = np.sort(np.stack([random_angles(rng, count) for _ in range(2)]), axis=0)
    low, high = centre - size, centre + size
    low[:, 1], high[:, 1] = ends
    return Boxes(low, high)


def derivatives(form, bare, Theta):
    """Return U, ∇U and H with the barrier by its closed forms."""
    found = bare.approximate(Theta, 2)
    added = closed_forms(form.guard.barrier.stiffness, Theta[:, 1])
    found[0] = found[0] + added[0]
    found[1][:, 1] += added[1]
    found[2][:, 1, 1] += added[2]
    return found


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_bounds_hold_everywhere_in_the_box(seed):
    rng = np.random.default_rng(seed)
    (form, bare), boxes = guarded_form(rng), random_boxes(rng, 12)
    found = enclosure(form, boxes)
    low, high = lower_bounds(found), upper_bounds(found)
    weights = rng.random(size=(12, 30, 3))
    weights[:, :15] = np.round(weights[:, :15])
    for n in range(12):
        points = boxes.low[n] + weights[n] * (boxes.high - boxes.low)[n]
        value, gradient, hessian = derivatives(form, bare, points)
        size = 1e-9 * (1 + max(np.abs(part).max() for part in (value, gradient, hessian)))
        assert np.all(value >= low[n] - size)
        assert np.all(value <= high[n] + size)
        d = points - boxes.centre[n]
        linear = found.gradient[n] + np.einsum("kj,mj->mk", found.hessian[n], d)
        assert np.all(np.abs(gradient - linear) <= found.curvature[n] + size)
        assert np.all(np.abs(hessian - found.hessian[n]) <= found.hessian_radius[n] + size)
        if found.monotonic[n]:
            assert np.any(gradient.min(axis=0) * gradient.max(axis=0) > 0)


def test_monotonic_boxes_near_the_end_may_be_wide():
    """The slope of the barrier is large there, and Taylor's theorem alone would need thin boxes."""
    form, _ = guarded_form(np.random.default_rng(5))
    form = replace(form, guard=Guard(BarrierEnergy(10.0)))
    end = form.guard.barrier.end_beyond(1e6)
    box = Boxes(np.array([[-3.0, end, -3.0]]), np.array([[3.0, 1.5707, 3.0]]))
    found = enclosure(form, box)
    assert found.monotonic[0]
    assert not Enclosure.monotonic.__get__(found)[0]


def test_rigorous_values_contain_the_closed_forms():
    """Heights of regions take U at the lowest rest state from here."""
    rng = np.random.default_rng(7)
    form, bare = guarded_form(rng)
    Theta = np.stack([rng.uniform(-3, 3, 20), random_angles(rng, 20), rng.uniform(-3, 3, 20)], 1)
    found, without = form.rigorous(Theta, 2), bare.rigorous(Theta, 2)
    added = closed_forms(form.guard.barrier.stiffness, Theta[:, 1])
    for order, place in enumerate(PLACES):
        difference = found[order].values[place] - without[order].values[place]
        error = found[order].error[place[1:]]
        assert np.all(np.abs(difference - added[order]) <= error + 1e-15 * np.abs(added[order]))
    np.testing.assert_allclose(form.approximate(Theta, 0)[0], found[0].values, rtol=1e-3)
    one = enclosure(form, box_around(Theta[0], 0.0))
    assert one.value[0] == pytest.approx(found[0].values[0], rel=1e-12)


def test_what_is_rounded_at_a_centre_is_in_the_errors():
    """Without any other energy, U is that of the barrier, whose exact value is no double."""
    angles = random_angles(np.random.default_rng(8), 50)
    form = TrigonometricForm(
        np.zeros((3, 3)), np.zeros(3), np.zeros((1, 1, 1)), guard=Guard(BarrierEnergy(3.0))
    )
    Theta = np.stack([angles, angles, angles], 1)
    found = enclosure(form, Boxes(Theta, Theta))
    parts = [
        (found.value, found.value_error),
        (found.gradient[:, 1], found.gradient_error[:, 1]),
        (found.hessian[:, 1, 1], found.hessian_error[:, 1, 1]),
    ]
    rigorous = form.rigorous(Theta[:1], 2)
    for n, angle in enumerate(angles.tolist()):
        for value, (middle, error) in zip(exact(3.0, angle)[:3], parts, strict=True):
            assert abs(value - float(middle[n])) <= float(error[n])
    for value, one, place in zip(exact(3.0, angles[0])[:3], rigorous, PLACES, strict=True):
        assert abs(value - float(one.values[place][0])) <= float(one.error[place[1:]])
