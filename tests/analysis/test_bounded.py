"""Protects numbers with bounded errors: the exact value is within the bound, which is small."""

import operator
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from rbstab.analysis.bounded import (
    MANY_ANGLES,
    STEP,
    UNIT,
    Bounded,
)
from rbstab.mechanics.numbers import FUNCTIONS

RANDOM = np.random.default_rng(7)


@pytest.mark.parametrize("formula", [operator.add, operator.sub, operator.mul, operator.truediv])
def test_all_values_within_the_errors_are_held(formula):
    """Exactly, in fractions: of exact doubles the rounding of the operation is all that is left."""
    for size in [0.0] * 100 + [0.4] * 50:
        (x, y), (a, b) = (
            RANDOM.uniform(0.5, 2.0, 2).tolist(),
            (size * RANDOM.uniform(size=2)).tolist(),
        )
        bounded = formula(Bounded(x, a), Bounded(-y, b))
        pairs = [(i, j) for i in (-1, 1) for j in (-1, 1)]
        ends = [
            formula(Fraction(x) + i * Fraction(a), j * Fraction(b) - Fraction(y)) for i, j in pairs
        ]
        assert Fraction(float(bounded.low)) <= min(ends)
        assert max(ends) <= Fraction(float(bounded.high))
        assert bounded.high - bounded.low <= 4 * float(max(ends) - min(ends)) + 1e-14


@pytest.mark.parametrize("size", [1e-9, 0.02, 4.0, 60.0, 1e6])
@pytest.mark.parametrize("function", ["sin", "cos"])
def test_sines_of_many_angles_hold_the_exact_values(function, size):
    """Many angles are taken from a table; some are in the middle of two of its steps."""
    angles = RANDOM.uniform(-size, size, 2 * MANY_ANGLES)
    angles[::7] = (np.rint(angles[::7] / STEP) + 0.5) * STEP
    angles[::11] = np.nextafter(angles[::11], 0.0)
    bounded = getattr(Bounded(angles, 0.0), function)()
    assert np.all(bounded.error < 20 * UNIT)
    with mpmath.workprec(120):
        exact = [getattr(mpmath, function)(mpmath.mpf(angle)) for angle in angles.tolist()]
        off = [
            float(abs(x - value)) for x, value in zip(exact, bounded.value.tolist(), strict=True)
        ]
    assert np.all(off <= bounded.error)
    assert max(off) > 0.0


UNARY = {name: (function, getattr(mpmath, name)) for name, function in FUNCTIONS.items()}
UNARY |= {f"x^{n}": (lambda x, n=n: x**n, lambda x, n=n: x**n) for n in (1, 2, 5, -2)}
UNARY["1/x"] = (lambda x: 1.0 / x, lambda x: 1 / x)


@pytest.mark.parametrize("name", UNARY)
def test_functions_hold_all_values_within_the_error(name):
    """And are not much wider: the slopes of all of them are at most 60 there."""
    function, exact = UNARY[name]
    value, error = np.array([0.3, 1.2, 0.7]), np.array([0.0, 1e-3, 0.2])
    bounded = function(Bounded(value, error))
    for share in np.linspace(-1, 1, 9):
        with mpmath.workdps(40):
            for k in range(3):
                exact_value = exact(mpmath.mpf(value[k]) + share * mpmath.mpf(error[k]))
                assert bounded.low[k] <= exact_value <= bounded.high[k]
    assert np.all(bounded.error <= 60 * error + 1e-13)


@np.errstate(all="ignore")
@pytest.mark.parametrize(
    ("name", "value", "error"),
    [("1/x", 1e-3, 1.0001e-3), ("1/x", 0.0, 0.0), ("sqrt", 1.0, 1.0), ("log", 0.1, 0.2)],
)
def test_what_may_have_no_value_has_no_bound(name, value, error):
    bounded = UNARY[name][0](Bounded(np.array([value]), np.array([error])))
    assert not (np.isfinite(bounded.low[0]) and np.isfinite(bounded.high[0]))
