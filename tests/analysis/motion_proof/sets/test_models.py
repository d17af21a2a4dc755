"""Taylor models hold the functions that they stand for, and their remainders are close.

The true coefficients of τᵏ are computed at single z by power series of balls in 200 bits. The
remainders of the operands are realised by numbers of that size.
"""

from itertools import product
from math import factorial

import numpy as np
import pytest
from flint import arb, arb_series, ctx
from support.polynomial_sets import value_at

from rbstab.analysis.motion_proof.sets import models as models_module
from rbstab.analysis.motion_proof.sets.graph import Graph
from rbstab.analysis.motion_proof.sets.models import (
    Model,
    combination,
    constant_factors,
    evaluated,
    program,
)
from rbstab.analysis.motion_proof.sets.monomials import Monomials

BITS = 200
SHAPES = [(1, 1, 1), (1, 5, 6), (2, 3, 4), (3, 2, 5), (2, 4, 1)]
"""Variables, degree in z, and terms in τ."""


def random_model(rng, shape, size=1.0, remainder=0.0, middle=0.0):
    """Return a model with random coefficients, which fall with the degree and with k."""
    variables, degree, terms = shape
    space = Monomials(variables, degree)
    falling = 0.5 ** (space.degrees[:, np.newaxis] + np.arange(terms))
    polynomial = size * falling * rng.uniform(-1, 1, (len(space), terms))
    polynomial[0, 0] += middle
    return Model(space, polynomial, remainder * 0.5 ** np.arange(terms))


def series_of(model, z, signs):
    """Return one of the functions that a model holds, at z, as a series in τ."""
    signs = np.resize(signs, len(model.remainder))  # a derivative is shorter
    coefficients = [
        value_at(model.space, column, z) + arb(float(r)) * s
        for column, r, s in zip(model.polynomial.T.tolist(), model.remainder, signs, strict=True)
    ]
    return arb_series(coefficients, prec=len(coefficients))


def places(rng, model):
    """Yield points z, with signs of the remainders: corners, and random ones."""
    variables, terms = model.space.variables, len(model.remainder)
    for corner in product((-1.0, 1.0), repeat=variables):
        yield corner, np.full(terms, 1.0)
        yield corner, rng.choice([-1.0, 1.0], terms)
    for _ in range(6):
        yield tuple(rng.uniform(-1, 1, variables).tolist()), rng.uniform(-1, 1, terms)


def errors_of(rng, operands, found, function):
    """Return the largest errors of a model's polynomial that were seen, by k, and check them."""
    terms = len(found.remainder)
    seen = np.zeros(terms)
    for z, signs in places(rng, found):
        with ctx.workprec(BITS):
            ctx_cap, ctx.cap = ctx.cap, terms
            try:
                true = function(*[series_of(one, z, signs) for one in operands])
                for k in range(terms):
                    apart = true[k] - value_at(found.space, found.polynomial[:, k].tolist(), z)
                    assert abs(apart) <= arb(float(found.remainder[k]))
                    seen[k] = max(seen[k], float(abs(apart)))
            finally:
                ctx.cap = ctx_cap
    return seen


@pytest.mark.parametrize("remainder", [0.0, 1e-3])
@pytest.mark.parametrize("shape", SHAPES)
def test_products(rng, shape, remainder):
    x, y = (random_model(rng, shape, remainder=remainder) for _ in range(2))
    errors_of(rng, (x, y), x * y, lambda a, b: a * b)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_remainder_of_a_product_is_reached(rng, shape):
    """With positive coefficients, nothing of it is left out, and nothing is counted twice."""
    x, y = (random_model(rng, shape, remainder=1e-2) for _ in range(2))
    x, y = (Model(one.space, np.abs(one.polynomial), one.remainder) for one in (x, y))
    found = x * y
    seen = errors_of(rng, (x, y), found, lambda a, b: a * b)
    assert seen == pytest.approx(found.remainder, rel=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_inverses(rng, shape):
    for size, remainder in ((0.3, 0.0), (0.1, 0.0), (0.2, 1e-3)):
        x = random_model(rng, shape, size, remainder, middle=rng.choice([-0.9, 1.3]))
        errors_of(rng, (x,), x.inverse, lambda a: 1 / a)


def test_the_remainder_of_an_inverse_is_reached():
    """1/(0.5 - 0.2τ - 0.1τ²) = 2 + 0.8τ + 0.72τ² + ..., known as 1 ± 0.5 ± 0.2τ ± 0.1τ²."""
    x = Model(Monomials(1, 1), np.array([[1.0, 0, 0], [0, 0, 0]]), np.array([0.5, 0.2, 0.1]))
    assert x.inverse.polynomial[0].tolist() == [1.0, 0.0, 0.0]
    assert np.all(x.inverse.remainder >= [1.0, 0.8, 0.72])
    assert x.inverse.remainder == pytest.approx([1.0, 0.8, 0.72], rel=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_sines_and_cosines(rng, shape):
    for size, remainder in ((0.4, 0.0), (0.4, 1e-2)):
        x = random_model(rng, shape, size, remainder, middle=rng.uniform(-3, 3))
        sine, cosine = x.sine_and_cosine
        errors_of(rng, (x,), sine, arb_series.sin)
        errors_of(rng, (x,), cosine, arb_series.cos)


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 5, 6), (2, 4, 3)])
def test_remainders_of_narrow_sets_are_not_far_above_the_errors(rng, shape):
    """Within a factor of 60 of the errors that are seen, where rounding does not count."""
    x = random_model(rng, shape, 0.1, middle=0.9)
    x = Model(x.space, np.abs(x.polynomial), x.remainder)
    pairs = [
        (x.inverse, lambda a: 1 / a),
        (x.sine_and_cosine[0], arb_series.sin),
        (x.sine_and_cosine[1], arb_series.cos),
    ]
    for found, function in pairs:
        seen = errors_of(rng, (x,), found, function)
        assert np.all(found.remainder <= 60 * seen + 1e-13)
        assert found.remainder.max() < 0.05


@pytest.mark.parametrize("remainder", [1e-9, 1e-3, 0.3])
def test_what_an_operand_misses_is_no_more_than_it_does(rng, remainder):
    """A remainder of x changes sin x by about as much, and 1/x by that over x²."""
    space = Monomials(1, 1)
    x = Model(space, np.array([[1.2], [0.0]]), np.array([remainder]))
    sine, cosine = x.sine_and_cosine
    assert remainder <= sine.remainder[0] < 1.001 * remainder + 1e-14
    assert remainder <= cosine.remainder[0] < 1.001 * remainder + 1e-14
    least = 1 / (1.2 - remainder) - 1 / 1.2
    assert least <= x.inverse.remainder[0] < 1.001 * least + 1e-14


def test_the_remainder_of_each_power_of_an_angle_counts():
    """x = r τ: sin x = r τ - r³τ³/6, and what cos x misses begins with r²τ²/2."""
    space = Monomials(1, 1)
    remainder = np.array([0.0, 0.1, 0.0, 0.0])
    sine, cosine = Model(space, np.zeros((2, 4)), remainder).sine_and_cosine
    expected = np.array([0.0, 0.1, 0.1**2 / 2, 0.1**3 / 6])
    for one in (sine, cosine):
        assert np.all(one.remainder >= expected)
        assert one.remainder == pytest.approx(expected, rel=1e-9, abs=1e-14)


@pytest.mark.parametrize("start", [0.0, 0.7])
def test_an_error_at_the_beginning_goes_on_in_later_terms(rng, start):
    """x = x0 + 3τ ± r: the terms of τ of sin x and cos x change by 3r sin x0 and 3r cos x0."""
    space = Monomials(1, 1)
    polynomial = np.array([[start, 3.0, 0.0, 0.0], np.zeros(4)])
    x = Model(space, polynomial, np.array([0.01, 0.0, 0.0, 0.0]))
    sine, cosine = x.sine_and_cosine
    seen = errors_of(rng, (x,), sine, arb_series.sin) + errors_of(rng, (x,), cosine, arb_series.cos)
    assert np.all(seen[1:] > 0.02)
    # The same holds for what is missed by the polynomials at τ = 0.
    wide = Model(space, polynomial + np.array([[0.0] * 4, [0.5, 0, 0, 0]]), np.zeros(4))
    sine, cosine = wide.sine_and_cosine
    errors_of(rng, (wide,), sine, arb_series.sin)
    errors_of(rng, (wide,), cosine, arb_series.cos)


@pytest.mark.parametrize("shape", SHAPES)
def test_combinations_with_factors_that_are_balls(rng, shape):
    operands = [random_model(rng, shape, remainder=1e-2) for _ in range(3)]
    with ctx.workprec(20):
        graph = Graph()
        variables = graph.variables(3)
        factors = [arb(x, 1e-3) for x in rng.uniform(-2, 2, 3).tolist()]
        constant = arb(0.7, 1e-2)
        form = sum((f * x for f, x in zip(factors, variables, strict=True)), graph.form(constant))
    (found,) = evaluated(program(graph, [form]), operands)

    def true(*values):
        """One choice of the numbers in the balls: each at one of its ends."""
        ends = [(f.upper() if rng.random() < 0.5 else f.lower()) for f in (*factors, constant)]
        total = arb_series([ends[-1]])
        for end, value in zip(ends, values, strict=False):
            total = total + end * value
        return total

    for _ in range(4):
        errors_of(rng, operands, found, true)


def test_the_remainder_of_a_combination_is_reached():
    """All errors at their ends: (2 ± 0.1)(x ± 0.01) + 3 ± 0.5 with |x| <= 1 + 0.25."""
    graph = Graph()
    x = graph.variables(1)[0]
    form = arb(2, 0.1) * x + arb(3, 0.5)
    space = Monomials(1, 1)
    operand = Model(space, np.array([[1.0], [0.25]]), np.array([0.01]))
    found = combination(constant_factors(form), [operand], operand)
    assert found.polynomial[:, 0].tolist() == [5.0, 0.5]
    expected = 2 * 0.01 + 0.1 * (1.25 + 0.01) + 0.5
    assert expected <= found.remainder[0] < expected * (1 + 1e-6)


@pytest.mark.parametrize("terms", [1, 4])
def test_rounding_errors_are_in_the_remainders(rng, terms):
    """Models without remainders, whose products have no high degrees: what is left is rounding."""
    space = Monomials(2, 4)
    polynomials = np.zeros((3, len(space), terms))
    low = len(Monomials(2, 2))
    polynomials[:, :low] = rng.uniform(1, 2, (3, low, terms))
    x, y, u = (Model(space, one, np.zeros(terms)) for one in polynomials)
    found = x * y
    seen = errors_of(rng, (x, y), found, lambda a, b: a * b)
    assert seen.min() > 0
    assert np.all(found.remainder < 1e-12)
    graph = Graph()
    forms = graph.variables(3)
    (form,) = [0.1 * forms[0] + 0.7 * forms[1] + forms[2] + 1.3]
    (total,) = evaluated(program(graph, [form]), [x, y, u])
    with ctx.workprec(BITS):
        sums = errors_of(
            rng, (x, y, u), total, lambda a, b, c: a * arb(0.1) + b * arb(0.7) + c + arb(1.3)
        )
    assert sums.min() > 0
    assert np.all(total.remainder < 1e-13)


def test_rounding_of_sums_quotients_and_derivatives_counts(rng):
    """The largest error of a single operation is in the remainder, and nothing much larger."""
    space, terms = Monomials(1, 1), 8
    x, y = (Model(space, rng.uniform(1, 2, (2, terms)), np.zeros(terms)) for _ in range(2))
    y = Model(space, y.polynomial / 3, y.remainder)
    cases = [
        (models_module._sum(x, y), (x, y), lambda a, b: a + b),
        (models_module._divided(x, -7), (x,), lambda a: a / -7),
        (models_module._derivative(x), (x,), arb_series.derivative),
    ]
    for found, operands, function in cases:
        assert errors_of(rng, operands, found, function).max() > 0
        assert np.all(found.remainder < 1e-14)


def test_rounding_of_inverses_and_angles_counts(rng):
    """Constants: the remainder is above the rounding error of a double, and not far above it."""
    space = Monomials(1, 1)
    for value in rng.uniform(0.3, 3, 10).tolist():
        x = Model(space, np.array([[value], [0.0]]), np.zeros(1))
        for found, function in (
            (x.inverse, lambda a: 1 / a),
            (x.sine_and_cosine[0], arb_series.sin),
            (x.sine_and_cosine[1], arb_series.cos),
        ):
            errors_of(rng, (x,), found, function)
            assert found.remainder[0] < 1e-13


@pytest.mark.parametrize("u", [0.3, 1.0, 1.9])
def test_the_rest_of_the_series_of_sine_and_cosine(u):
    terms = models_module.ANGLE_TERMS
    first = 2 * terms + 2
    left_out = sum(u**k / factorial(k) for k in range(first, first + 40))
    found = models_module._rest_of_series(np.array(u))
    assert left_out <= found < 2.1 * u**first / factorial(first)


def test_the_rest_of_the_series_is_in_the_remainder(rng):
    """A degree so high that nothing else is left out: the first term left out is u²⁰/20!."""
    space = Monomials(1, 24)
    polynomial = np.zeros((len(space), 1))
    polynomial[:2, 0] = (0.0, 1.9)
    x = Model(space, polynomial, np.zeros(1))
    sine, cosine = x.sine_and_cosine
    errors_of(rng, (x,), sine, arb_series.sin)
    seen = errors_of(rng, (x,), cosine, arb_series.cos)
    assert seen[0] > 0.9 * 1.9**20 / factorial(20)
    assert cosine.remainder[0] < 10 * seen[0]


def test_wide_angles_have_no_bound():
    space = Monomials(1, 2)
    for wide in (2.0, 100.0, np.inf, np.nan):
        x = Model(space, np.array([[0.3], [wide], [0.0]]), np.zeros(1))
        with np.errstate(all="ignore"):
            for found in x.sine_and_cosine:
                assert not np.isfinite(found.remainder).any()
    x = Model(space, np.array([[100.0], [1.9], [0.0]]), np.zeros(1))
    assert x.sine_and_cosine[0].remainder[0] < 5.0


@pytest.mark.parametrize(
    ("middle", "slope", "remainder"),
    [
        (0.0, 0.0, 0.0),
        (1.0, 1.0, 0.0),
        (0.5, 0.6, 0.0),
        (1.0, 0.0, 1.0),
        (-1.0, 0.5, 0.6),
        (np.nan, 0.0, 0.0),
        (np.inf, 0.0, 0.0),
        (1.0, np.nan, 0.0),
        (1.0, 0.0, np.nan),
    ],
)
def test_a_number_that_may_be_zero_has_no_inverse(middle, slope, remainder):
    """Neither has a number that is not finite."""
    graph = Graph()
    (x,) = graph.variables(1)
    model = Model(
        Monomials(1, 1), np.array([[middle, 0.0], [slope, 0.0]]), np.array([remainder, 0.0])
    )
    for found in evaluated(program(graph, [1 / x, 2 / x + 1, x / x, (1 / x).sin()]), [model]):
        assert not np.isfinite(found.remainder).any()


def test_numbers_that_are_not_finite_are_not_lost():
    """They stay visible in the remainder or the polynomial of all that follows from them."""
    graph = Graph()
    x, y = graph.variables(2)
    space = Monomials(1, 2)
    good = Model(space, np.full((3, 2), 0.25), np.zeros(2))
    for bad in (np.inf, np.nan):
        for broken in (
            Model(space, np.array([[0.1, bad], [0, 0], [0, 0]]), np.zeros(2)),
            Model(space, np.zeros((3, 2)), np.array([0.0, bad])),
        ):
            for found in evaluated(program(graph, [x * y, x + y, 2 * x + 1]), [broken, good]):
                assert not np.isfinite(found.remainder[1])


def test_polynomials_in_tau_of_an_angle_follow_their_equation(rng):
    """A model with many terms, so that wrong powers of τ would be seen."""
    x = random_model(rng, (1, 3, 12), 1.0, 1e-6)
    sine, cosine = x.sine_and_cosine
    errors_of(rng, (x,), sine, arb_series.sin)
    errors_of(rng, (x,), cosine, arb_series.cos)


def test_only_what_is_needed_is_computed():
    graph = Graph()
    x, y = graph.variables(2)
    unused = (x / y).sin()
    made = program(graph, [x * y + 2])
    assert [kind for _, kind, _ in made.steps] == ["variable", "variable", "product"]
    assert len(program(graph, [unused]).steps) == 5
