"""Eq. 18 to 21, 35 and 36: the held body rotates about its contact point."""

import numpy as np
import pytest
from support.differences import along, derivative, relative_error
from support.particles import inertia_about
from support.path import held_path
from support.pose import attitude, turned
from support.reading import gain, read
from support.systems import random_body, random_state, random_system

from rbstab.mechanics.algebra import cross_matrix
from rbstab.mechanics.motion import motion_from_centre
from rbstab.mechanics.reduced import angular_acceleration, holding_force
from rbstab.systems.coordinates import ReducedCoordinates


@pytest.fixture
def held(rng):
    """Return a held system, a state of it, and its rates."""
    system = random_system(rng, "permanent", ReducedCoordinates())
    y = random_state(rng, system)
    return system, y, system.rates(y)


@pytest.fixture
def carried(rng):
    """Return a path about C, the motion on it, and a force and couple that cause it."""
    body, anchor = random_body(rng), rng.normal(size=3)
    path = held_path(rng, body, anchor)
    force = rng.normal(size=3) * 100
    moment = path.moment_about(path.contact(0.0))
    couple = path.A(0.0).T @ (moment - np.cross(path.X(0.0) - path.contact(0.0), force))
    return path, motion_from_centre(body, anchor, path.Z()), force, couple


def applied(system, y):
    """Return G + H, inertial, and N, body coordinates."""
    wrenches = system.observe(y).wrenches
    return sum(wrench.force for wrench in wrenches), sum(wrench.couple for wrench in wrenches)


def test_eq_18_contact_point_stays_where_it_is_held(held):
    system, y, rates = held
    motion = system.motion(y)
    np.testing.assert_array_equal([motion.E, motion.F], 0)

    def place(y):
        return system.motion(y).X + attitude(y[0:3]) @ system.body.contact_point

    def velocity(y):
        spun = derivative(lambda t: turned(attitude(y[:3]), y[3:6], t) @ system.body.contact_point)
        return system.motion(y).V + spun

    assert relative_error(place(y), system.body.contact_point + system.anchor) < 1e-14
    pace = np.abs(rates).max()
    np.testing.assert_allclose(along(place, y, rates), 0, atol=1e-12 * pace)
    np.testing.assert_allclose(along(velocity, y, rates), 0, atol=1e-11 * pace)


def test_eq_19_and_20_holding_force_is_what_the_centre_lacks(held):
    system, y, rates = held
    force, _ = applied(system, y)
    acceleration = along(lambda y: read(system, y).V, y, rates)
    expected = system.body.mass * acceleration - force
    assert relative_error(system.observe(y).contact_force, expected) < 1e-10


def test_eq_21_acceleration_and_holding_force_are_those_of_a_path(carried):
    path, motion, force, couple = carried
    Omega_rate = path.Z_rates()[3:6]
    actual = angular_acceleration(path.body, motion, force, couple)
    assert relative_error(actual, Omega_rate) < 1e-9
    holding = holding_force(path.body, motion, force, Omega_rate)
    assert relative_error(holding, path.force() - force) < 1e-10


def right_side_of_eq_35(path, force, couple, sign, to_body):
    """Return f + N + sign Řm Ω̌²R - Ř to_body (G + H)."""
    body, Omega = path.body, path.Omega(0.0)
    lever = cross_matrix(body.contact_point)
    spin = cross_matrix(Omega)
    gyroscopic = -spin @ body.inertia @ Omega
    centripetal = sign * body.mass * lever @ spin @ spin @ body.contact_point
    return gyroscopic + couple + centripetal - lever @ to_body @ force


def test_eq_35_holds_with_a_minus_and_A_transposed_not_as_printed(carried):
    path, motion, force, couple = carried
    A = path.A(0.0)
    left = inertia_about(path.body, path.body.contact_point) @ path.Z_rates()[3:6]
    corrected = right_side_of_eq_35(path, force, couple, -1, A.T)
    assert relative_error(corrected, left) < 1e-9
    for sign, to_body in ((1, A), (1, A.T), (-1, A)):
        wrong = right_side_of_eq_35(path, force, couple, sign, to_body)
        assert relative_error(wrong, left) > 1e-3
    actual = angular_acceleration(path.body, motion, force, couple)
    about_contact = inertia_about(path.body, path.body.contact_point)
    assert relative_error(actual, np.linalg.solve(about_contact, corrected)) < 1e-13


def test_eq_36_is_eulers_equations_in_principal_axes_at_the_contact_point(held):
    system, y, rates = held
    R = system.body.contact_point
    moments, axes = np.linalg.eigh(inertia_about(system.body, R))
    if np.linalg.det(axes) < 0:
        axes = -axes
    _, couple = applied(system, y)
    A = attitude(y[0:3])
    position, velocity = R - A @ R + system.anchor, A @ np.cross(R, y[3:6])
    force = gain(system, "weight") - gain(system, "K_t") @ position - gain(system, "L_t") @ velocity

    def spin_up(to_body):
        # j1 ω̇1 = (j2 - j3) ω2 ω3 + the first moment, and so on around.
        w1, w2, w3 = axes.T @ y[3:6]
        j1, j2, j3 = moments
        couples = np.array([(j2 - j3) * w2 * w3, (j3 - j1) * w3 * w1, (j1 - j2) * w1 * w2])
        moment = axes.T @ (couple - np.cross(R, to_body @ force))
        return axes @ ((couples + moment) / moments)

    assert relative_error(rates[3:6], spin_up(A.T)) < 1e-13
    assert relative_error(rates[3:6], spin_up(A)) > 1e-3
