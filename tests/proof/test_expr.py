"""Expressions are canonical: equal ones are equal, in every process and in any order."""

import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.balls import value
from support.expressions import affine, energies

from rbstab.mechanics.attitude import rotation
from rbstab.proof.exact.decimals import meant
from rbstab.proof.exact.expr import expr, numbers, variable

X, Y, Z = (variable(k) for k in range(3))


CANONICAL = [
    (X.sin() ** 2 + X.cos() ** 2, expr(1)),
    (X.sin() ** 4 - X.cos() ** 4, 1 - 2 * X.cos() ** 2),
    ((X + Y) ** 2, X * X + 2 * X * Y + Y * Y),
    (X.step(1) * X.step(1) * Y, Y * X.step(1)),
    (X * X**-1 * Y, Y),
    ((X.exp() + 1) * (X.exp() + 1), (X.exp() + 1) ** 2),
    (expr(0.4), expr(Fraction(2, 5))),
]


@pytest.mark.parametrize(("left", "right"), CANONICAL)
def test_equal_expressions_are_the_same(left, right):
    assert left == right
    assert left != right + X.step(1)
    assert left.digest == right.digest
    assert hash(left) == hash(right)
    assert left.terms == right.terms


def test_order_and_digest_do_not_depend_on_history():
    """In another process, where the atoms are made in another order."""
    code = """
from rbstab.proof.exact.expr import variable
{first}
x, y = variable(0), variable(1)
U = (x * y).sin() * x.exp() + (1 + y.cos() * x.sin()).sqrt() / (x + 2) + y.step(1) * y
print(U.digest, U)
"""
    firsts = (
        "",
        "kept = [(variable(1) * variable(0)).sin(), variable(5).exp(), variable(1).cos()]",
    )
    shown = [
        subprocess.run(
            [sys.executable, "-c", code.format(first=first)],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for first in firsts
    ]
    assert shown[0] == shown[1]
    U = (X * Y).sin() * X.exp() + (1 + Y.cos() * X.sin()).sqrt() / (X + 2) + Y.step(1) * Y
    assert shown[0] == f"{U.digest} {U}\n"


def test_numbers_mean_decimals():
    assert X**0 == 1
    assert expr(2) ** -3 == Fraction(1, 8)
    assert meant(0.1) == Fraction(1, 10)
    assert meant(np.int64(3)) == 3


def test_a_double_of_code_means_a_simple_fraction_and_one_of_a_config_its_decimal():
    assert X * Fraction(1, 3) == X * (1 / 3)
    assert X * Fraction(1, 7000) == X / 7 * 1e-3
    assert X * Fraction(1, 10**9) == X * 1e-9
    assert numbers(np.array([1 / 3])).item() == Fraction("0.3333333333333333")


@pytest.mark.parametrize(
    "use", [bool, lambda x: x < 1, lambda x: x >= 0, lambda x: x.sin() == 0, lambda x: x**0.5]
)
def test_expressions_have_no_value(use):
    assert expr(1) < 2 <= expr(2)
    assert not expr(0)
    with pytest.raises(TypeError):
        use(X)


def test_a_rotation_times_its_transpose_is_one():
    """The attitude of the equations, with expressions as its numbers."""
    A = rotation(np.array([X, Y, Z], dtype=object))
    np.testing.assert_array_equal(A.T @ A, np.eye(3, dtype=object).astype(int))


@settings(deadline=None, max_examples=25)
@given(energies(), energies(), affine(), st.lists(st.floats(-2, 2), min_size=3, max_size=3))
def test_arithmetic_keeps_the_value(left, right, x, point):
    """Sums, products, powers and quotients, against those of the values in balls."""
    place = dict(enumerate(point))
    try:
        a, b, c = (value(e, place) for e in (left, right, x))
    except ValueError:  # a step whose side is not known
        return
    cases = [
        (left + right, a + b),
        (left - right, a - b),
        (left * right, a * b),
        (left**3, a**3),
        (x.tanh(), c.tanh()),
        (x.sinh() * left, c.sinh() * a),
        (left / (right * right + 1), a / (b * b + 1)),
    ]
    for e, exact in cases:
        near = value(e, place)
        assert abs(float(near - exact)) <= 1e-13 * (1 + abs(float(exact)))
