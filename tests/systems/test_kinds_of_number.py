"""Every element and every system gives the same numbers for each kind of number.

Kinds are floats, complex numbers, fifty digits, intervals, and symbols of the compiled engine.
"""

import mpmath
import numpy as np
import pytest
from flint import arb, ctx
from support.balls import arbs
from support.differences import jacobian as by_differences
from support.differences import relative_error
from support.elements import CASES, SWITCHING_CASES, forms_of, random_element
from support.systems import random_body, random_state, random_system

from rbstab.elements.registry import CONNECTORS
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import FUNCTIONS
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

ALONE = CASES + SWITCHING_CASES

for name in ("sin", "cos", "sqrt"):
    FUNCTIONS[name].register(mpmath.mpf, getattr(mpmath, name))
exact = np.vectorize(mpmath.mpf, otypes=[object])


def statements(system, y):
    """Return all that the first element of a system states of itself."""
    element, motion, states = system.elements[0], system.motion(y), y[system.coordinates.size :]
    return np.concatenate(
        [
            *element.wrench(motion, states),
            [element.stored(motion, states), element.dissipated(motion, states)],
            element.rates(motion, states),
            element.guards(motion, states),
        ]
    )


@pytest.fixture(params=[*EVERY, *ALONE], ids=lambda case: f"{case[0]} {case[1].name}")
def evaluated(request, rng):
    """What is evaluated: the rates of a system, or what a single element states; and a state."""
    if request.param in EVERY:
        system = random_system(rng, *request.param)
        return System.audited_rates, system, random_state(rng, system)
    element = random_element(rng, *request.param)
    alone = System(random_body(rng), (element,), CentreCoordinates(), rng.normal(size=3) * 0.1)
    return statements, alone, random_state(rng, alone)


def test_complex_numbers_give_the_floats_and_their_derivatives(evaluated):
    function, system, y = evaluated
    values, unshifted = function(system, y), function(system, y + 0j)
    assert unshifted.dtype == complex
    assert relative_error(unshifted.real, values) < 1e-14
    np.testing.assert_array_equal(unshifted.imag, 0)
    slopes = jacobian(lambda x: function(system, x), y)
    step = forms_of(type(system.elements[0]))[0].step
    differences = by_differences(lambda x: function(system, x), y, 2e-3 * step)
    # The eighth order of a step of 0.002 leaves 1e-11 where 1/cos θ2 is large.
    # A constant force has no slopes that could be the scale of an error.
    assert relative_error(slopes, differences, None if differences.any() else 1.0) < 1e-11


def test_fifty_digits_agree_with_floats(evaluated):
    function, system, y = evaluated
    with mpmath.workdps(50):
        precise = function(map_parameters(system, lambda _, value: exact(value)), exact(y))
    assert relative_error(function(system, y), precise.astype(float)) < 1e-14
    assert function is statements or {type(number) for number in precise[-2:]} == {mpmath.mpf}


def test_intervals_agree_with_floats_and_hold_the_values_inside_them(evaluated, rng):
    function, system, y = evaluated
    as_balls = map_parameters(system, lambda _, value: arbs(value))
    with ctx.workprec(200):
        middles = np.array([float(arb(entry)) for entry in function(as_balls, arbs(y))])
    assert relative_error(function(system, y), middles) < 1e-14
    reach = 1e-3
    box = np.array([arb(entry, reach) for entry in y.tolist()], dtype=object)
    wide = function(as_balls, box)
    for _ in range(20):
        inside = function(system, y + rng.uniform(-reach, reach, size=y.shape))
        # Floats have round-off where an interval is narrow.
        error = 1e-14 * np.abs(inside).max()
        for value, bounds in zip(inside.tolist(), wide, strict=True):
            assert arb(value, error).overlaps(arb(bounds))


def test_symbols_of_the_compiled_engine_agree_with_floats(evaluated):
    hy = pytest.importorskip("heyoka")
    from rbstab.integrate.heyoka.symbols import parameter_values, state_symbols, symbols_of

    function, system, y = evaluated
    symbolic, _, count = symbols_of(system)
    unknowns = state_symbols(system.size)
    expressions = [hy.expression(0.0) + entry for entry in function(symbolic, unknowns)]
    compiled = hy.cfunc(expressions, vars=list(unknowns))
    parameters = parameter_values(system)
    assert parameters.shape == (count,)
    # heyoka drops the last parameters, which belong to the anchor, where nothing reads them.
    actual = compiled(y, pars=parameters[: compiled.nparams])
    assert relative_error(actual, function(system, y)) < 1e-14
