"""Protects what is shown to be never negative: only what is, and the usual forms of dampers."""

import numpy as np
import pytest

from rbstab.mechanics import numbers
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.passive.signs import never_negative, positive, spanned, vanishing

SEMIDEFINITE = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
SKEW = np.array([[1.0, 5.0, 0.0], [-5.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
DEFINITE = np.array([[3.0, 1.0, 0.0], [1.0, 3.0, -1.0], [0.0, -1.0, 4.0]])

NEVER = {
    "skewed": lambda v: v @ SKEW @ v,
    "definite": lambda v: v @ DEFINITE @ v,
    "definite times what is positive": lambda v: (v @ DEFINITE @ v) * numbers.exp(v[0]),
    "cubic damping": lambda v: (v @ v) * (v @ v) * 0.3,
    "saturating": lambda v: v[0] * v[0] / numbers.sqrt(1.0 + v[0] * v[0]),
    "x tanh x": lambda v: v[0] * numbers.tanh(v[0]) + 2.0 * v[1] * numbers.atan(v[1] / 0.1),
    "sums in products": lambda v: (1.0 + v[0] * v[0]) * (2.0 + numbers.cosh(v[1])),
    "a quotient": lambda v: v[0] * v[0] / (v[1] * v[1]),
}

TURN = np.array([[0.0, 2.0, -1.0], [-2.0, 0.0, 0.5], [1.0, -0.5, 0.0]])


NEVER |= {
    "x tanh x, of sums": lambda v: (v + TURN @ v) @ numbers.tanh(3.0 * (v + TURN @ v)),
    "of a sum that is a term": lambda v: (v[0] + v[1]) * (v[0] + v[1] + v[2]) + 2.0 * v[2] * v[2],
}

NOT_SHOWN = {
    # x⁰ is 1, also of a zero.
    "a power 0 of zero": lambda v: -(v[0] * v[0]) * (0.0 / numbers.exp(v[1])) ** 0,
    "a product": lambda v: v[0] * v[1],
    "x tanh y": lambda v: v[0] * numbers.tanh(v[1]),
    "x tanh of a sum": lambda v: v[0] * numbers.tanh(v[0] + v[1]),
    "a logarithm": lambda v: numbers.log(v[0] * v[0]),
    "over what may be negative": lambda v: v[0] * v[0] / v[1],
    "times what may be negative": lambda v: (v @ DEFINITE @ v) * v[0],
    "almost semidefinite": lambda v: v @ (SEMIDEFINITE - np.diag([1e-9, 0, 0])) @ v,
}


V = np.array([variable(k) for k in range(3)], dtype=object)


@pytest.mark.parametrize("name", NEVER | NOT_SHOWN)
def test_never_negative(name):
    formula = (NEVER | NOT_SHOWN)[name]
    assert never_negative(expr(formula(V))) == (name in NEVER)


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        (lambda v: 1.0 + v[0] * v[0], True),
        (lambda v: v @ v + numbers.exp(v[0]), True),
        (lambda v: (1.0 + v[0] ** 2) / (2.0 + v[1] ** 2), True),
        (lambda v: numbers.cos(v[1]), True),
        (lambda v: numbers.cos(v[0]), False),
        (lambda v: v @ v, False),
        (lambda v: 1.0 + v[0], False),
        (lambda v: numbers.sqrt(v[0] * v[0]), False),
    ],
)
def test_above_zero(formula, expected):
    assert positive(expr(formula(V))) is expected


VANISHING = {
    "a square": (lambda v: v[0] * v[0], {0}),
    "definite": (lambda v: v @ DEFINITE @ v, {0, 1, 2}),
    "saturating": (lambda v: (v @ v) / numbers.sqrt(1.0 + v @ v), {0, 1, 2}),
    "x tanh x": (lambda v: v[0] * numbers.tanh(v[0] / 0.1) + v[1] * v[1], {0, 1}),
    "semidefinite": (lambda v: v @ SEMIDEFINITE @ v, set()),
    "a product of different signs": (lambda v: v[0] * v[0] * numbers.tanh(v[1] * v[1]), set()),
    "over what grows": (lambda v: v[0] * v[0] / (v[1] * v[1]), set()),
    "not shown to be never negative": (lambda v: v[0] * v[0] + v[1], set()),
    "a square of a sum": (lambda v: (v[0] - v[1]) * (v[0] - v[1]), set()),
    "definite times what may be zero": (lambda v: (v @ DEFINITE @ v) * v[0] * v[0], set()),
}


@pytest.mark.parametrize("name", VANISHING)
def test_what_is_zero_where_a_formula_is(name):
    formula, expected = VANISHING[name]
    zeros = vanishing(expr(formula(V)))
    assert {axis for axis in range(3) if spanned([V[axis]], zeros)} == expected
