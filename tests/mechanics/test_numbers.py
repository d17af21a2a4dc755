"""Vectors, matrices, derivatives, and the functions of each kind of number."""

from fractions import Fraction
from types import SimpleNamespace

import flint
import numpy as np
import pytest
from support.differences import relative_error

from rbstab.mechanics import numbers
from rbstab.mechanics.algebra import (
    cross,
    cross_matrix,
    inverse,
    quadratic_form,
    squared_norm,
)
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import FUNCTIONS, sin


def test_a_registered_function_comes_before_a_method_and_one_of_them_must_be_there():
    class Registered(SimpleNamespace):
        pass

    FUNCTIONS["sin"].register(Registered, lambda _: "registered")
    objects = [SimpleNamespace(sin=lambda: "method"), Registered(sin=lambda: "method")]
    assert sin(np.array(objects, dtype=object)).tolist() == ["method", "registered"]
    with pytest.raises(AttributeError, match="sin"):
        sin(np.array([SimpleNamespace()], dtype=object))


NAMED_BY_NUMPY = {name: {"atan": "arctan"}.get(name, name) for name in FUNCTIONS}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_for_every_kind_of_number(name):
    """Floats, complex numbers, arrays of both, balls and heyoka's expressions have one value."""
    function, x = getattr(numbers, name), 0.4
    expected = getattr(np, NAMED_BY_NUMPY[name])(x)
    assert function(x) == function(np.float64(x)) == expected
    np.testing.assert_array_equal(function(np.array([[x, 0.5]]))[0, 0], expected)
    assert function(np.array([[flint.arb(x)]], dtype=object)).shape == (1, 1)
    assert float(function(flint.arb(x)).mid()) == pytest.approx(expected, rel=1e-15)
    slope = function(np.complex128(x + 1e-200j)).imag / 1e-200
    difference = (function(x + 1e-6) - function(x - 1e-6)) / 2e-6
    assert slope == pytest.approx(difference, rel=1e-8)
    heyoka = pytest.importorskip("heyoka")
    pytest.importorskip("rbstab.integrate.heyoka.symbols")
    symbol = heyoka.make_vars("x")
    compiled = heyoka.cfunc([function(symbol)], vars=[symbol])
    assert compiled([x])[0] == pytest.approx(expected, rel=1e-15)


def test_the_cross_product_and_its_matrix_are_numpy_s(rng):
    a, b = rng.normal(size=(2, 3))
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))
    assert relative_error(cross_matrix(a) @ b, np.cross(a, b)) < 1e-15


def test_inverse_is_exact_in_fractions_and_needs_no_symmetry():
    matrix = np.array([[2, -1, 3], [5, 4, -2], [1, 7, 6]]) * Fraction(1, 3)
    np.testing.assert_array_equal(inverse(matrix) @ matrix, np.eye(3))
    np.testing.assert_array_equal(matrix @ inverse(matrix), np.eye(3))


def test_quadratic_form_in_integers():
    matrix = np.array([[1, 2, 3], [4, 5, 6], [7, 8, 10]])
    # 1·1·1 + 2·(2 + 4) - (3 + 7) + 4·5 - 2·(6 + 8) + 10
    assert quadratic_form(matrix, np.array([1, 2, -1])) == 5


def test_squared_norm_of_a_pythagorean_quadruple():
    assert squared_norm(np.array([2, 3, -6])) == 7**2


def test_jacobian_of_products_and_sines(rng):
    x, y, z = point = rng.normal(size=3)

    def function(p):
        return np.array([p[0] * p[1], np.sin(p[2]), p[0] / p[2], p[1] ** 3])

    expected = [[y, x, 0], [0, 0, np.cos(z)], [1 / z, 0, -x / z**2], [0, 3 * y**2, 0]]
    assert relative_error(jacobian(function, point), expected) < 1e-15


def test_nothing_is_subtracted(rng):
    # The value is 1e30 times the slope: a difference of floats would lose the slope.
    slope = jacobian(lambda p: 1e30 + np.sin(p[0]), np.array([0.7]))
    np.testing.assert_allclose(slope, [np.cos(0.7)], rtol=1e-15)
