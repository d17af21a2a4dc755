"""Eq. 23, 24, 25 and 27: the forces of stabilizers and gravity match their energies."""

import numpy as np
import pytest
from support.differences import jacobian, relative_error
from support.elements import random_spd
from support.pose import angles, attitude, turned
from support.reading import kinetic_energy, read
from support.systems import random_body, random_system, random_Z

from rbstab.elements.element import NO_STATE
from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.mechanics.motion import motion_from_centre


@pytest.fixture
def body(rng):
    return random_body(rng)


def motion_at(body, Z):
    return motion_from_centre(body, np.zeros(3), Z)


def still(Z):
    return np.concatenate([Z[0:3], np.zeros(3), Z[6:9], np.zeros(3)])


def test_eq_23_spring_couple_is_the_slope_of_the_energy_in_every_turn(rng, body):
    K_r, L_r = random_spd(rng, 90), random_spd(rng, 12)
    Z = still(random_Z(rng))
    A = attitude(Z[0:3])

    def energy_after_turn(turn):
        Theta = angles(turned(A, turn, 1.0))
        return 0.5 * Theta @ K_r @ Theta

    wrench = RotationalStabilizer(K_r, L_r).wrench(motion_at(body, Z), NO_STATE)
    # The step stays well inside the range of θ2, where the angles change as 1/cos θ2.
    slope = jacobian(energy_after_turn, np.zeros(3), 5e-3)
    assert relative_error(wrench.couple, -slope) < 1e-11
    np.testing.assert_array_equal([wrench.force, wrench.contact_force], 0)


def test_eq_23_damping_couple_is_the_slope_of_half_the_power(rng, body):
    K_r, L_r = random_spd(rng, 90), random_spd(rng, 12)
    Z = random_Z(rng)
    stabilizer = RotationalStabilizer(K_r, L_r)
    moving = stabilizer.wrench(motion_at(body, Z), NO_STATE).couple
    at_rest = stabilizer.wrench(motion_at(body, still(Z)), NO_STATE).couple
    slope = jacobian(lambda Omega: 0.5 * Omega @ L_r @ Omega, Z[3:6])
    assert relative_error(moving - at_rest, -slope) < 1e-12


def test_eq_24_force_is_the_slope_of_the_energy_and_of_half_the_power(rng, body):
    K_t, L_t, Z = random_spd(rng, 900), random_spd(rng, 40), random_Z(rng)
    wrench = TranslationalStabilizer(K_t, L_t).wrench(motion_at(body, Z), NO_STATE)
    spring = jacobian(lambda X: 0.5 * X @ K_t @ X, Z[6:9])
    damping = jacobian(lambda V: 0.5 * V @ L_t @ V, Z[9:12])
    assert relative_error(wrench.force, -spring - damping) < 1e-12
    np.testing.assert_array_equal([wrench.couple, wrench.contact_force], 0)


def test_eq_25_kinetic_energy_is_that_of_the_particles(rng):
    system = random_system(rng, "free")
    y = random_Z(rng)
    motion = system.motion(y)
    expected = kinetic_energy(system.body, read(system, y))
    actual = system.body.kinetic_energy(motion.Omega, motion.V)
    assert actual == pytest.approx(expected, rel=1e-11)


def test_eq_01_weight_pulls_at_the_centre_and_nowhere_else(rng, body):
    weight = rng.normal(size=3)
    wrench = Gravity(weight).wrench(motion_at(body, random_Z(rng)), NO_STATE)
    np.testing.assert_array_equal(wrench.force, weight)
    np.testing.assert_array_equal([wrench.couple, wrench.contact_force], 0)
