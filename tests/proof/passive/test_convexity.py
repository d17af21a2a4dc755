"""Protects that a formula is called convex in X only if it is, by the prover and by the checker."""

# ruff: noqa: ARG005 (a formula of Θ and X may need one of them alone)

import numpy as np
import pytest

from rbstab.mechanics import numbers
from rbstab.proof.enclosures.taylor import value_at
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.passive.signs import is_convex

SHOWN = {
    "turned": lambda T, X: (T[0] * X[0] - T[1] * X[1] + 0.3) ** 4,
    "a length": lambda T, X: numbers.sqrt(0.01 + X[0] ** 2 + (X[1] + X[2] - T[2]) ** 2),
    "exp of a square": lambda T, X: 2.0 * (numbers.exp(3.0 * X[0] ** 2 + X[1]) - 1.0),
    "minus a root": lambda T, X: -numbers.sqrt(2.0 - X[0] ** 2) - numbers.log(X[1] + 9.0),
}

K = np.array([[4.0, 1.0, -1.0], [1.0, 3.0, 0.5], [-1.0, 0.5, 2.0]])
"""A positive definite matrix."""

DEGENERATE = np.array([[1.0, 0.2, -0.1], [0.2, 0.04, -0.02], [-0.1, -0.02, 0.01]])
"""The matrix of (x1 + 0.2 x2 - 0.1 x3)², as decimals."""


def _turned(T, X):
    """Return X in a frame that is turned about the third axis; c and s are any entries of A."""
    c, s = T[0], T[1]
    return np.array([c * X[0] + s * X[1], c * X[1] - s * X[0], X[2]])


def _form(matrix, x):
    return x @ (matrix @ x)


SHOWN |= {
    "a matrix in a turned frame": lambda T, X: _form(K, _turned(T, X)) + X[1] ** 4,
    "a matrix with an eigenvalue 0": lambda T, X: _form(DEGENERATE, X) + numbers.exp(X[1]),
    "products of different sums": lambda T, X: (X[0] + X[1]) * (X[0] + 2.0 * X[1]) + X[1] ** 2,
    "a function of a matrix": lambda T, X: numbers.exp(0.1 * _form(K, X)) - X[2],
}

NOT_SHOWN = {
    "a factor of either sign": lambda T, X: T[0] * X[0] ** 2,
    "an even power of what may be negative": lambda T, X: (X[0] ** 2 - 1.0) ** 2,
    "a matrix that is outweighed only far away": lambda T, X: (X @ X) ** 2 - _form(K, X),
    "a matrix just below": lambda T, X: _form(DEGENERATE - 1e-9 * np.eye(3), X),
    "a product that only another power outweighs": lambda T, X: X[0] * X[1] + X[0] ** 4 + X[1] ** 4,
}


T = np.array([variable(k) for k in range(3)], dtype=object)
X = np.array([variable(k) for k in range(3, 6)], dtype=object)


def shown(formula):
    return is_convex(expr(formula(T, X)), (3, 4, 5))


@pytest.mark.parametrize("name", SHOWN | NOT_SHOWN)
def test_convex_formulas_are_seen_and_others_are_not(name):
    assert shown((SHOWN | NOT_SHOWN)[name]) == (name in SHOWN)


def _random(rng, depth):
    """Return a random formula of Θ and X."""
    c, n, k = float(rng.uniform(-2, 2)), int(rng.integers(1, 5)), int(rng.integers(3))
    if depth == 0:
        return (X[k], T[k], expr(c))[rng.integers(3)]
    left, right = _random(rng, depth - 1), _random(rng, depth - 1)
    choices = [
        lambda: left + right,
        lambda: left - right,
        lambda: left * right,
        lambda: c * left,
        lambda: left**n,
        lambda: c * (1 + left * left).sqrt(),
        lambda: c * (0.3 * left).exp(),
        # For some c and n this is never negative, for others it is.
        lambda: left * left + 2 * c * left * right + n * right * right / 2,
    ]
    return choices[rng.integers(len(choices))]()


@np.errstate(all="ignore")
def test_random_formulas_that_are_called_convex_are_convex():
    rng = np.random.default_rng(5)
    count = curved = 0
    for _ in range(100):
        formula = _random(rng, int(rng.integers(1, 3)))
        if not is_convex(formula, (3, 4, 5)):
            continue
        count += 1
        Theta = rng.uniform(-1.5, 1.5, 3)
        for _ in range(6):
            a, b = rng.uniform(-3, 3, (2, 3))
            low, high, middle = (
                value_at(formula, np.concatenate([Theta, x])) for x in (a, b, 0.5 * (a + b))
            )
            if np.all(np.isfinite([low, high, middle])):
                mean = 0.5 * (low + high)
                assert middle <= mean + 1e-9 * (1 + np.abs([low, high, middle]).max())
                curved += middle < mean - 1e-6
    assert count > 12
    assert curved > 12


def test_norms_of_what_is_affine_are_convex():
    """√(w² + |e|²) with e = X + r(Θ): its second derivative is a sum of squares (Lagrange)."""
    x, y = variable(3) + variable(0).sin(), variable(4) - variable(1).cos() * variable(0)
    root = (1 + x * x + y * y).function("sqrt")
    assert is_convex(root, (3, 4))
    assert is_convex(2 * root + x**4, (3, 4))
    assert not is_convex(-root, (3, 4))
    assert not is_convex((x * x + y * y - variable(0) ** 2).function("sqrt"), (3, 4))
    assert not is_convex((2 + x).function("sqrt"), (3, 4))
