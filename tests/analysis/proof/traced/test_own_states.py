"""Protects the least energy over own states: its bounds hold what mpmath finds, and are close.

mpmath computes the same Python formula, its lowest point, and derivatives by its own differences.
"""

from itertools import product

import mpmath
import numpy as np
import pytest
from support.formulas import recorded_of_own_states

from rbstab.analysis.proof.boxes import RANGE_END, Boxes
from rbstab.analysis.proof.formulas.convexity import is_convex
from rbstab.analysis.proof.lines.over_boxes import over_boxes
from rbstab.analysis.proof.traced import own_states_bounds
from rbstab.analysis.proof.traced.own_states import OwnStatesEnergy
from rbstab.analysis.proof.traced.own_states_bounds import OwnStatesBounds
from rbstab.mechanics import numbers

POINTS = np.array([[0.3, 0.2, 0.9], [-0.7, 0.4, 1.3], [0.1, -0.8, -1.1]])


def along(Theta):
    """A displacement that the attitude makes."""
    return numbers.sin_of(Theta[0]) * numbers.cos_of(Theta[1]) + 0.4 * numbers.sin_of(Theta[2])


def linear(Theta, D):
    """Two springs in a row: k = 6 and 3."""
    stretch = along(Theta) - D[0]
    return 3.0 * stretch * stretch + 1.5 * D[0] * D[0]


def cord(Theta, D):
    """A spring that stiffens, in a row with a linear one."""
    x = 2.0 * (along(Theta) - D[0])
    return 3.0 * (numbers.exp_of(x) - x - 1.0) + 1.5 * D[0] * D[0]


def chain(Theta, D):
    """Three springs in a row that stiffen, with two points between them."""
    first, second = along(Theta) - D[0], D[0] - 0.5 * D[1]
    cosh = numbers.cosh_of(second - 0.2 * numbers.cos_of(Theta[2]))
    return first**2 + 0.3 * first**4 + 2.0 * cosh + D[1] ** 2 + 0.1 * numbers.exp_of(D[1])


FORMULAS = {"linear": (linear, 1), "cord": (cord, 1), "chain": (chain, 2)}


def energy(name):
    formula, count = FORMULAS[name]
    program = recorded_of_own_states(formula, count)
    assert is_convex(program)
    return OwnStatesEnergy(name, program, count)


def lowest(name, Theta):
    """Return the lowest point at an attitude by mpmath."""
    formula, count = FORMULAS[name]

    def slope(*D):
        return [
            mpmath.diff(lambda *d: formula(Theta, d), D, tuple(int(i == k) for k in range(count)))
            for i in range(count)
        ]

    begin = energy(name).lowest(np.array([[float(one) for one in Theta]]))[0]
    start = [mpmath.mpf(float(one)) for one in begin]
    return list(mpmath.findroot(slope, start, tol=1e-60))


def exact(name, Theta, axes=()):
    """Return a derivative of the least energy by mpmath."""
    orders = tuple(axes.count(axis) for axis in range(3))
    with mpmath.workdps(50):

        def least(*angles):
            return FORMULAS[name][0](angles, lowest(name, angles))

        return mpmath.diff(least, tuple(map(mpmath.mpf, Theta)), orders)


def holds(bounds, place, value):
    # Differences of mpmath have an error of their own.
    slack = (1 + abs(value)) * mpmath.mpf(10) ** -15
    return bounds.low[place] - slack <= value <= bounds.high[place] + slack


@pytest.mark.parametrize("name", FORMULAS)
def test_bounds_at_points_hold_the_exact_values_and_are_close(name):
    value, slope, bend = energy(name).at(POINTS, 2)
    for row, Theta in enumerate(POINTS.tolist()):
        assert holds(value, row, exact(name, Theta))
        for i in range(3):
            assert holds(slope, (row, i), exact(name, Theta, (i,)))
    for i, j in product(range(3), repeat=2):
        assert holds(bend, (0, i, j), exact(name, POINTS[0].tolist(), (i, j)))
    for part in (value, slope, bend):
        assert part.radius.max() <= 1e-12 * max(1.0, np.abs(part.middle).max())


def test_two_linear_springs_in_a_row_are_one():
    """1/k = 1/6 + 1/3, so k = 2 and V = x²."""
    rng = np.random.default_rng(3)
    Theta = rng.uniform(-RANGE_END, RANGE_END, (200, 3))
    value, *_ = energy("linear").at(Theta, 0)
    x = np.sin(Theta[:, 0]) * np.cos(Theta[:, 1]) + 0.4 * np.sin(Theta[:, 2])
    np.testing.assert_allclose(value.middle, x * x, atol=1e-13)
    np.testing.assert_allclose(energy("linear").lowest(Theta)[:, 0], x * 2 / 3, atol=1e-14)


@pytest.mark.parametrize("name", FORMULAS)
@pytest.mark.parametrize("size", [0.02, 0.15])
def test_bounds_over_boxes_hold_all_values(name, size):
    one, rng = energy(name), np.random.default_rng(1)
    radius = size * np.array([1.0, 0.6, 1.4])
    centres = rng.uniform(-1.2, 1.2, (40, 3))
    boxes = Boxes(centres - radius, centres + radius)
    value, slope, bend, third = one.over(np.zeros(0), boxes)
    assert np.all(third.size == 0)
    known = np.isfinite(bend.radius).all(axis=(1, 2))
    assert known.mean() > (0.9 if size < 0.1 else 0.3)
    over = over_boxes([value, slope, bend, third], boxes.radius)
    for shares in product((-1, 0.4, 1), repeat=3):
        found = one.approximate(centres + np.array(shares) * radius, 2)
        for bounds, inside in zip((*over[:2], bend), found, strict=True):
            slack = 1e-12 * (1 + np.abs(inside[known]).max())
            assert np.all(bounds.low[known] - slack <= inside[known])
            assert np.all(inside[known] <= bounds.high[known] + slack)


def test_the_spread_of_the_hessian_falls_with_the_boxes():
    widths = []
    for radius in (0.08, 0.04, 0.02, 0.01):
        _, _, bend, _ = energy("chain").over(np.zeros(0), Boxes(POINTS - radius, POINTS + radius))
        widths.append(bend.radius.max())
    ratios = np.array(widths[1:]) / widths[:-1]
    assert np.all(ratios < 0.62)


@pytest.mark.parametrize("name", FORMULAS)
def test_bounds_of_all_the_range_hold_everywhere(name):
    one, rng = energy(name), np.random.default_rng(2)
    value, slopes = one.approximate(rng.uniform(-RANGE_END, RANGE_END, (2000, 3)), 1)
    assert np.abs(value).max() <= one.largest < 30 * np.abs(value).max()
    most = np.abs(slopes).max(axis=0)
    assert np.all(most <= one.steepest)
    assert np.all(one.steepest < 5 * most)
    assert one.noise[0] > 0


WITHOUT = {
    "no least value": lambda T, D: numbers.exp_of(D[0] + along(T)),
    "flat at the bottom": lambda T, D: (D[0] - along(T)) ** 4,
    "flat along a line": lambda T, D: (D[0] + D[1] - along(T)) ** 2,
    "constant": lambda T, D: along(T) * along(T) + 0.0 * D[0],
}


@pytest.mark.parametrize("name", WITHOUT)
def test_without_one_lowest_point_there_are_no_bounds(name):
    one = OwnStatesEnergy(name, recorded_of_own_states(WITHOUT[name], 2), 2)
    assert is_convex(one.program)
    assert not one.has_values(POINTS)
    for part in one.over(np.zeros(0), Boxes(POINTS - 0.01, POINTS + 0.01))[:3]:
        assert not np.any(np.isfinite(part.radius))


def test_a_lowest_point_far_away_is_found():
    def far(Theta, D):
        return numbers.exp_of(D[0] - 40.0) - D[0] + 0.0 * Theta[0]

    one = OwnStatesEnergy("far", recorded_of_own_states(far, 1), 1)
    np.testing.assert_allclose(one.lowest(POINTS), 40.0, rtol=1e-14)
    value, *_ = one.at(POINTS, 0)
    np.testing.assert_allclose(value.middle, -39.0, rtol=1e-14)
    assert value.radius.max() < 1e-12


def test_an_own_state_moves_with_the_attitude_over_a_box():
    """D = D̂ + Cδ + ζ: all these values are in the bounds that formulas are computed from."""
    program = recorded_of_own_states(lambda T, D: (D[0] - 3.0 * T[0] + 2.0 * T[2]) ** 2, 1)
    radius = np.array([0.1, 0.2, 0.3])
    bounds = OwnStatesBounds(program, 1, Boxes(POINTS - radius, POINTS + radius))
    np.testing.assert_allclose(bounds.C[0, 0], [3.0, 0.0, -2.0], atol=1e-12)
    place = program.operations.index(("length", 0))
    over = bounds.over[place].rows[0]
    assert np.all(over.low <= bounds.own[:, 0] - 0.9)
    assert np.all(over.high >= bounds.own[:, 0] + 0.9)
    assert over.radius.max() < 0.901


@pytest.mark.parametrize("name", FORMULAS)
def test_the_hessian_is_bounded_for_all_lowest_points_of_a_box(name, monkeypatch):
    radius, rng = np.array([0.1, 0.1, 0.15]), np.random.default_rng(6)
    one = energy(name)
    bounds = OwnStatesBounds(one.program, one.count, Boxes(POINTS - radius, POINTS + radius))
    assert bounds.lowest.proved.all()
    for _ in range(40):
        step = rng.uniform(-radius, radius, POINTS.shape)
        moved = bounds.own + np.einsum("mki,mi->mk", bounds.C, step)
        zeta = one.lowest(POINTS + step) - moved
        xi = np.linalg.solve(bounds.B, zeta[:, :, np.newaxis])[:, :, 0]
        assert np.all(np.abs(xi) <= bounds.lowest.widths + 1e-14)
    used, within = [], bounds._within

    def noted(widths):
        used.append(widths)
        return within(widths)

    monkeypatch.setattr(bounds, "_within", noted)
    assert np.isfinite(bounds.hessian.radius).all()
    assert np.isfinite(bounds.slopes.radius).all()
    assert all(np.all(widths >= bounds.lowest.widths) for widths in used)
    assert used


@pytest.mark.parametrize("name", FORMULAS)
def test_bounds_hold_for_any_slopes_of_the_own_states(name, monkeypatch):
    """C only makes them close. With C = 0, what the minimum takes off the Hessian is large."""
    one = energy(name)
    exactly = one.approximate(POINTS, 2)
    monkeypatch.setattr(own_states_bounds, "following", lambda H: np.zeros((len(H), one.count, 3)))
    radius = np.full(3, 0.01)
    found = one.over(np.zeros(0), Boxes(POINTS - radius, POINTS + radius))
    for bounds, inside in zip(found[:3], exactly, strict=True):
        assert np.all(np.isfinite(bounds.radius))
        assert np.all((bounds.low - 1e-12 <= inside) & (inside <= bounds.high + 1e-12))
    assert np.all(found[2].radius.max(axis=(1, 2)) > 0.1)
