"""An expression is called zero only if it is, and identities of dampers and springs are seen."""

from fractions import Fraction

import pytest
from hypothesis import HealthCheck, given, settings
from support.expressions import affine, energies

from rbstab.proof.exact.expr import variable
from rbstab.proof.passive.expanded import TooLargeError, is_zero, multiplied_out

X, Y, Z = (variable(k) for k in range(3))
ROOT = (1 + X * X + Y * Y).sqrt()

ZERO = {
    "a quotient and its divisor": (X * X + Y) / (1 + Y * Y) * (1 + Y * Y) - X * X - Y,
    "quotients of different sums": 1 / (1 + X * X)
    - 1 / (1 + Y * Y)
    - (Y * Y - X * X) / ((1 + X * X) * (1 + Y * Y)),
    "a root that divides": 1 / ROOT - ROOT / (1 + X * X + Y * Y),
    "sin² beside a function": (X.exp() * X.sin()) ** 2 + (X.exp() * X.cos()) ** 2 - (2 * X).exp(),
    "tanh by exponentials": X.tanh() - X.sinh() / X.cosh(),
    "cosh² - sinh²": (3 * X).cosh() ** 2 - (3 * X).sinh() ** 2 - 1,
    "a step and its square": (X + Y).step(1) * ((X + Y).step(1) - 1) * X,
    "high powers of a sum": ((ROOT + X) ** 9 * (X + Y)) / (X + Y) - (ROOT + X) ** 9,
}

NOT_ZERO = {
    "a root of either sign": (X * X).sqrt() - X,
    "a small rest": (1 + Fraction(1, 10**30)) * ROOT - ROOT,
    "exponentials of other arguments": X.exp() * Y.exp() - (X + 2 * Y).exp(),
}


@pytest.mark.parametrize("name", ZERO)
def test_identities_are_seen(name):
    assert is_zero(ZERO[name])
    assert not is_zero(ZERO[name] + Fraction(1, 10**40))
    assert not is_zero(ZERO[name] + X * Fraction(1, 10**40))


@pytest.mark.parametrize("name", NOT_ZERO)
def test_what_is_not_zero_is_not_called_so(name):
    assert not is_zero(NOT_ZERO[name])


@settings(deadline=None, max_examples=15, suppress_health_check=list(HealthCheck))
@given(energies(), affine(), affine())
def test_products_in_any_order_are_the_same(e, f, g):
    """And a rest is seen, however small."""
    left, right = (e * f) * (g + e) / (1 + f * f), e * (f * g + e * f)
    difference = left - right / (1 + f * f)
    try:
        multiplied_out(difference)
    except TooLargeError:
        return
    assert is_zero(difference)
    assert not is_zero(difference + f.cos() * Fraction(1, 10**30))
