"""Protects numbers with bounded errors: the exact value is within the bound, which is small."""

import math
import operator
from fractions import Fraction
from functools import partial

import mpmath
import numpy as np
import pytest
from support.paper_runs import CASES, paper_config

import rbstab
from rbstab.analysis.bounded import (
    MANY_ANGLES,
    STEP,
    UNIT,
    Bounded,
    bounded_decimals,
)
from rbstab.analysis.exact import decimal_balls, in_balls
from rbstab.config.build import start_of, system_of
from rbstab.mechanics.numbers import FUNCTIONS

RANDOM = np.random.default_rng(7)


@pytest.mark.parametrize("formula", [operator.add, operator.sub, operator.mul, operator.truediv])
def test_roundings_of_exact_doubles_are_bounded(formula):
    """Without an error in the operands, the rounding of the operation is all that is left."""
    for _ in range(200):
        x, y = RANDOM.uniform(0.5, 2.0, 2).tolist()
        found = formula(Bounded(x, 0.0), Bounded(y, 0.0))
        exact = formula(Fraction(x), Fraction(y))
        assert Fraction(float(found.low)) <= exact <= Fraction(float(found.high))
        assert abs(exact - Fraction(float(found.value))) <= Fraction(float(found.error))


@pytest.mark.parametrize("formula", [operator.add, operator.sub, operator.mul, operator.truediv])
def test_all_values_within_the_errors_are_held(formula):
    """Errors of this size can be seen at the ends of both ranges."""
    for _ in range(50):
        (x, y), (a, b) = RANDOM.uniform(0.5, 2.0, 2), RANDOM.uniform(0.0, 0.4, 2)
        found = formula(Bounded(x, a), Bounded(-y, b))
        ends = [formula(x + i * a, -y + j * b) for i in (-1, 1) for j in (-1, 1)]
        assert found.low <= min(ends)
        assert max(ends) <= found.high
        assert found.high - found.low <= 4 * (max(ends) - min(ends))


def test_sine_and_cosine():
    from flint import arb, ctx

    x = RANDOM.uniform(-7, 7, 100)
    sine, cosine = Bounded(x, 1e-9).sin(), Bounded(x, 1e-9).cos()
    with ctx.workprec(200):
        for k, angle in enumerate(x.tolist()):
            for moved in (-1e-9, 1e-9):
                exact = arb(angle) + arb(moved)
                assert bool(arb(sine.low[k]) < exact.sin())
                assert bool(exact.sin() < arb(sine.high[k]))
                assert bool(arb(cosine.low[k]) < exact.cos())
                assert bool(exact.cos() < arb(cosine.high[k]))
    assert float(np.max(sine.error)) < 1.01e-9


@np.errstate(all="ignore")
def test_a_divisor_that_may_be_zero_has_no_bound():
    assert math.isinf((1.0 / Bounded(1e-3, 1.0001e-3)).error)
    assert (1.0 / Bounded(1e-3, 0.5e-3)).error >= 1e3
    assert not (1.0 / Bounded(0.0, 0.0)).high < 1e300


@pytest.mark.parametrize(("variant", "with_gravity"), CASES)
def test_energy_holds_the_exact_one(variant, with_gravity):
    spin, angles = (RANDOM.normal(size=3).tolist() for _ in range(2))
    initial = {"angular_velocity": spin, "orientation": [0.3 * angle for angle in angles]}
    config = rbstab.load_config(paper_config(variant, with_gravity, initial=initial))
    system = system_of(config, bounded_decimals)
    state = start_of(config, system, bounded_decimals)
    motion = system.motion(state)
    energy = system.body.kinetic_energy(motion.Omega, motion.V) + system.potential_energy(state)

    def exact():
        ours = system_of(config, decimal_balls)
        start = start_of(config, ours, decimal_balls)
        return sum(ours.observe(start).energy.tolist())

    ball = in_balls(partial(exact))
    assert float(energy.low) <= float(ball.mid()) <= float(energy.high)
    assert 0 < energy.error < 1e-11 * abs(float(energy.value))


def test_a_square_root_holds_all_values_within_the_error():
    for value, error in [(2.0, 0.0), (2.0, 0.3), (1e-6, 9e-7), (3.7e8, 1.0)]:
        found = Bounded(value, error).sqrt()
        for x in (Fraction(value) - Fraction(error), Fraction(value) + Fraction(error)):
            assert Fraction(float(found.low)) ** 2 <= x <= Fraction(float(found.high)) ** 2
        assert found.error <= 1e-15 * (1 + value) + 1.001 * error / math.sqrt(value)
    many = Bounded(np.array([4.0, 1.0, -1.0]), np.array([0.0, 1.0, 0.1])).sqrt()
    assert many.value[0] == 2.0
    assert many.error.tolist()[1:] == [math.inf, math.inf]


@pytest.mark.parametrize("name", ["tan", "atan", "exp", "log", "sinh", "cosh", "tanh"])
def test_other_functions_hold_all_values_within_the_error(name):
    """Only elements of users state them."""
    value, error = np.array([0.3, 1.2, 0.7]), np.array([0.0, 1e-3, 0.2])
    found = FUNCTIONS[name](Bounded(value, error))
    for share in np.linspace(-1, 1, 9):
        with mpmath.workdps(40):
            exact = [
                getattr(mpmath, name)(mpmath.mpf(x) + share * mpmath.mpf(e))
                for x, e in zip(value, error, strict=True)
            ]
            assert all(
                low <= one <= high
                for low, one, high in zip(found.low, exact, found.high, strict=True)
            )
    slope = {"tan": 5, "atan": 1, "exp": 3.4, "log": 2.1, "sinh": 2, "cosh": 2, "tanh": 1}[name]
    assert np.all(found.error <= 1.6 * slope * error + 1e-14)
    single = FUNCTIONS[name](Bounded(0.3, 0.0))
    assert single.value == found.value[0]


@pytest.mark.parametrize("exponent", [1, 2, 5, -3])
def test_whole_powers_hold_all_values_within_the_error(exponent):
    found = Bounded(np.array([1.3, -0.7]), np.array([1e-3, 0.0])) ** exponent
    for value, low, high in zip([1.3, -0.7], found.low, found.high, strict=True):
        for share in (-1, 0.5, 1):
            exact = (Fraction(value) + Fraction(share * 1e-3 if value > 0 else 0.0)) ** exponent
            assert low <= exact <= high
    assert (Bounded(2.0, 0.1) ** 0).value == 1.0
    with pytest.raises(TypeError):
        operator.pow(Bounded(2.0, 0.0), 0.5)


@pytest.mark.parametrize("size", [1e-9, 0.02, 4.0, 60.0, 1e6])
@pytest.mark.parametrize("function", ["sin", "cos"])
def test_sines_of_many_angles_hold_the_exact_values(function, size):
    """Many angles are taken from a table; some are in the middle of two of its steps."""
    angles = RANDOM.uniform(-size, size, 2 * MANY_ANGLES)
    angles[::7] = (np.rint(angles[::7] / STEP) + 0.5) * STEP
    angles[::11] = np.nextafter(angles[::11], 0.0)
    found = getattr(Bounded(angles, 0.0), function)()
    assert np.all(found.error < 20 * UNIT)
    with mpmath.workprec(120):
        exact = [getattr(mpmath, function)(mpmath.mpf(angle)) for angle in angles.tolist()]
        off = [float(abs(x - value)) for x, value in zip(exact, found.value.tolist(), strict=True)]
    assert np.all(off <= found.error)
    assert max(off) > 0.0
