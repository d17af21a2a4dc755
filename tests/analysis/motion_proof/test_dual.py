"""Duals carry values and first derivatives of balls and series, and lose no error on the way."""

import mpmath
import numpy as np
import pytest
from flint import acb, arb, arb_series, ctx
from support.configs import BY_VARIANT, plain

from rbstab.analysis.motion_proof.dual import Dual, decimal_duals, objects
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import FUNCTIONS as FUNCTION_OF


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_slopes_of_the_rates_are_their_jacobian(variant):
    config = load_config(plain(BY_VARIANT[variant]))
    system, doubles = system_of(config, decimal_duals), problem_of(config).system
    y = np.random.default_rng(3).uniform(-0.5, 0.5, system.size)
    state = objects([Dual(arb(x), {k: arb(1)}) for k, x in enumerate(y.tolist())])
    found = np.zeros((system.size, system.size))
    for row, rate in zip(found, system.rates(state), strict=True):
        for index, slope in rate.slopes.items():
            row[index] = float(slope)
    expected = jacobian(doubles.rates, y)
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_a_complex_ball_and_a_series_give_the_rates(variant):
    config = load_config(plain(BY_VARIANT[variant]))
    system, doubles = system_of(config, decimal_duals), problem_of(config).system
    y = np.random.default_rng(4).uniform(-0.5, 0.5, system.size)
    slope = np.random.default_rng(5).uniform(-0.5, 0.5, system.size)
    old, ctx.cap = ctx.cap, 2
    try:
        lines = [arb_series([a, b]) for a, b in zip(y.tolist(), slope.tolist(), strict=True)]
        series = [rate.value for rate in system.rates(objects([Dual(line) for line in lines]))]
    finally:
        ctx.cap = old
    balls = [rate.value for rate in system.rates(objects([Dual(acb(x)) for x in y.tolist()]))]
    rates = doubles.rates(y)
    along = jacobian(doubles.rates, y) @ slope
    size = 1e-12 * (1 + np.abs(rates).max() + np.abs(along).max())
    assert [float(ball.real) for ball in balls] == pytest.approx(rates.tolist(), abs=size)
    assert [float(s[0]) for s in series] == pytest.approx(rates.tolist(), abs=size)
    assert [float(s[1]) for s in series] == pytest.approx(along.tolist(), abs=size)


def test_a_number_of_a_config_is_its_decimal():
    # 0.1 is not the double 0.1000000000000000055...
    with ctx.workprec(200):
        (value,) = decimal_duals(np.array([0.1]))
        assert value.value.contains(arb(1) / 10)
        assert not value.value.contains(arb(0.1))
    assert decimal_duals(np.array([[0.0, 2.0]]))[0, 0] == 0.0


def test_zeros_and_ones_are_exact():
    x = Dual(arb(3), {0: arb(2)})
    assert 0.0 * x == 0.0
    assert x * 1.0 is x
    assert x + 0 is x
    assert (0.0 - x).value == -3
    assert (1.0 / x).slopes[0].contains(arb(-2) / 9)


@pytest.mark.parametrize("other", [arb(0, 1), 1j, "1", None])
def test_numbers_whose_error_would_be_lost_are_refused(other):
    with pytest.raises(TypeError):
        Dual(arb(1)) + other
    with pytest.raises(TypeError):
        Dual(arb(1)) * other


def test_a_division_by_a_number_that_may_be_zero_is_not_finite():
    assert not (1.0 / Dual(arb(0, 1))).value.is_finite()


def test_a_square_root_has_its_slope_and_stays_off_the_branch_cut():
    root = Dual(arb(9), {1: arb(5)}).sqrt()
    assert float(root.value) == 3
    assert float(root.slopes[1]) == pytest.approx(5 / 6)
    series = Dual(arb_series([4, 1])).sqrt().value
    assert [float(series[0]), float(series[1])] == [2.0, 0.25]
    # A small disc about 4 is the square of one about 2; one about 1 that contains 0 has no root.
    near = Dual(acb(arb(4, 0.01), arb(0, 0.01)), {0: acb(1)}).sqrt()
    assert near.value.contains(2)
    assert near.slopes[0].contains(arb(1) / 4)
    for value in (acb(arb(1, 2), arb(0, 1)), acb(arb(-1), arb(0, 1e-9)), arb(1, 2)):
        assert not Dual(value).sqrt().value.is_finite()


FUNCTIONS = ("sin", "cos", "tan", "atan", "sqrt", "exp", "log", "sinh", "cosh", "tanh")


def of_mpmath(name, x):
    """Return a function and its slope, to 40 digits, as balls."""
    with mpmath.workdps(60), ctx.workprec(200):
        function = getattr(mpmath, name)
        pair = function(x), mpmath.diff(function, x)
        return [arb(mpmath.nstr(value, 40)) for value in pair]


@pytest.mark.parametrize("x", [0.3, 1.25, 2.5])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_of_balls_and_of_complex_ones_have_their_slopes(name, x):
    value, slope = of_mpmath(name, x)
    with ctx.workprec(100):
        found = FUNCTION_OF[name](Dual(arb(x), {2: arb(3)}))
        complex_ball = FUNCTION_OF[name](Dual(acb(x), {2: acb(3)}))
        for one in (found.value, complex_ball.value.real):
            assert float(abs(one - value)) < 1e-20
        for one in (found.slopes[2], complex_ball.slopes[2].real):
            assert float(abs(one - 3 * slope)) < 1e-18


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_of_series_have_the_slope_as_coefficient(name):
    value, slope = of_mpmath(name, 0.7)
    old, ctx.cap = ctx.cap, 3
    try:
        found = FUNCTION_OF[name](Dual(arb_series([arb(0.7), arb(2)]), {0: arb(1)}))
        assert float(abs(found.value[0] - value)) < 1e-14
        assert float(abs(found.value[1] - 2 * slope)) < 1e-13
        assert float(abs(found.slopes[0][0] - slope)) < 1e-14
    finally:
        ctx.cap = old


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_of_wide_balls_contain_those_of_their_points(name):
    wide = FUNCTION_OF[name](Dual(arb(1.0, 0.2), {0: arb(1)}))
    disc = FUNCTION_OF[name](Dual(acb(arb(1.0, 0.2), arb(0, 0.2)), {0: acb(1)}))
    for x in (0.8, 0.95, 1.0, 1.2):
        value, slope = of_mpmath(name, x)
        assert wide.value.contains(value.mid())
        assert wide.slopes[0].contains(slope.mid())
        assert disc.value.real.contains(value.mid())
        assert disc.slopes[0].real.contains(slope.mid())


NOT_ANALYTIC = {
    "sqrt": (-1.0, 0.0),
    "log": (-1.0, 0.0),
    "atan": (0.0, 2.0),
    "tan": (np.pi / 2, 0.0),
    "tanh": (0.0, np.pi / 2),
}


@pytest.mark.parametrize("name", NOT_ANALYTIC)
def test_where_a_function_is_not_analytic_it_is_no_number(name):
    """On its branch cut, or at a pole: a bound there would be one of no analytic function."""
    real, imaginary = NOT_ANALYTIC[name]
    for radius in (1e-9, 0.1):
        near = acb(arb(real, radius), arb(imaginary, radius))
        found = FUNCTION_OF[name](Dual(near, {0: acb(1)}))
        assert not found.value.is_finite() or not found.slopes[0].is_finite()
    away = acb(arb(real + 0.5, 0.1), arb(imaginary + 0.5, 0.1))
    assert FUNCTION_OF[name](Dual(away, {0: acb(1)})).value.is_finite()
