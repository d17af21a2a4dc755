"""The same equations for complex numbers, fifty digits, and symbols of a compiled engine."""

import mpmath
import numpy as np
import pytest
from support.differences import jacobian as by_differences
from support.differences import relative_error
from support.systems import random_state, random_system

from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import cos_of, sin_of
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)
from rbstab.systems.parameters import map_parameters, parameters

EVERY = [
    ("free", CentreCoordinates()),
    ("visco-elastic", ContactCoordinates()),
    ("embedded", CentreCoordinates()),
    ("embedded", ContactCoordinates()),
    ("permanent", ReducedCoordinates()),
    ("permanent", ManifoldCoordinates(3.0)),
]

sin_of.register(mpmath.mpf, mpmath.sin)
cos_of.register(mpmath.mpf, mpmath.cos)
exact = np.vectorize(mpmath.mpf, otypes=[object])


@pytest.fixture(params=EVERY, ids=lambda every: f"{every[0]} {every[1].name}")
def system(request, rng):
    return random_system(rng, *request.param)


def test_complex_numbers_give_the_floats_and_their_derivatives(rng, system):
    y = random_state(rng, system)
    rates = system.audited_rates(y)
    unshifted = system.audited_rates(y + 0j)
    assert unshifted.dtype == complex
    assert relative_error(unshifted.real, rates) < 1e-14
    np.testing.assert_array_equal(unshifted.imag, 0)
    slopes = jacobian(system.audited_rates, y)
    differences = by_differences(system.audited_rates, y, 2e-3)
    # The eighth order of a step of 0.002 leaves 1e-11 where 1/cos θ2 is large.
    assert relative_error(slopes, differences) < 1e-11


def test_fifty_digits_agree_with_floats(rng, system):
    y = random_state(rng, system)
    with mpmath.workdps(50):
        rates = map_parameters(system, lambda _, value: exact(value)).audited_rates(exact(y))
    assert {type(rate) for rate in rates[-2:]} == {mpmath.mpf}
    assert relative_error(system.audited_rates(y), rates.astype(float)) < 1e-14


def test_lyapunov_rate_to_thirty_digits(rng, system):
    with mpmath.workdps(80):
        y = exact(random_state(rng, system))
        precise = map_parameters(system, lambda _, value: exact(value))
        audited, step = precise.audited_rates(y), mpmath.mpf(10) ** -25
        forth, back = (precise.observe(y + s * audited[:-2]).energy.sum() for s in (step, -step))
        # A central difference: of the order of the step squared, 1e-50, times the pace cubed.
        rate = (forth - back) / (2 * step)
        # Off the sub manifold the force of constraint does work, which no element stores.
        expected = audited[-2] + (audited[-1] if system.coordinates.name == "manifold" else 0)
        assert abs(rate - expected) < mpmath.mpf(10) ** -30 * abs(expected)


def test_symbols_of_the_compiled_engine_agree_with_floats(rng, system):
    hy = pytest.importorskip("heyoka")
    # Brings the sine and cosine of heyoka's expressions with it.
    import rbstab.integrate.heyoka.engine  # noqa: F401

    names, values = [], parameters(system)

    def symbols(name, value):
        first = sum(values[known].size for known in names)
        names.append(name)
        found = [hy.par[first + k] for k in range(value.size)]
        return np.array(found, dtype=object).reshape(value.shape)

    y = random_state(rng, system)
    unknowns = [hy.expression(f"y{k}") for k in range(system.size)]
    symbolic = map_parameters(system, symbols).audited_rates(np.array(unknowns, dtype=object))
    compiled = hy.cfunc(list(symbolic), vars=unknowns)
    known = np.concatenate([np.ravel(values[name]) for name in names])
    # Nothing ties a free body to its anchor, the last three: heyoka drops what is not read.
    actual = compiled(y, pars=known[: compiled.nparams])
    assert relative_error(actual, system.audited_rates(y)) < 1e-14
