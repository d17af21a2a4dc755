"""Every element and every system gives the same numbers for each kind of number.

Kinds are floats, complex numbers, fifty digits, intervals, and symbols of the compiled engine.
"""

import mpmath
import numpy as np
import pytest
from flint import arb, ctx
from support.differences import jacobian as by_differences
from support.differences import relative_error
from support.duals import arbs
from support.elements import CASES, case_id, forms_of, random_element
from support.systems import random_body, random_state, random_system

from rbstab.elements.registry import CONNECTORS
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import cos_of, sin_of, sqrt_of
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

EVERY = [
    ("free", CentreCoordinates()),
    *(
        (variant, coordinates)
        for variant in CONNECTORS
        for coordinates in (CentreCoordinates(), ContactCoordinates())
    ),
    ("permanent", ReducedCoordinates()),
    ("permanent", ManifoldCoordinates(3.0)),
]

sin_of.register(mpmath.mpf, mpmath.sin)
cos_of.register(mpmath.mpf, mpmath.cos)
sqrt_of.register(mpmath.mpf, mpmath.sqrt)
exact = np.vectorize(mpmath.mpf, otypes=[object])


def audited_rates(system, y):
    """Return the rates of a system, v' and F'Λ."""
    return system.audited_rates(y)


def statements(system, y):
    """Return all that the first element of a system states of itself."""
    element, motion, own = system.elements[0], system.motion(y), y[system.coordinates.size :]
    return np.concatenate(
        [
            *element.wrench(motion, own),
            [element.stored(motion, own), element.dissipated(motion, own)],
            element.rates(motion, own),
        ]
    )


@pytest.fixture(params=EVERY, ids=lambda every: f"{every[0]} {every[1].name}")
def system(request, rng):
    return random_system(rng, *request.param)


@pytest.fixture(params=CASES, ids=case_id)
def alone(request, rng):
    """A body with a single element."""
    element = random_element(rng, *request.param)
    return System(random_body(rng), (element,), CentreCoordinates(), rng.normal(size=3) * 0.1)


def check_complex_numbers(function, system, y, step=1.0):
    """Assert that complex numbers give the floats, and by complex steps their derivatives."""
    values = function(system, y)
    unshifted = function(system, y + 0j)
    assert unshifted.dtype == complex
    assert relative_error(unshifted.real, values) < 1e-14
    np.testing.assert_array_equal(unshifted.imag, 0)
    slopes = jacobian(lambda x: function(system, x), y)
    differences = by_differences(lambda x: function(system, x), y, 2e-3 * step)
    # The eighth order of a step of 0.002 leaves 1e-11 where 1/cos θ2 is large.
    # A constant force has no slopes that could be the scale of an error.
    assert relative_error(slopes, differences, None if differences.any() else 1.0) < 1e-11


def test_complex_numbers_give_the_floats_and_their_derivatives(rng, system):
    check_complex_numbers(audited_rates, system, random_state(rng, system))


def test_complex_numbers_through_every_element(rng, alone):
    (step,) = {form.step for form in forms_of(type(alone.elements[0]))}
    check_complex_numbers(statements, alone, random_state(rng, alone), step)


def check_fifty_digits(function, system, y):
    """Assert that fifty digits give the floats, and return them."""
    with mpmath.workdps(50):
        found = function(map_parameters(system, lambda _, value: exact(value)), exact(y))
    assert relative_error(function(system, y), found.astype(float)) < 1e-14
    return found


def test_fifty_digits_agree_with_floats(rng, system):
    rates = check_fifty_digits(audited_rates, system, random_state(rng, system))
    assert {type(rate) for rate in rates[-2:]} == {mpmath.mpf}


def test_fifty_digits_through_every_element(rng, alone):
    check_fifty_digits(statements, alone, random_state(rng, alone))


def check_intervals(function, system, y, rng):
    """Assert that narrow intervals give the floats, and wide ones hold the values inside them."""
    with ctx.workprec(200):
        narrow = function(map_parameters(system, lambda _, value: arbs(value)), arbs(y))
        found = np.array([float(arb(entry)) for entry in narrow])
    assert relative_error(function(system, y), found) < 1e-14
    reach = 1e-3
    box = np.array([arb(entry, reach) for entry in y.tolist()], dtype=object)
    wide = function(map_parameters(system, lambda _, value: arbs(value)), box)
    for _ in range(20):
        inside = function(system, y + rng.uniform(-reach, reach, size=y.shape))
        # Floats have round-off where an interval is narrow.
        error = 1e-14 * np.abs(inside).max()
        for value, bounds in zip(inside.tolist(), wide, strict=True):
            assert arb(value, error).overlaps(arb(bounds))


def test_intervals_agree_with_floats(rng, system):
    check_intervals(audited_rates, system, random_state(rng, system), rng)


def test_intervals_through_every_element(rng, alone):
    check_intervals(statements, alone, random_state(rng, alone), rng)


def check_symbols(function, system, y):
    """Assert that the compiled expressions of heyoka give the floats."""
    hy = pytest.importorskip("heyoka")
    from rbstab.integrate.heyoka.symbols import parameter_values, state_symbols, symbols_of

    symbolic, _, count = symbols_of(system)
    unknowns = state_symbols(system.size)
    expressions = [hy.expression(0.0) + entry for entry in function(symbolic, unknowns)]
    compiled = hy.cfunc(expressions, vars=list(unknowns))
    known = parameter_values(system)
    assert known.shape == (count,)
    # heyoka drops the last parameters, which belong to the anchor, where nothing reads them.
    actual = compiled(y, pars=known[: compiled.nparams])
    assert relative_error(actual, function(system, y)) < 1e-14


def test_symbols_of_the_compiled_engine_agree_with_floats(rng, system):
    check_symbols(audited_rates, system, random_state(rng, system))


def test_symbols_through_every_element(rng, alone):
    check_symbols(statements, alone, random_state(rng, alone))
