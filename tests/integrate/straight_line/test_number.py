"""A traced number records operations, leaves out those with a known result, and has no value."""

import math

import numpy as np
import pytest

from rbstab.integrate.straight_line.code import compiled, source
from rbstab.integrate.straight_line.number import Trace
from rbstab.mechanics.numbers import FUNCTIONS


def evaluated(function, *values, constants=()):
    """Return a function of traced numbers, evaluated by its code, and the code."""
    trace = Trace()
    fixed = [trace.input(varies=False) for _ in constants]
    x = [trace.input(varies=True) for _ in values]
    results = [trace.index_of(result) for result in function(*fixed, *x)]
    prepare = compiled(trace, results)
    numbers = prepare(list(constants), math)(list(values))
    return numbers, source(trace, results)


def formulas(x, y):
    """Every operation, with numbers on both sides, constants of each sign and zeros."""
    return [
        x + y, x - y, x * y, x / y, -x, +x,
        x + 2, 2 + x, x - 2, 2 - x, x * 3, 3 * x, x / 3, 3 / x,
        x + -2.5, x - -2.5, x * -2.5, -2.5 * x, x / -2.5, -2.5 / x,
        x + 0, 0 + x, x - 0, 0 - x, x * 1, 1.0 * x, x / 1, x * -1, -1 * x,
        -(0 - x), -(0 - (x + y)), x - (-y), x + (-y), (-x) + y, (-x) - y, (-x) - (-y), -x + -y,
        (-x) * y, x * (-y), (-x) * (-y), (-x) / y, x / (-y), -(x - y), y - (x - y),
        x - y - (y - x), (x + y) + (y + x), x * y - y * x + 1, x + 1e-300, x * 5e-324 + 1e308,
        x / (y / (x / (y + x))), ((x - y) - x) - (y - (x - y)),
    ]  # fmt: skip


@pytest.mark.parametrize(("x", "y"), [(0.7, -1.3), (-1e-3, 1e5), (3.0, 3.0), (-0.1, -1e-300)])
def test_every_operation_gives_the_bits_of_floats(x, y):
    for k, expected in enumerate(formulas(x, y)):
        (computed,), _ = evaluated(lambda a, b, k=k: [formulas(a, b)[k]], x, y)
        assert computed == expected, k
    computed, _ = evaluated(formulas, x, y)
    assert computed == formulas(x, y)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_of_one_number(name):
    computed, code = evaluated(lambda x: [getattr(x, name)()], 0.3)
    assert computed == [getattr(math, name)(0.3)]
    assert code.count(f"{name}(") == 1


@pytest.mark.parametrize("exponent", [0, 1, 2, 3, -2, 2.0, np.int64(3)])
def test_whole_powers(exponent):
    for x in (0.7, -1.3):
        (computed,), _ = evaluated(lambda x: [x**exponent], x)
        assert computed == x ** int(exponent)


def test_zeros_ones_and_unused_operations_need_no_code():
    def function(x, y):
        unused = x.sin() * y.cos()
        return [0.0 * unused + x * 1.0 + 0.0 * y, (x - 0.0 * y) / 1.0, y * 0 + 0.0]

    computed, code = evaluated(function, 2.0, 3.0)
    assert computed == [2.0, 2.0, 0.0]
    assert not any(sign in code for sign in (" * ", " + ", " - ", " / ", "sin(", "cos("))


def test_what_depends_on_fixed_inputs_only_is_prepared():
    computed, code = evaluated(lambda p, q, x: [p * q * x, x / (p - q)], 7.0, constants=(2.0, 5.0))
    assert computed == [70.0, 7.0 / -3.0]
    prepared, inner = code.split("def evaluate")
    assert (prepared.count(" * "), prepared.count(" - ")) == (1, 1)
    assert (inner.count(" * "), inner.count(" - "), inner.count(" / ")) == (1, 0, 1)


def test_long_chains_are_compiled():
    def function(x):
        value = x
        for k in range(3000):
            value = (value + 1.0 / (k + 1.0)) * x
        return [value]

    (computed,), _ = evaluated(function, 0.5)
    assert computed == function(0.5)[0]
