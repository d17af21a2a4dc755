"""Taylor models hold the functions for which they stand, compared in 220 bits."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from support.polynomial_sets import BITS, value_at

from rbstab.proof.exact.expr import expr, factored, numbers, variables
from rbstab.proof.motion.models import Models, Proved, evaluated
from rbstab.proof.motion.monomials import monomials_up_to
from rbstab.proof.motion.program import programs
from rbstab.proof.motion.series import node_series

SHAPES = [(0, 0, 1), (0, 0, 4), (2, 3, 1), (2, 2, 3)]
"""Variables and degree in z, and terms in τ."""

FUNCTIONS = [
    *product(["inverse", "sqrt", "log", "atan", "sin", "cos", "exp"], SHAPES),
    *product(["tan", "sinh", "cosh", "tanh"], SHAPES[1:2]),
]


def random_models(shape, rng, count, size=0.2, remainder=0.0):
    """Return models of 3 sets with constants in 0.6 to 1.3."""
    space = monomials_up_to(*shape[:2])
    polynomial = size * rng.uniform(-1, 1, (shape[2], count, 3, len(space)))
    polynomial /= len(space) * shape[2]
    polynomial[0, ..., 0] = rng.uniform(0.6, 1.3, (count, 3))
    return Models(space, polynomial, np.full((count, 3), remainder))


def values(models, z, tau, signs):
    """Return a function in each model of each set, exactly: it is on an edge of the model."""
    with ctx.workprec(BITS):
        balls = np.empty(models.remainder.shape, dtype=object)
        for (i, k), r in np.ndenumerate(models.remainder):
            total = arb(float(signs[i])) * arb(float(r))
            for power, row in enumerate(models.polynomial[:, i, k].tolist()):
                total += value_at(models.space, row, z) * arb(tau) ** power
            balls[i, k] = total
    return balls


def traced(function, count):
    """Return the program of a function of some variables."""
    with factored():
        results = [expr(entry) for entry in np.ravel(function(variables(range(count))))]
    return programs(count, results)[0]


def assert_holds(function, shape, seed, count=2, **given):
    """Check what `function` gives of models against what it gives of numbers in them."""
    rng = np.random.default_rng(seed)
    models = random_models(shape, rng, count, **given)
    results = evaluated(traced(function, count), models)
    assert np.isfinite(results.remainder).all()
    worst = assert_contains(function, models, results, rng)
    return results, worst


def assert_contains(function, models, results, rng):
    """Return the largest error of what is found, relative to its remainder; it is at most one."""
    worst = 0.0
    for _ in range(6):
        z = rng.choice([-1.0, 1.0, 0.3], models.space.variables).tolist()
        tau, signs = float(rng.choice([0.0, 1.0, 0.7])), rng.choice([-1.0, 1.0], 9)
        with ctx.workprec(BITS):
            x = values(models, z, tau, signs)
            near = values(
                Models(results.space, results.polynomial, 0 * results.remainder), z, tau, signs
            )
            for k in range(3):
                exact = np.ravel(function(x[:, k]))
                for i, number in enumerate(exact):
                    apart = abs(number - near[i, k])
                    assert apart <= arb(float(results.remainder[i, k]))
                    worst = max(worst, float(apart) / results.remainder[i, k])
    return worst


def named(name):
    if name == "inverse":
        return lambda x: 1 / x[:1]
    return lambda x: np.array([getattr(x[0], name)()], dtype=object)


@pytest.mark.parametrize(("name", "shape"), FUNCTIONS)
def test_functions(name, shape):
    for seed, given in enumerate([{}, {"remainder": 1e-3}, {"size": 1e-3}, {"remainder": 1e-9}]):
        results, _ = assert_holds(named(name), shape, seed, count=1, **given)
        if given.get("size") or shape == (0, 0, 1):
            left_out = 1e-13 if shape == (0, 0, 1) else 1e-5
            assert results.remainder.max() < left_out + 30 * given.get("remainder", 0.0)


@pytest.mark.parametrize("shape", SHAPES)
def test_sums_and_products(shape):
    """Rounding errors and high terms are in the remainders, which are not far too large."""

    def some(x):
        a, b = x[0] + 0.1, x[1] - 7.3 * x[0]
        return np.array([0.3 * a + b, a * b, (a * a) * (b - 2.0), 0 * a + 0.1])

    seen = [
        assert_holds(some, shape, seed, **given)[1]
        for seed in range(9)
        for given in ({}, {"remainder": 1e-2})
    ]
    assert max(seen) > 0.05


@pytest.mark.parametrize(
    "name",
    [
        *("product", "inverse", "sqrt", "log", "atan", "sin", "cos", "exp"),
        *("log of inverse", "atan of inverse"),
    ],
)
@pytest.mark.parametrize("shape", SHAPES[1:])
def test_a_bad_guess_is_proved_as_well(name, shape):
    """Polynomials that are far from the functions only have larger remainders.

    The slope of log(1/p) is p by rewriting, which would say nothing of arguments beside 1/p.
    """
    rng, count = np.random.default_rng(4), 2 if name == "product" else 1
    models = random_models(shape, rng, count, remainder=1e-5)
    outer, of, _ = name.partition(" of inverse")
    function = (lambda x: x[:1] * x[1:]) if name == "product" else named(outer)
    if of:
        inner, function = function, lambda x: inner(1.0 / x)
    program = traced(function, count)
    guess = node_series(program, models.space, models.polynomial)
    near = Proved(program, models.space, guess).results(models.remainder)
    guess[:, count:] += 1e-3 * rng.uniform(-1, 1, guess[:, count:].shape) / guess[0, 0].size
    far = Proved(program, models.space, guess).results(models.remainder)
    assert_contains(function, models, far, rng)
    assert np.all(far.remainder > near.remainder)


@pytest.mark.parametrize("name", ["sin", "log", "atan"])
def test_an_error_that_satisfies_the_own_equation_counts(name):
    """A sine that rises by a wrong cosine does, and an integral with another constant."""
    models, rng = random_models((0, 0, 4), np.random.default_rng(6), 1), np.random.default_rng(7)
    program = traced(named(name), 1)
    guess = node_series(program, models.space, models.polynomial)
    (node,) = program.places[name]
    if name == "sin":
        guess[0, program.places["cos"], :, 0] += 0.1
        guess[1:, node] += 0.1 * models.polynomial[1:, 0]
    else:
        guess[0, node, :, 0] += 0.1
    results = Proved(program, models.space, guess).results(models.remainder)
    assert_contains(named(name), models, results, rng)


@pytest.mark.parametrize(
    ("name", "constant", "size"),
    [
        ("inverse", 0.1, 0.2),
        ("log", 0.1, 0.2),
        ("exp", 0.0, 17.0),
        ("inverse", np.nan, 0.1),
    ],
)
def test_nothing_is_known_beyond_the_domain(name, constant, size):
    space = monomials_up_to(1, 2)
    polynomial = np.array([constant, size, 0.0]).reshape(1, 1, 1, 3)
    results = evaluated(traced(named(name), 1), Models(space, polynomial, np.zeros((1, 1))))
    assert not np.isfinite(results.remainder).any()


def test_constants_are_the_decimals_that_they_mean():
    """0.1 is a tenth, and its sine is that of a tenth; equal formulas cancel exactly."""

    def some(x):
        tenth: Any = numbers(np.array(0.1))[()]
        return np.array([tenth * x[0], tenth.sin() * x[0], x[0] * tenth - tenth * x[0] + 0.0])

    unity = Models(monomials_up_to(0, 0), np.ones((1, 1, 1, 1)), np.zeros((1, 1)))
    results = evaluated(traced(some, 1), unity)
    assert results.polynomial[0, 2, 0, 0] == 0
    with ctx.workprec(BITS):
        for k, exact in enumerate([arb(1) / 10, (arb(1) / 10).sin(), arb(0)]):
            missed = abs(exact - arb(float(results.polynomial[0, k, 0, 0])))
            assert missed <= arb(float(results.remainder[k, 0])) < 1e-15
            assert (missed > 0) == (k < 2)
