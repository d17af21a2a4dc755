"""Protects the bounds on W and its derivatives over boxes: they hold, and they are narrow."""

import numpy as np
import pytest
from support.tied_springs import K_D, spring_of, tied_system

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.lines.intervals import Intervals
from rbstab.analysis.proof.tied.bounds import Pose, SpringBounds
from rbstab.analysis.proof.tied.energy import tied_energy_of_doubles
from rbstab.analysis.proof.tied.krawczyk import image

SPRINGS = [spring_of(), spring_of((-0.2, 0.1, 0.0), (-0.6, 0.2, -0.1), 500.0, 0.7)]


@pytest.fixture(scope="module")
def W():
    return tied_energy_of_doubles(tied_system(SPRINGS, K_d=K_D))


def value_at(W, y):
    Theta, z = y[:3], y[3:]
    found = W.form.value(Theta[None])[0] + 0.5 * z @ W.stiffness @ z
    for line in W.lines:
        e = z + np.array([form.value(Theta[None])[0] for form in line.offset])
        found += line.weight * np.linalg.norm(e)
    return found


def differences(function, y, step):
    """Return the derivatives of a function by central differences."""
    moves = step * np.eye(6)
    return np.array([(function(y + h) - function(y - h)) / (2 * step) for h in moves])


def contains(found, values, margin):
    return np.all((found.low <= values + margin) & (values - margin <= found.high))


@pytest.mark.parametrize("radius", [0.0, 1e-3, 0.1])
@pytest.mark.parametrize("seed", range(3))
def test_bounds_contain_the_derivatives_by_differences(W, seed, radius):
    rng = np.random.default_rng(seed)
    y = np.concatenate([rng.uniform(-1.5, 1.5, 3), 0.1 * rng.normal(size=3)])
    box = Boxes((y - radius)[None], (y + radius)[None])
    pose = Pose(W, Boxes(box.low[:, :3], box.high[:, :3]))
    z = Boxes(box.low[:, 3:], box.high[:, 3:])
    bounds = pose.within(z)
    for _ in range(5):
        inside = y + radius * rng.uniform(-1, 1, 6)
        slopes = differences(lambda x: value_at(W, x), inside, 1e-5)
        bends = differences(lambda x: differences(lambda u: value_at(W, u), x, 1e-4), inside, 1e-4)
        assert contains(bounds.value, value_at(W, inside), 1e-9)
        # Differences have errors of round-off and of the fourth derivatives.
        assert contains(bounds.gradient, slopes, 1e-4)
        assert contains(bounds.hessian, bends, 0.05)
    if radius == 0.0:
        assert np.all(bounds.gradient.radius < 1e-9)
        assert np.all(bounds.hessian.radius < 1e-8)
        np.testing.assert_allclose(bounds.gradient.middle[0], slopes, atol=1e-4)


def of_spring(bounds):
    """Return the bounds of the first line, which is that of a spring."""
    line = bounds.lines[0]
    assert isinstance(line, SpringBounds)
    return line


def test_a_line_that_may_have_no_length_has_a_direction_but_no_curvature(W):
    Theta = np.array([0.3, -0.2, 0.5])
    pose = Pose(W, Boxes(Theta[None], Theta[None]))
    r = pose.offset(pose.at_centre, 0).middle
    bounds = pose.within(Boxes(-r - 0.1, -r + 0.1))
    u = of_spring(bounds).direction
    assert np.all((u.low <= -1) & (u.high >= 1))
    assert np.all((u.low > -1.001) & (u.high < 1.001))
    with np.errstate(all="ignore"):
        assert not np.any(np.isfinite(bounds.hessian.radius[:, 3:, 3:]))


def test_the_direction_is_sharp():
    """Of e = (3 ± 1, 4, 0), the entries of u are 2/√20 to 4/√32, and 4/√32 to 4/√20."""
    W = tied_energy_of_doubles(tied_system([spring_of()]))
    pose = Pose(W, Boxes(np.zeros((1, 3)), np.zeros((1, 3))))
    r = pose.offset(pose.at_centre, 0).middle
    e = np.array([[2.0, 4.0, 0.0]]), np.array([[4.0, 4.0, 0.0]])
    u = of_spring(pose.within(Boxes(e[0] - r, e[1] - r))).direction
    np.testing.assert_allclose(u.low[0], [2 / np.sqrt(20), 4 / np.sqrt(32), 0], atol=1e-12)
    np.testing.assert_allclose(u.high[0], [4 / np.sqrt(32), 4 / np.sqrt(20), 0], atol=1e-12)


def test_forces_that_cannot_balance_are_seen():
    """At a rest state |Sz| = |w| with one spring; w is -450 N."""
    W = tied_energy_of_doubles(tied_system([spring_of()]))
    pose = Pose(W, Boxes(np.zeros((3, 3)), np.zeros((3, 3))))
    direction = np.array([0.6, 0.0, 0.8])
    z = np.array([np.linalg.solve(W.stiffness, pull * direction) for pull in (449.0, 450.0, 451.0)])
    bounds = pose.within(Boxes(z - 1e-9, z + 1e-9))
    np.testing.assert_array_equal(bounds.unbalanced, [True, False, True])


def test_krawczyk_of_a_linear_gradient_is_its_zero():
    """With ∇W = H(y - c) the image of each box with c is c; one without c is empty."""
    rng = np.random.default_rng(0)
    H = rng.normal(size=(6, 6)) + 6 * np.eye(6)
    c = np.full(6, 0.3)
    low = np.array([c - 0.1, c - 0.3, c + 0.1])
    boxes = Boxes(low, low + 0.35)
    gradient = np.einsum("ij,mj->mi", H, boxes.centre - c)
    hessians = np.broadcast_to(H, (3, 6, 6))
    exact = [Intervals(one, 0 * one) for one in (gradient, hessians)]
    found = image(boxes, exact[0], hessians, exact[1])
    np.testing.assert_allclose(found.box.low[:2], [c, c], atol=1e-12)
    np.testing.assert_allclose(found.box.high[:2], [c, c], atol=1e-12)
    assert np.all(found.box.low[:2] <= c)
    assert np.all(found.box.high[:2] >= c)
    assert np.any(found.box.low[2] > found.box.high[2])
    np.testing.assert_array_equal(found.at_least_one_zero, [True, True, False])
    assert np.all(found.at_most_one_zero)
