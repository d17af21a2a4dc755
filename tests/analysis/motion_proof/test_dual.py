"""Duals carry values and first derivatives of balls and series, and lose no error on the way."""

import numpy as np
import pytest
from flint import acb, arb, arb_series, ctx
from support.configs import BY_VARIANT, plain

from rbstab.analysis.motion_proof.dual import Dual, decimal_duals, objects
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.mechanics.derivatives import jacobian


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
