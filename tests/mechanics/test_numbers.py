"""The functions of one number for each kind: by numpy, by registered functions, by methods."""

from types import SimpleNamespace

import flint
import numpy as np
import pytest

from rbstab.mechanics import numbers
from rbstab.mechanics.numbers import FUNCTIONS, sin, sin_of


def test_a_registered_function_comes_before_a_method_and_one_of_them_must_be_there():
    class Registered(SimpleNamespace):
        pass

    sin_of.register(Registered, lambda _: "registered")
    own = [SimpleNamespace(sin=lambda: "method"), Registered(sin=lambda: "method")]
    assert sin(np.array(own, dtype=object)).tolist() == ["method", "registered"]
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
