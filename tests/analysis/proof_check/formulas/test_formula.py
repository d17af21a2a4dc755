"""Protects the checker's formulas: bounds that hold what mpmath computes; nothing of the prover."""

from itertools import product

import mpmath
import pytest
from flint import arb, ctx
from support.formulas import FORMULAS, recorded

from rbstab.analysis.proof_check.formulas import series
from rbstab.analysis.proof_check.formulas.formula import Formula
from rbstab.mechanics import numbers

POINTS = ([0.3, 0.2, 0.9], [-0.7, 0.4, 1.3], [0.1, -0.8, -1.1])
RADIUS = (0.05, 0.03, 0.08)


def of(formula):
    return Formula({"name": "x", "operations": recorded(formula).operations})


def exact(name, Theta, axes=()):
    orders = tuple(axes.count(axis) for axis in range(3))
    with mpmath.workdps(60):
        point = tuple(mpmath.mpf(x) for x in Theta)
        return mpmath.diff(lambda *angles: FORMULAS[name](list(angles)), point, orders)


def holds(ball, value):
    slack = abs(value) * mpmath.mpf(10) ** -15
    with mpmath.workdps(30):
        low, high = (
            mpmath.mpf(str(end.str(25, radius=False))) for end in (ball.lower(), ball.upper())
        )
        return low - slack <= value <= high + slack


@pytest.mark.parametrize("name", FORMULAS)
def test_values_and_slopes_at_points(name):
    with ctx.workprec(128):
        for Theta in POINTS:
            centre = [arb(x) for x in Theta]
            found = of(FORMULAS[name]).over(centre, [arb(0)] * 3)
            assert holds(found.value, exact(name, Theta))
            assert found.value.rad() < 1e-12
            for i in range(3):
                assert holds(found.gradient[i], exact(name, Theta, (i,)))
                for j in range(3):
                    assert holds(found.hessian[i, j], exact(name, Theta, (i, j)))
                    assert found.hessian[i, j].rad() < 1e-11


@pytest.mark.parametrize("name", FORMULAS)
def test_bounds_over_boxes_hold_all_values(name):
    with ctx.workprec(128):
        for Theta in POINTS:
            centre, step = [arb(x) for x in Theta], [arb(0, r) for r in RADIUS]
            one = of(FORMULAS[name])
            found = one.over(centre, step)
            whole = one.value([a + b for a, b in zip(centre, step, strict=True)])
            assert whole.rad() < 5
            for shares in product((-1, 0.4, 1), repeat=3):
                point = [x + s * r for x, s, r in zip(Theta, shares, RADIUS, strict=True)]
                assert holds(whole, exact(name, point))
                for i, j in product(range(3), repeat=2):
                    assert holds(found.hessian[i, j], exact(name, point, (i, j)))


def test_steepest_slopes():
    with ctx.workprec(64):
        one = of(lambda T: 2.0 * numbers.sin_of(T[0]) + numbers.cos_of(T[1]) * 0.5)
        assert 2.0 <= one.steepest(0) <= 2.3
        assert 0.5 <= one.steepest(1) <= 0.7
        assert one.steepest(2) == 0
        assert not of(lambda T: 1 / T[0]).steepest(0).is_finite()


def test_whole_turns():
    assert of(lambda T: numbers.sin_of(T[0]) + T[1]).periodic
    for formula in (lambda T: T[0], lambda T: numbers.sin_of(T[2] + T[0]), lambda T: T[2] * T[1]):
        assert not of(formula).periodic


def test_no_number_where_there_is_no_value():
    with ctx.workprec(64):
        one = of(lambda T: numbers.sqrt_of(T[0]))
        assert (
            not one.over([arb(0.05), arb(0), arb(0)], [arb(0, 0.1)] * 3).hessian[0, 0].is_finite()
        )
        assert one.over([arb(0.5), arb(0), arb(0)], [arb(0, 0.1)] * 3).hessian[0, 0].is_finite()


def test_a_square_is_not_negative():
    with ctx.workprec(64):
        found = series.through(series.power(arb(0, 1), 2), series.variable(arb(0, 1), 0))
        assert found[series.ZERO] >= -1e-8  # a radius has 30 bits


@pytest.mark.parametrize(
    "operations",
    [
        [],
        [["theta", 3]],
        [["constant", "1"]],
        [["theta", 0], ["sin", 1]],
        [["theta", 0], ["+", 0]],
        [["theta", 0], ["abs", 0]],
        [["theta", 0], ["**", 0, 99]],
        [["theta", 0], ["sin", 0.0]],
    ],
)
def test_what_is_no_formula_is_refused(operations):
    with pytest.raises(ValueError, match="formula"):
        Formula({"name": "x", "operations": operations})


def test_a_logarithm_without_a_value_has_no_slope():
    with ctx.workprec(64):
        for angle, known in ((-0.5, False), (0.5, True)):
            one = of(lambda T: numbers.log_of(T[0]))
            found = one.over([arb(angle), arb(0), arb(0)], [arb(0)] * 3)
            assert found.gradient[0].is_finite() is known
            assert found.hessian[0, 0].is_finite() is known


@pytest.mark.parametrize("x", [-1.5, -0.0, 0.0, 1.25])
@pytest.mark.parametrize("radius", [0.0, 0.5, 2.0])
def test_the_square_above_zero(x, radius):
    """Its value, its slope 2 max(x, 0), and half of its second derivative: 0 or 1."""
    ball = arb(x, radius)
    value, slope, half = series.FUNCTIONS["square_above"](ball)
    for share in (-1.0, -0.3, 0.0, 0.9, 1.0):
        at = x + share * radius
        above = max(at, 0.0)
        assert value.contains(arb(above) * above)
        assert slope.contains(2 * arb(above))
        assert at == 0 or half.contains(1 if at > 0 else 0)
    if radius == 0 and x:
        assert half == (1 if x > 0 else 0)
    assert not series.FUNCTIONS["square_above"](arb("nan"))[0].is_finite()


@pytest.mark.parametrize("room", [0.1, 0.03])
def test_the_steepest_slope_of_a_root_that_comes_near_zero(room):
    """√(1 + e - cos(θ1 - a)): for the smaller e, only the parts of a wide box have a bound."""
    C, S = ["*", 1, 3], ["*", 2, 5]
    operations = [
        *(["theta", 0], ["cos", 0], ["sin", 0], ["constant", 0.6], C, ["constant", 0.8], S),
        *(["+", 4, 6], ["constant", 1.0 + room], ["-", 8, 7], ["sqrt", 9]),
    ]
    with ctx.workprec(128):
        found = [
            float(Formula({"name": "x", "operations": operations}).steepest(k)) for k in range(3)
        ]
    # The slope sin/(2√s) is at most 1/√2 for any e.
    largest = max(
        abs(mpmath.sin(x)) / (2 * mpmath.sqrt(1 + room - mpmath.cos(x)))
        for x in mpmath.linspace(-3, 3, 2001)
    )
    assert largest <= found[0] < 5
    assert found[1:] == [0, 0]


def test_a_formula_without_a_value_somewhere_has_no_steepest_slope_along_that_axis():
    """tan θ2 + sin θ1: whatever is halved, θ2 = ±π/2 has no value."""
    operations = [["theta", 1], ["tan", 0], ["theta", 0], ["sin", 2], ["+", 1, 3]]
    with ctx.workprec(128):
        formula = Formula({"name": "x", "operations": operations})
        assert float(formula.steepest(1)) == float("inf")
        assert 1 <= float(formula.steepest(0)) < 1.01
