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

from rbstab.mechanics.attitude import rotation as rotation_of_angles
from rbstab.proof.exact.expr import COS, SIN, atom, expr, meant, numbers, variable

X, Y, Z = (variable(k) for k in range(3))


def rotation(a, b, c):
    """Return Rz Ry Rx as an array of expressions."""
    one, zero = expr(1), expr(0)
    (sa, ca), (sb, cb), (sc, cc) = ((v.sin(), v.cos()) for v in (a, b, c))
    rows = (
        [[one, zero, zero], [zero, ca, -sa], [zero, sa, ca]],
        [[cb, zero, sb], [zero, one, zero], [-sb, zero, cb]],
        [[cc, -sc, zero], [sc, cc, zero], [zero, zero, one]],
    )
    x, y, z = (np.array(row, dtype=object) for row in rows)
    return z @ y @ x


def test_a_rotation_times_its_transpose_is_one():
    A = rotation(X, Y, Z)
    np.testing.assert_array_equal(A.T @ A, np.eye(3, dtype=object).astype(int))
    (a, b, c), (d, e, f), (g, h, i) = A
    assert a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) == 1


CANONICAL = [
    (X.sin() ** 2 + X.cos() ** 2, expr(1)),
    (X.sin() ** 4 - X.cos() ** 4, 1 - 2 * X.cos() ** 2),
    ((X + Y) ** 2, X * X + 2 * X * Y + Y * Y),
    (X.step(1) * X.step(1) * Y, Y * X.step(1)),
    (X / X, expr(1)),
    (X * X**-1 * Y, Y),
    ((X.exp() + 1) * (X.exp() + 1), (X.exp() + 1) ** 2),
    (expr(0).sin() + expr(0).cos(), expr(1)),
    (X - X, expr(0)),
    (expr(0.4), expr(Fraction(2, 5))),
    (X.step(2) * (X + Y), X.step(2) * X + X.step(2) * Y),
]


@pytest.mark.parametrize("k", range(len(CANONICAL)))
def test_equal_expressions_are_the_same(k):
    one, two = CANONICAL[k]
    assert one == two
    assert one.digest == two.digest
    assert hash(one) == hash(two)
    assert one.terms == two.terms


@pytest.mark.parametrize(
    ("one", "two"),
    [
        (X.step(1), X.step(2)),
        (X.sin(), X.cos()),
        (X, Y),
        (X, 2 * X),
        (X * Y, X + Y),
        (X.sqrt(), X.exp()),
        (X, X.sin()),
        (expr(1), expr(2)),
    ],
)
def test_different_expressions_differ(one, two):
    assert one != two
    assert one.digest != two.digest


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


def test_atoms_of_one_content_are_one_object():
    assert atom(SIN, X) is atom(SIN, variable(0))
    assert atom(SIN, X) is not atom(COS, X)


def test_numbers_are_compared_and_expressions_are_not():
    assert expr(1) < 2 <= expr(2)
    assert expr(3) > expr(Fraction(5, 2)) >= 2.5
    assert bool(expr(1))
    assert not expr(0)
    for compare in (
        lambda: X < 1,
        lambda: X <= Y,
        lambda: X > 0,
        lambda: X >= 0,
        lambda: bool(X),
        lambda: X.sin() > 1,
        lambda: X == 0,
        lambda: X != 0.5,
    ):
        with pytest.raises(TypeError, match="branch"):
            compare()
    assert (X == "x") is False


def test_only_whole_powers_and_real_numbers_are_taken():
    for power in (0.5, X, Fraction(1, 3)):
        with pytest.raises(TypeError, match="whole"):
            X**power
    with pytest.raises(TypeError, match="str"):
        expr("1")
    assert X**0 == 1
    assert expr(2) ** -3 == Fraction(1, 8)
    assert meant(0.1) == Fraction(1, 10)
    assert meant(np.int64(3)) == 3


def test_a_double_of_code_means_a_simple_fraction_and_one_of_a_config_its_decimal():
    assert X * Fraction(1, 3) == X * (1 / 3)
    assert X * Fraction(1, 7000) == X / 7 * 1e-3
    assert X * Fraction(1, 10**9) == X * 1e-9
    assert numbers(np.array([1 / 3])).item() == Fraction("0.3333333333333333")


def test_arrays_of_doubles_become_the_numbers_that_they_mean():
    found = numbers(np.array([[0.1, 2.0]])) * X
    assert found[0, 0] == X * Fraction(1, 10)
    assert found[0, 1] == 2 * X
    assert (np.array([1, Y], dtype=object) * X).tolist() == [X, X * Y]


def test_an_expression_knows_its_variables_and_atoms():
    e = (X * Y).sin().exp() + Z.step(1) * 2
    assert e.variables == {0, 1, 2}
    assert {a.kind for a in e.atoms} == {"exp", "step"}
    assert {a.kind for a in e.all_atoms} == {"exp", "step", "sin", "var"}
    assert expr(3).variables == frozenset()


@settings(deadline=None, max_examples=40)
@given(energies(), energies(), affine(), st.lists(st.floats(-2, 2), min_size=3, max_size=3))
def test_arithmetic_keeps_the_value(one, two, x, point):
    """Sums, products, powers and quotients, against those of the values in balls."""
    place = dict(enumerate(point))
    try:
        a, b, c = (value(e, place) for e in (one, two, x))
    except ValueError:  # a step whose side is not known
        return
    cases = [
        (one + two, a + b),
        (one - two, a - b),
        (one * two, a * b),
        (one**3, a**3),
        (x.tanh(), c.tanh()),
        (x.sinh() * one, c.sinh() * a),
        (one / (two * two + 1), a / (b * b + 1)),
    ]
    for e, exact in cases:
        near = value(e, place)
        assert abs(float(near - exact)) <= 1e-13 * (1 + abs(float(exact)))


def test_the_rotation_of_the_equations_is_orthogonal_exactly():
    """The attitude of the equations, with expressions as its numbers."""
    A = rotation_of_angles(np.array([X, Y, Z], dtype=object))
    np.testing.assert_array_equal(A.T @ A, np.eye(3, dtype=object).astype(int))
