"""The functions of one number for each kind: by numpy, by registered functions, by methods."""

from dataclasses import dataclass

import flint
import numpy as np
import pytest

from rbstab.mechanics import numbers
from rbstab.mechanics.numbers import FUNCTIONS, cos, cos_of, sin, sin_of, sqrt


@dataclass
class Angle:
    """A kind of number with its own functions, like an interval."""

    name: str

    def sin(self):
        return f"sin {self.name}"

    def cos(self):
        return f"cos {self.name}"

    def sqrt(self):
        return f"sqrt {self.name}"


class Unknown:
    """A kind of number without these functions."""


def test_floats_and_complex_numbers_go_to_numpy():
    for x in (np.array([0.1, 0.2]), np.array([0.1 + 1e-3j, 2.0])):
        np.testing.assert_array_equal(sin(x), np.sin(x))
        np.testing.assert_array_equal(cos(x), np.cos(x))


def test_other_kinds_use_their_own_functions():
    x = np.array([Angle("a"), Angle("b")], dtype=object)
    assert sin(x).tolist() == ["sin a", "sin b"]
    assert cos(x).tolist() == ["cos a", "cos b"]


def test_registered_functions_come_before_methods():
    class Registered(Angle):
        pass

    sin_of.register(Registered, lambda x: f"registered sin {x.name}")
    cos_of.register(Registered, lambda x: f"registered cos {x.name}")
    x = np.array([Registered("a")], dtype=object)
    assert sin(x).tolist() == ["registered sin a"]
    assert cos(x).tolist() == ["registered cos a"]


def test_kind_without_functions_is_refused():
    x = np.array([Unknown()], dtype=object)
    with pytest.raises(AttributeError, match="sin"):
        sin(x)
    with pytest.raises(AttributeError, match="cos"):
        cos(x)


def test_square_root_has_the_derivative_of_a_complex_step():
    """√(4 + ih) = 2 + ih/4, and no branch is taken for a negative imaginary part."""
    for h in (1e-30, -1e-30):
        root = sqrt(np.complex128(4.0 + 1j * h))
        assert (root.real, root.imag) == (2.0, pytest.approx(h / 4, rel=1e-15))


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
