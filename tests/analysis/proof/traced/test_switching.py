"""Protects the numbers of energies that switch: a sum of terms keeps its last digit."""

from fractions import Fraction

import pytest

from rbstab.analysis.proof.formulas.polynomials import polynomial_of
from rbstab.analysis.proof.formulas.program import part_of
from rbstab.analysis.proof.polynomial import Ring
from rbstab.analysis.proof.traced.switching import NotShownError, exact_number

NUMBERS = [
    Fraction(1, 3),
    Fraction(1) - Fraction(1, 10**20),
    Fraction(123456789 * 10**30 + 1, 7**30),
    -Fraction(10**40 + 3, 10**20),
    Fraction("0.1234567") * Fraction("0.7654321") * Fraction("1.0000001") / 3,
    Fraction(10**17),
]


@pytest.mark.parametrize("number", NUMBERS)
def test_numbers_of_terms_are_exact(number):
    formula = [("theta", 0)]
    place = exact_number(formula, number)
    ring = Ring(3, 0)
    found = polynomial_of(part_of(formula, place), ring)
    assert found is not None
    assert not list((found - ring.constant(number)).terms())
    assert all(op[0] != "constant" or op[1] == abs(number) or op[1] < 2**53 for op in formula)


def test_numbers_of_too_many_digits_are_refused():
    with pytest.raises(NotShownError, match="too many digits"):
        exact_number([], Fraction(1, 3**400))
    with pytest.raises(NotShownError, match="too many digits"):
        exact_number([], Fraction(10**400))
