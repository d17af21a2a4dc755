"""A path is called below a level only if all of it is, and only if it stays in its domain."""

from dataclasses import replace

import numpy as np
import pytest
from support.guards import parabola_with
from support.rest import inverted_pendulum

from rbstab.analysis.proof.boxes import RANGE_END, Boxes, box_around, joined, no_boxes, whole_range
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.soft import SoftEnergy
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.regions.downhill import Landscape, _upper, descent, stays_below
from rbstab.analysis.proof.trigonometric import TrigonometricForm

# U = ½ Σ θ_i².
BOWL = TrigonometricForm(np.eye(3), np.zeros(3), np.zeros((1, 1, 1)))
INSIDE = whole_range(0.999 * RANGE_END)


def at(*points):
    return np.array(points, dtype=float)


@pytest.mark.parametrize(("level", "below"), [(0.5 + 1e-9, True), (0.5 - 1e-9, False)])
def test_highest_point_of_a_path_decides(level, below):
    path = at([0, 0, 0], [1, 0, 0], [0, 0.5, 0])
    assert stays_below(BOWL, path, no_boxes(), level, INSIDE) is below
    assert stays_below(BOWL, path[::-1], no_boxes(), level, INSIDE) is below


def test_path_between_two_low_ends_may_cross_a_ridge():
    form = reduced_energy(inverted_pendulum([50.0, 150.0, 70.0], 100.0)).form
    # The top is at 0 J, the two ends are at -42 J.
    straight = at([-1.9, 0, 0], [1.9, 0, 0])
    ends = form.value(straight)
    assert np.all(ends < -41)
    assert stays_below(form, straight, no_boxes(), 1e-6, INSIDE)
    assert not stays_below(form, straight, no_boxes(), -1e-6, INSIDE)


def test_boxes_at_the_ends_count_with_all_their_points():
    path = at([0, 0, 0], [0.1, 0, 0])
    wide = Boxes(at([-1.0, -0.1, -0.1]), at([0.1, 0.1, 0.1]))
    assert stays_below(BOWL, path, wide, 0.511, INSIDE)
    assert not stays_below(BOWL, path, wide, 0.509, INSIDE)
    assert not stays_below(BOWL, path, joined([box_around(np.zeros(3), 0.01), wide]), 0.4, INSIDE)


@pytest.mark.parametrize("axis", range(3))
def test_path_must_stay_in_its_domain(axis):
    end = np.zeros(3)
    end[axis] = 1.01 * RANGE_END[axis]
    path = np.stack([np.zeros(3), end, np.zeros(3)])
    assert not stays_below(BOWL, path, no_boxes(), 100.0, INSIDE)
    assert not stays_below(BOWL, path[::2], box_around(end, 0.0), 100.0, INSIDE)
    assert stays_below(BOWL, 0.9 * path, no_boxes(), 100.0, INSIDE)


def test_descent_goes_down_all_along_and_away_from_saddles():
    form = reduced_energy(inverted_pendulum([50.0, 150.0, 70.0], 100.0)).form
    vertices = descent(form, np.array([1e-6, 0.3, -0.4]), INSIDE)
    assert np.all(np.diff(form.value(vertices)) < 0)
    np.testing.assert_allclose(form.approximate(vertices[-1:], 1)[1], 0, atol=1e-6)
    assert vertices[-1, 0] == pytest.approx(1.8954942670339809, abs=1e-6)  # θ = 2 sin θ
    assert np.abs(np.diff(vertices, axis=0)).max() <= 0.1 + 1e-12


def pendulum_landscape():
    form = reduced_energy(inverted_pendulum([50.0, 150.0, 70.0], 100.0)).form
    leaning = 1.8954942670339809
    minima = tuple(box_around(np.array([x, 0, 0]), 1e-9) for x in (leaning, -leaning))
    return Landscape(form, minima, RANGE_END)


def test_each_side_leads_to_its_own_minimum():
    landscape = pendulum_landscape()
    for side, minimum in ((0.5, 0), (-0.5, 1)):
        start = box_around(np.array([side, 0.0, 0.0]), 1e-6)
        assert landscape.reached_minimum(start, 0.0) == minimum
        # The start itself is not below this level.
        assert landscape.reached_minimum(start, -20.0) is None


def test_minimum_that_is_not_listed_is_not_reached():
    landscape = pendulum_landscape()
    other = Landscape(landscape.form, landscape.minima[1:], RANGE_END)
    assert other.reached_minimum(box_around(np.array([0.5, 0, 0]), 1e-6), 0.0) is None
    assert Landscape(landscape.form, (), RANGE_END).reached_minimum(landscape.minima[0], 0) is None


JUMPS = {
    "repelling": Guard(None, (SoftEnergy(5.0, 0.0, 0.5),)),
    "stop": Guard(None, (SoftEnergy(np.inf, 0.0, 0.5),)),
}


@pytest.mark.parametrize("kind", JUMPS)
def test_ways_down_go_on_along_the_angle_of_a_guard(kind):
    """The lowest point is at the angle. On the way a step would cross it, or leave it again."""
    guard, rng = JUMPS[kind], np.random.default_rng(0)
    form = parabola_with(guard, [0.3, 0.7, -0.2])
    form = replace(form, quadratic=form.quadratic + 0.4 * (1 - np.eye(3)))
    held = np.linalg.solve(
        form.quadratic[np.ix_([0, 2], [0, 2])],
        -(form.linear[[0, 2]] + 0.5 * form.quadratic[[0, 2], 1]),
    )
    lowest = np.array([held[0], 0.5, held[1]])
    size = np.array([1e-9, 5e-16, 1e-9])
    minimum = Boxes((lowest - size)[np.newaxis], (lowest + size)[np.newaxis])
    end = np.array([2.0, min(1.5, guard.end), 2.0])
    landscape = Landscape(form, (minimum,), end)
    for _ in range(20):
        start = rng.uniform(-1, 1, 3) * [1.5, 0.45, 1.5]
        vertices = descent(form, start, landscape.domain)
        np.testing.assert_allclose(vertices[-1], lowest, atol=1e-6)
        # The last step may be shorter than what round-off lets one see of the energy.
        assert np.all(np.diff(form.value(vertices)) < 4 * np.spacing(1.0))
        level = float(form.value(start[np.newaxis])[0]) + 1e-9
        assert landscape.reached_minimum(box_around(start, 0.0), level) == 0
        assert landscape.reached_minimum(box_around(start, 0.0), level - 1e-6) is None


def test_the_other_side_of_a_guard_is_reached_where_it_cannot_hold():
    form = parabola_with(Guard(None, (SoftEnergy(0.1, 0.0, 0.5),)), [0.3, 0.7, -0.2])
    vertices = descent(form, np.zeros(3), whole_range(np.array([2.0, 1.5, 2.0])))
    np.testing.assert_allclose(vertices[-1], [0.3, 0.6, -0.2], atol=1e-9)
    assert 0.5 in vertices[:, 1]


def test_bounds_along_a_stop_hold_beside_its_rounded_angle():
    steep = 1e8
    form = parabola_with(JUMPS["stop"], [0.0, 0.0, 0.0])
    form = replace(form, linear=np.array([0.0, steep, 0.0]))
    flat = Boxes(np.array([[0.0, 0.5, 0.0]]), np.array([[0.1, 0.5, 0.1]]))
    assert _upper(form, flat)[0] > steep * (0.5 + 5e-15)
