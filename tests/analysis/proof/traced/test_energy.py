"""Protects the bounds of formulas of users: they hold what mpmath computes, and are close.

mpmath computes the same Python formula, and its derivatives by its own differences.
"""

from fractions import Fraction
from itertools import product

import mpmath
import numpy as np
import pytest
from support.formulas import FORMULAS, recorded

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.formulas.functions import function
from rbstab.analysis.proof.formulas.program import check
from rbstab.analysis.proof.lines.intervals import between
from rbstab.analysis.proof.lines.over_boxes import over_boxes
from rbstab.analysis.proof.traced.energy import TracedEnergy
from rbstab.mechanics import numbers

POINTS = np.array([[0.3, 0.2, 0.9], [-0.7, 0.4, 1.3], [0.1, -0.8, -1.1]])


def energy(name):
    program = recorded(FORMULAS[name])
    check(program.operations)
    return TracedEnergy(name, program)


def exact(name, Theta, axes=()):
    """Return a derivative of a formula by mpmath."""
    orders = tuple(axes.count(axis) for axis in range(3))
    with mpmath.workdps(60):

        def formula(*angles):
            return FORMULAS[name](list(angles))

        return mpmath.diff(formula, tuple(map(mpmath.mpf, Theta)), orders)


def holds(bounds, place, value):
    # Differences of mpmath have an error of their own.
    slack = abs(value) * mpmath.mpf(10) ** -15
    return bounds.low[place] - slack <= value <= bounds.high[place] + slack


@pytest.mark.parametrize("name", FORMULAS)
def test_bounds_at_points_hold_the_exact_values_and_are_close(name):
    value, slope, bend = energy(name).at(POINTS, 2)
    for row, Theta in enumerate(POINTS.tolist()):
        assert holds(value, row, exact(name, Theta))
        for i in range(3):
            assert holds(slope, (row, i), exact(name, Theta, (i,)))
            for j in range(3):
                assert holds(bend, (row, i, j), exact(name, Theta, (i, j)))
    sizes = [np.abs(part.middle).max() for part in (value, slope, bend)]
    for part in (value, slope, bend):
        assert part.radius.max() <= 1e-12 * max(sizes)


@pytest.mark.parametrize("name", FORMULAS)
def test_bounds_over_boxes_hold_all_values(name):
    one = energy(name)
    radius = np.array([0.05, 0.03, 0.08])
    boxes = Boxes(POINTS - radius, POINTS + radius)
    value, slope, bend, third = one.over(np.zeros(0), boxes)
    assert np.all(third.size == 0)
    over = over_boxes([value, slope, bend, third], boxes.radius)
    for row, shares in product(range(len(POINTS)), product((-1, 0.4, 1), repeat=3)):
        Theta = (POINTS[row] + np.array(shares) * radius).tolist()
        assert over[0].low[row] <= exact(name, Theta) <= over[0].high[row]
        for i, j in product(range(3), repeat=2):
            assert holds(bend, (row, i, j), exact(name, Theta, (i, j)))


@pytest.mark.parametrize("name", FORMULAS)
def test_bounds_over_boxes_shrink_with_the_boxes(name):
    """The spread of the Hessian over a box falls with its size, so small boxes are decided."""
    one, widths = energy(name), []
    for size in (1e-2, 1e-3):
        radius = np.full_like(POINTS, size)
        widths.append(one.over(np.zeros(0), Boxes(POINTS - radius, POINTS + radius))[2].radius)
    assert np.all(widths[1] <= 0.15 * widths[0] + 1e-12)


@pytest.mark.parametrize("name", FORMULAS)
def test_values_to_round_off(name):
    value, slope, bend = energy(name).approximate(POINTS, 2)
    bounds = energy(name).at(POINTS, 2)
    for part, bound in zip((value, slope, bend), bounds, strict=True):
        np.testing.assert_allclose(part, bound.middle, rtol=1e-12, atol=1e-12)


def test_no_bound_where_a_formula_has_no_value():
    one = TracedEnergy("x", recorded(lambda T: numbers.sqrt_of(T[0]) + 1 / T[1]))
    points = np.array([[0.5, 0.5, 0], [-0.5, 0.5, 0], [0.5, 0.0, 0]])
    known = np.isfinite(one.at(points, 0)[0].radius)
    assert known.tolist() == [True, False, False]
    boxes = Boxes(points - 0.1, points + 0.1)
    assert one.has_bounds(boxes).tolist() == [True, False, False]
    assert np.all(np.isinf(one.steepest[:2]))
    assert np.isinf(one.largest)


@pytest.mark.parametrize("name", ["all functions", "a well"])
def test_bounds_of_all_the_range(name):
    one = energy(name)
    ends = np.array([np.pi, np.pi / 2, np.pi])
    Theta = np.random.default_rng(2).uniform(-ends, ends, (2000, 3))
    value, slope = one.approximate(Theta, 1)
    assert np.abs(value).max() <= one.largest
    assert np.all(np.abs(slope).max(axis=0) <= one.steepest)
    noise = one.noise
    assert 0 < noise[0] < 1e-9 * one.largest
    assert np.all(noise[1] < 1e-9 * one.steepest)


def test_a_constant_stands_for_all_numbers_that_round_to_it():
    one = TracedEnergy("x", recorded(lambda T: 0.1 + 0 * T[0] + T[1]))
    bounds = one.at(np.zeros((1, 3)), 0)[0]
    half_a_digit = Fraction(2) ** -57
    assert Fraction(bounds.low[0]) < Fraction(0.1) - half_a_digit
    assert Fraction(bounds.high[0]) > Fraction(0.1) + half_a_digit
    whole = TracedEnergy("x", recorded(lambda T: 3.0 * T[1])).at(np.array([[0.0, 0.5, 0.0]]), 1)
    assert whole[1].radius[0, 1] < 1e-14


def test_large_powers_have_no_bound():
    one = TracedEnergy("x", recorded(lambda T: T[0] ** 40))
    assert np.isnan(one.at(POINTS, 0)[0].radius).all()


@pytest.mark.parametrize(
    ("formula", "periodic"),
    [
        (lambda T: numbers.sin_of(T[0]) * numbers.cos_of(T[2]), True),
        (lambda T: numbers.sin_of(T[0]) + T[1], True),
        (lambda T: numbers.sin_of(T[0]) + T[2], False),
        (lambda T: numbers.sin_of(2 * T[0]), False),
        (lambda T: numbers.exp_of(T[0]), False),
        (lambda T: T[2], False),
        (lambda T: T[1], True),
    ],
)
def test_whole_turns(formula, periodic):
    assert TracedEnergy("x", recorded(formula)).periodic is periodic


def test_a_logarithm_without_a_value_has_no_slope():
    one = TracedEnergy("x", recorded(lambda T: numbers.log_of(T[0])))
    points = np.array([[-0.5, 0, 0], [0.5, 0, 0]])
    for part in one.at(points, 2):
        assert np.isfinite(part.radius).reshape(2, -1).all(axis=1).tolist() == [False, True]


def test_the_square_above_zero_and_its_derivatives():
    low = np.array([-1.0, -1.0, 0.0, 0.5, 1.0, -2.0, np.nan])
    high = np.array([-0.5, 1.0, 1.0, 0.5, 3.0, 0.0, 1.0])
    value, slope, bend = function("square_above", between(low, high))
    for row in range(6):
        for x in np.linspace(low[row], high[row], 7):
            above = max(x, 0.0)
            assert value.low[row] <= above * above <= value.high[row]
            assert slope.low[row] <= 2 * above <= slope.high[row]
            assert x == 0 or bend.low[row] <= (2 if x > 0 else 0) <= bend.high[row]
    assert -1e-290 < bend.low[0] <= bend.high[0] < 1e-290
    assert bend.low[4] == pytest.approx(2)
    assert np.isnan([one.radius[6] for one in (value, slope, bend)]).all()
    points = function("square_above", np.array([-1.0, 3.0]))
    np.testing.assert_array_equal(points, [[0, 9], [0, 6], [0, 2]])
