"""Eq. 31 to 34 and 37: the projected controls of the held body, and its Lyapunov function."""

from dataclasses import replace

import numpy as np
import pytest
from support.differences import along, derivative, relative_error
from support.particles import inertia_about
from support.pose import attitude, turned
from support.reading import gain, read, total_energy
from support.systems import random_state, random_system

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.elements.gravity import Gravity
from rbstab.systems.coordinates import ManifoldCoordinates, ReducedCoordinates


@pytest.fixture
def system(rng):
    return random_system(rng, "permanent", ReducedCoordinates())


@pytest.fixture
def bias_free(system):
    """Return the paper's case: the anchor is where the free body would rest, X_a = X_e."""
    return replace(system, anchor=np.linalg.solve(gain(system, "K_t"), gain(system, "weight")))


def in_all_states(system, y):
    """Return the same held body with twelve states, and the same state."""
    reading = read(system, y)
    Z = np.concatenate([y[0:6], reading.X, reading.V])
    return replace(system, coordinates=ManifoldCoordinates()), Z


def velocity_of_centre(system, y):
    """Return the velocity of the centre, which is at -R from C."""
    A = attitude(y[0:3])
    return -derivative(lambda t: turned(A, y[3:6], t) @ system.body.contact_point)


def test_eq_31_energy_is_kinetic_translational_rotational_and_potential(rng, system):
    y = random_state(rng, system)
    assert system.observe(y).energy.sum() == pytest.approx(total_energy(system, y), rel=1e-11)
    assert system.parts == (
        "kinetic",
        "gravity",
        "translational stabilizer",
        "rotational stabilizer",
    )


def test_eq_32_centre_of_the_held_body(rng, system):
    y = random_state(rng, system)
    motion, R = system.motion(y), system.body.contact_point
    assert relative_error(motion.X + attitude(y[0:3]) @ R, R + system.anchor) < 1e-14
    assert relative_error(motion.V, velocity_of_centre(system, y)) < 1e-12


def test_eq_33_projected_controls(rng, system):
    y = random_state(rng, system)
    A, R = attitude(y[0:3]), system.body.contact_point
    observed = system.observe(y)
    wrenches = dict(zip(system.parts[1:], observed.wrenches, strict=True))
    X, V = R + system.anchor - A @ R, velocity_of_centre(system, y)
    H = -gain(system, "K_t") @ X - gain(system, "L_t") @ V
    assert relative_error(wrenches["translational stabilizer"].force, H) < 1e-12
    # N is checked by its power, because it does not depend on the constraint.
    N, K_r = wrenches["rotational stabilizer"].couple, gain(system, "K_r")
    Theta_rate = system.rates(y)[0:3]
    power = -Theta_rate @ K_r @ y[0:3] - y[3:6] @ gain(system, "L_r") @ y[3:6]
    assert N @ y[3:6] == pytest.approx(power, rel=1e-13)


def projected_lyapunov_function(system, y):
    A, R = attitude(y[0:3]), system.body.contact_point
    offset = R - A @ R
    return (
        0.5 * offset @ gain(system, "K_t") @ offset
        + 0.5 * y[3:6] @ inertia_about(system.body, R) @ y[3:6]
        + 0.5 * y[0:3] @ gain(system, "K_r") @ y[0:3]
    )


def test_eq_34_projected_lyapunov_function_without_gravity(rng, system):
    weightless = replace(
        system, anchor=np.zeros(3), elements=(Gravity(np.zeros(3)), *system.elements[1:])
    )
    y = random_state(rng, system)
    expected = projected_lyapunov_function(weightless, y)
    assert weightless.observe(y).energy.sum() == pytest.approx(expected, rel=1e-13)


def test_eq_34_projected_lyapunov_function_with_gravity_at_the_loaded_anchor(rng, bias_free):
    y = random_state(rng, bias_free)
    rest = nearest_rest_state(bias_free)
    value = bias_free.observe(y).energy.sum() - rest.energy
    assert value == pytest.approx(projected_lyapunov_function(bias_free, y), rel=1e-13)


def test_eq_34_is_zero_at_zero_and_positive_elsewhere(rng, bias_free):
    rest = nearest_rest_state(bias_free)
    assert rest.found
    np.testing.assert_array_equal(rest.motion.Theta, 0)
    zero, y = np.zeros(6), random_state(rng, bias_free)
    assert abs(bias_free.observe(zero).energy.sum() - rest.energy) < 1e-13 * abs(rest.energy)
    assert bias_free.observe(y).energy.sum() > rest.energy


@pytest.mark.parametrize("states", ["six", "twelve"])
def test_eq_37_rate_of_the_projected_lyapunov_function(rng, system, states):
    y = random_state(rng, system)
    V, Omega = velocity_of_centre(system, y), y[3:6]
    closed = -Omega @ gain(system, "L_r") @ Omega - V @ gain(system, "L_t") @ V
    if states == "twelve":
        system, y = in_all_states(system, y)
    rate = system.audited_rates(y)[-2]
    assert rate == pytest.approx(closed, rel=1e-12)
    by_differences = along(lambda y: total_energy(system, y), y, system.rates(y))
    assert relative_error(rate, by_differences) < 1e-9


def test_eq_37_second_term_as_printed(rng, system):
    # The paper prints a plus, and still it is a loss, because Ř' = -Ř.
    y = random_state(rng, system)
    A, R, Omega = attitude(y[0:3]), system.body.contact_point, y[3:6]
    lever = np.cross(R, np.eye(3)).T
    printed = Omega @ lever @ A.T @ gain(system, "L_t") @ A @ lever @ Omega
    rate = -Omega @ gain(system, "L_r") @ Omega + printed
    assert printed < 0
    assert system.audited_rates(y)[-2] == pytest.approx(rate, rel=1e-13)
