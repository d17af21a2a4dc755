"""Eq. 29 and 30: the Lyapunov function v of the free body and its rate."""

import numpy as np
import pytest
from scipy.linalg import sqrtm
from support.differences import along, relative_error
from support.reading import gain, kinetic_energy, read, total_energy
from support.systems import random_state, random_system

from rbstab.analysis.lyapunov import lyapunov_trace
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.systems.coordinates import ContactCoordinates


@pytest.fixture(params=[None, ContactCoordinates()], ids=["Z", "W"])
def system(request, rng):
    return random_system(rng, "free", request.param)


def lyapunov_value(system, y):
    """Return v as a result file stores it."""
    observed = system.observe(y)
    rest = nearest_rest_state(system)
    value, _ = lyapunov_trace(observed.energy[None], np.zeros(1), rest.energy)
    return value[0]


def test_eq_29_rate_of_the_lyapunov_function(rng, system):
    y = random_state(rng, system)
    rate = system.audited_rates(y)[-2]
    by_differences = along(lambda y: total_energy(system, y), y, system.rates(y))
    assert relative_error(rate, by_differences) < 1e-9
    V, Omega = read(system, y).V, y[3:6]
    closed = -V @ gain(system, "L_t") @ V - Omega @ gain(system, "L_r") @ Omega
    assert rate == pytest.approx(closed, rel=1e-12)


def test_eq_29_rate_is_zero_at_rest_only(rng, system):
    y = random_state(rng, system)
    still = np.concatenate([y[0:3], np.zeros(3), y[6:9], np.zeros(3)])
    assert system.audited_rates(still)[-2] == 0
    assert system.audited_rates(y)[-2] < 0


def test_eq_30_lyapunov_function_is_a_quadratic_form_about_the_rest_state(rng, system):
    y = random_state(rng, system)
    reading, K_t, G = read(system, y), gain(system, "K_t"), gain(system, "weight")
    K_a = sqrtm(K_t).real
    stretch = K_a @ reading.X - np.linalg.solve(K_a, G)
    turn = 0.5 * reading.Theta @ gain(system, "K_r") @ reading.Theta
    expected = 0.5 * stretch @ stretch + turn + kinetic_energy(system.body, reading)
    assert lyapunov_value(system, y) == pytest.approx(expected, rel=1e-12)


def test_eq_30_constant_h_is_the_energy_that_gravity_releases(system):
    K_t, G = gain(system, "K_t"), gain(system, "weight")
    rest = nearest_rest_state(system)
    assert rest.found
    assert rest.energy == pytest.approx(-0.5 * G @ np.linalg.solve(K_t, G), rel=1e-12)
    assert relative_error(rest.motion.X, np.linalg.solve(K_t, G)) < 1e-10
    np.testing.assert_allclose(rest.motion.Theta, 0, atol=1e-10)


def test_eq_30_lyapunov_function_is_zero_at_rest_and_positive_elsewhere(rng, system):
    rest = nearest_rest_state(system)
    at_rest = system.start(rest.motion, rest.own)
    assert abs(lyapunov_value(system, at_rest)) < 1e-12 * abs(rest.energy)
    assert lyapunov_value(system, random_state(rng, system)) > 0
