"""Eq. 10 to 14: the constraint, its two derivatives and the directions c are right."""

import numpy as np
from support.differences import derivative, jacobian, relative_error, second_derivative
from support.path import held_path, random_path
from support.pose import turned
from support.systems import random_body, random_Z

from rbstab.mechanics.constraint import centripetal_acceleration
from rbstab.mechanics.motion import contact_directions, motion_from_centre


def motion_on(path, rng):
    return motion_from_centre(path.body, rng.normal(size=3), path.Z())


def test_eq_10_c_says_how_C_moves_with_each_quasi_velocity(rng):
    body = random_body(rng)
    motion = motion_from_centre(body, rng.normal(size=3), random_Z(rng))

    def velocity_of_C(quasi_velocities):
        Omega, V = quasi_velocities[3:6], quasi_velocities[9:12]
        return V + derivative(lambda t: turned(motion.A, Omega, t) @ body.contact_point, 1e-2)

    c = contact_directions(body, motion)
    assert relative_error(c.T, jacobian(velocity_of_C, np.zeros(12))) < 1e-11


def test_eq_10_c_gives_the_virtual_work_of_the_contact_force(rng):
    path = random_path(rng, random_body(rng))
    Lambda_, Z = rng.normal(size=3), path.Z()
    quasi_velocities = np.concatenate([np.zeros(3), Z[3:6], np.zeros(3), Z[9:12]])
    power = Lambda_ @ derivative(path.contact)
    c = contact_directions(path.body, motion_on(path, rng))
    assert relative_error(quasi_velocities @ c @ Lambda_, power) < 1e-12


def test_eq_11_held_contact_point_has_no_displacement(rng):
    body, anchor = random_body(rng), rng.normal(size=3)
    path = held_path(rng, body, anchor)
    for t in (-0.3, 0.0, 0.4):
        np.testing.assert_allclose(motion_from_centre(body, anchor, path.Z(t)).E, 0, atol=1e-15)


def test_eq_12_held_contact_point_has_no_velocity(rng):
    body, anchor = random_body(rng), rng.normal(size=3)
    Z = held_path(rng, body, anchor).Z()
    # The velocities of the path are differences with an error of 1e-12 of V.
    F = motion_from_centre(body, anchor, Z).F
    np.testing.assert_allclose(F, 0, atol=1e-12 * np.abs(Z[9:12]).max())


def test_eq_13_acceleration_of_the_contact_point(rng):
    path = random_path(rng, random_body(rng))
    motion, rates = motion_on(path, rng), path.Z_rates()
    centripetal = centripetal_acceleration(path.body, motion)
    carried = rates[9:12] - motion.A @ path.body.contact_cross @ rates[3:6]
    expected = second_derivative(path.contact)
    assert relative_error(carried + centripetal, expected) < 1e-10
    assert relative_error(carried - centripetal, expected) > 1e-2


def test_eq_13_held_contact_point_does_not_accelerate(rng):
    path = held_path(rng, random_body(rng), rng.normal(size=3))
    motion, rates = motion_on(path, rng), path.Z_rates()
    centripetal = centripetal_acceleration(path.body, motion)
    carried = rates[9:12] - motion.A @ path.body.contact_cross @ rates[3:6]
    scale = np.abs(centripetal).max()
    assert relative_error(carried, -centripetal, scale) < 1e-9
    assert relative_error(carried, centripetal, scale) > 1e-2


def test_eq_14_acceleration_of_the_contact_point_through_c(rng):
    path = random_path(rng, random_body(rng))
    motion = motion_on(path, rng)
    centripetal = centripetal_acceleration(path.body, motion)
    along_c = contact_directions(path.body, motion).T @ path.Z_rates()
    expected = second_derivative(path.contact)
    assert relative_error(along_c + centripetal, expected) < 1e-10
    assert relative_error(along_c - centripetal, expected) > 1e-2


def test_eq_13_acceleration_of_a_point_on_a_body_that_spins_about_a_fixed_centre(rng):
    # The acceleration points to the axis, with Ω² times the distance from it.
    body, Z = random_body(rng), random_Z(rng)
    motion = motion_from_centre(body, np.zeros(3), Z)
    speed = np.linalg.norm(motion.Omega)
    axis, arm = motion.A @ motion.Omega / speed, motion.A @ body.contact_point
    expected = -(speed**2) * (arm - (arm @ axis) * axis)
    assert relative_error(centripetal_acceleration(body, motion), expected) < 1e-13
