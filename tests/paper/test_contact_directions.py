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


def test_eq_11_and_12_held_contact_point_has_neither_displacement_nor_velocity(rng):
    body, anchor = random_body(rng), rng.normal(size=3)
    path = held_path(rng, body, anchor)
    for t in (-0.3, 0.0, 0.4):
        motion = motion_from_centre(body, anchor, path.Z(t))
        np.testing.assert_allclose(motion.E, 0, atol=1e-15)
        # The velocities of the path are differences with an error of 1e-12 of V.
        np.testing.assert_allclose(motion.F, 0, atol=1e-12 * np.abs(motion.V).max())


def test_eq_13_and_14_acceleration_of_the_contact_point(rng):
    path = random_path(rng, random_body(rng))
    motion, rates = motion_on(path, rng), path.Z_rates()
    centripetal = centripetal_acceleration(path.body, motion)
    carried = rates[9:12] - motion.A @ path.body.contact_cross @ rates[3:6]
    along_c = contact_directions(path.body, motion).T @ rates
    expected = second_derivative(path.contact)
    for moved in (carried, along_c):
        assert relative_error(moved + centripetal, expected) < 1e-10
        assert relative_error(moved - centripetal, expected) > 1e-2
