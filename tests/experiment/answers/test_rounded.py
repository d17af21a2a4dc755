"""Proved numbers are rounded to the side on which the statement stays true."""

from fractions import Fraction

import pytest

from rbstab.experiment.answers.rounded import rounded_down, rounded_up
from rbstab.experiment.convergence.convergence import Convergence


@pytest.mark.parametrize(
    ("number", "text"),
    [(761.76999, "761.769"), (0.0123456789, "0.0123456"), (1234567.8, "1.23456e+06"), (0.0, "0")],
)
def test_levels_are_rounded_down(number, text):
    assert rounded_down(number) == text
    assert Fraction(rounded_down(number)) <= Fraction(number)


@pytest.mark.parametrize(
    ("number", "text"),
    [(0.55601, "0.5561"), (12.0, "12"), (99999.2, "1e+05"), (2.0001e-7, "2.001e-07"), (0.0, "0")],
)
def test_times_are_rounded_up(number, text):
    assert rounded_up(number) == text
    assert Fraction(rounded_up(number)) >= Fraction(number)


def test_what_holds_from_a_proved_time_on_is_not_said_of_an_earlier_one():
    convergence = Convergence(True, 1, time=0.123411, energy=(1.0, 1.1), bound=2.99999999)
    assert "from t = 0.1235 s" in convergence.sentence
    assert "< 2.99999 J, error ≤ 0.06 J" in convergence.sentence
