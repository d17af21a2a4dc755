"""Protects the bounds on the length of a line: at points, over boxes, and at all attitudes.

Lengths are |R + A(p - R) - anchor| with a rotation written here, in balls of 400 bits; derivatives
are their differences.
"""

from itertools import product

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from support.held_springs import R, energy_of, held_system, length_of, random_springs

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import lower_bounds, upper_bounds
from rbstab.analysis.proof.lines.over_boxes import at_centres, over_boxes
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.trigonometric import TrigonometricForm

seeds = st.integers(0, 2**32)
STEP = 2.0**-40


def exact_length(spring, Theta):
    """Return the length of a held body's spring at a ball of Θ."""
    (s1, c1), (s2, c2), (s3, c3) = (angle.sin_cos() for angle in Theta)
    x, y, z = (
        arb(float(one)) - arb(float(other)) for one, other in zip(spring.point, R, strict=True)
    )
    x, y = c3 * x - s3 * y, s3 * x + c3 * y
    x, z = c2 * x + s2 * z, c2 * z - s2 * x
    y, z = c1 * y - s1 * z, s1 * y + c1 * z
    e = [
        turned + arb(float(contact)) - arb(float(anchor))
        for turned, contact, anchor in zip((x, y, z), R, spring.anchor, strict=True)
    ]
    return (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]).sqrt()


def exact_derivative(spring, Theta, axes):
    """Return a derivative of the length by central differences; the error is about 1e-24."""
    total = arb(0)
    for signs in product((-1, 1), repeat=len(axes)):
        moved = [arb(float(angle)) for angle in Theta]
        for axis, sign in zip(axes, signs, strict=True):
            moved[axis] += sign * arb(STEP)
        total += int(np.prod(signs)) * exact_length(spring, moved)
    return total / (2 * arb(STEP)) ** len(axes)


def line_and_spring(seed):
    """Return the line of a random spring, and the spring."""
    (spring,) = random_springs(np.random.default_rng(seed), 1)
    (line,) = reduced_energy(held_system([spring])).form.lines
    return line, spring


@pytest.mark.parametrize("seed", range(4))
def test_derivatives_at_points_contain_those_of_the_length(seed):
    line, spring = line_and_spring(seed)
    Theta = np.random.default_rng(seed).uniform(-3, 3, size=(3, 3))
    found, near = line.at(Theta, 3), line.approximate(Theta, 2)
    weight = -arb(spring.stiffness) * arb(spring.rest_length)
    for order in range(4):
        for axes in product(range(3), repeat=order):
            for place, point in enumerate(Theta):
                with ctx.workprec(400):
                    exact = weight * exact_derivative(spring, point, axes)
                middle, radius = (
                    float(part[(place, *axes)]) for part in vars(found[order]).values()
                )
                assert abs(exact - middle) <= radius
                assert radius <= 1e-9 * float(np.abs(found[order].middle).max())
                if order < 3:
                    assert near[order][(place, *axes)] == pytest.approx(middle, rel=1e-9, abs=1e-8)


@settings(max_examples=8, deadline=None)
@given(seeds)
def test_bounds_over_boxes_contain_the_energy_of_the_body(seed):
    """With two springs; near the least length of a spring, its derivatives are large."""
    rng = np.random.default_rng(seed)
    springs = random_springs(rng, 2)
    form = reduced_energy(held_system(springs)).form
    centre = rng.uniform(-3, 3, size=(6, 3))
    radius = 10.0 ** rng.uniform(-3, 0, size=(6, 3))
    boxes = Boxes(centre - radius, centre + radius)
    found = enclosure(form, boxes)
    low, high = lower_bounds(found), upper_bounds(found)
    weights = rng.random(size=(6, 24, 3))
    weights[:, :16] = np.round(weights[:, :16])
    for n in range(6):
        points = boxes.low[n] + weights[n] * (boxes.high - boxes.low)[n]
        value, gradient, hessian = form.approximate(points, 2)
        size = 1e-9 * (1 + np.abs(hessian).max())
        np.testing.assert_allclose(value, [energy_of(springs, x) for x in points], rtol=1e-9)
        assert np.all((value >= low[n] - size) & (value <= high[n] + size))
        linear = found.gradient[n] + (points - boxes.centre[n]) @ found.hessian[n].T
        assert np.all(np.abs(gradient - linear) <= found.curvature[n] + size)
        assert np.all(np.abs(hessian - found.hessian[n]) <= found.hessian_radius[n] + size)
        if found.monotonic[n]:
            assert np.any(gradient.min(axis=0) * gradient.max(axis=0) > 0)


def test_third_derivatives_over_a_box_contain_those_at_its_points():
    line, spring = line_and_spring(2)
    rng = np.random.default_rng(0)
    form = reduced_energy(held_system([spring])).form
    centre = rng.uniform(-2, 2, size=(4, 3))
    found = enclosure(form, Boxes(centre - 0.2, centre + 0.2))
    for n in range(4):
        points = centre[n] + 0.2 * rng.choice([-1.0, 1.0], size=(6, 3))
        smooth = form.derivatives(form.basis(points), points, 3)[3].values
        third = smooth + line.at(points, 3)[3].middle
        assert np.all(np.abs(third) <= found.third[n])


@pytest.mark.parametrize("seed", range(6))
def test_slopes_and_energies_have_the_bounds_of_lemma_7(seed):
    line, spring = line_and_spring(seed)
    Theta = np.random.default_rng(seed).uniform(-np.pi, np.pi, size=(3000, 3))
    value, slope = line.approximate(Theta, 1)
    assert np.all(np.abs(slope).max(axis=0) <= line.steepest)
    assert np.abs(value).max() <= line.largest
    # The slope by θ1 is at most the distance of the point from the axis, and reaches much of it.
    assert np.abs(slope).max(axis=0)[0] >= 0.2 * line.steepest[0]
    assert length_of(spring, Theta[0]) ** 2 >= line.least


def test_a_function_over_boxes_contains_its_values():
    """From the centres and the third derivatives alone; a wave nearly reaches these bounds."""
    coefficients = np.zeros((3, 3, 3))
    coefficients[2, 0, 0], coefficients[0, 0, 0] = 1.0, 3.0
    wave = TrigonometricForm(np.zeros((3, 3)), np.zeros(3), coefficients)
    rng = np.random.default_rng(0)
    centre, radius = rng.uniform(-3, 3, size=(50, 3)), np.full((50, 3), 0.05)
    boxes = Boxes(centre - radius, centre + radius)
    found = at_centres(wave, wave.basis(boxes.centre), boxes)
    over = over_boxes(found, boxes.radius)
    for end in (boxes.low, boxes.high):
        exact = [part.values for part in wave.derivatives(wave.basis(end), end, 3)]
        for part, values in zip(over, exact, strict=True):
            assert np.all((part.low <= values) & (values <= part.high))
    widths = [float(part.radius.max()) for part in over]
    assert max(widths[1:]) < 0.06
    assert widths[0] < 0.06
