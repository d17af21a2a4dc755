"""Sine, cosine and square root for each kind of number: by numpy, registered functions, methods."""

from dataclasses import dataclass

import numpy as np
import pytest

from rbstab.mechanics.numbers import cos, cos_of, sin, sin_of, sqrt, sqrt_of


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


@pytest.mark.parametrize("constant", [0.3, 2, 0.3 + 0.1j], ids=["float", "int", "complex"])
def test_constants_among_symbols(constant):
    x = np.array([Angle("a"), constant], dtype=object)
    assert sin(x).tolist() == ["sin a", np.sin(constant)]
    assert cos(x).tolist() == ["cos a", np.cos(constant)]


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


@pytest.mark.parametrize("x", [2.0, 2, np.float64(2.0), 2.0 + 1e-3j, np.complex128(2.0 - 1.0j)])
def test_square_root_of_one_number(x):
    root = sqrt(x)
    assert root == np.sqrt(x)
    assert root * root == pytest.approx(x, rel=1e-15)


def test_square_root_of_other_kinds():
    class Registered(Angle):
        pass

    assert sqrt(Angle("a")) == "sqrt a"
    sqrt_of.register(Registered, lambda x: f"registered sqrt {x.name}")
    assert sqrt(Registered("a")) == "registered sqrt a"
    with pytest.raises(AttributeError, match="sqrt"):
        sqrt(Unknown())


def test_square_root_has_the_derivative_of_a_complex_step():
    """√(4 + ih) = 2 + ih/4, and no branch is taken for a negative imaginary part."""
    for h in (1e-30, -1e-30):
        root = sqrt(np.complex128(4.0 + 1j * h))
        assert (root.real, root.imag) == (2.0, pytest.approx(h / 4, rel=1e-15))
