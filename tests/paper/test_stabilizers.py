"""Eq. 23, 24, 25 and 27: the forces of stabilizers and gravity match their energies."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from support.differences import derivative, jacobian, relative_error
from support.elements import random_spd
from support.path import random_path
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


def integral(function, end=1.0):
    """Return ∫ from 0 to `end` by Gauss's rule of 20 points, exact to round-off here."""
    nodes, weights = leggauss(20)
    return (
        end / 2 * sum(w * function(end / 2 * (1 + s)) for s, w in zip(nodes, weights, strict=True))
    )


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


def test_eq_23_couple_does_not_depend_on_the_position(rng, body):
    stabilizer = RotationalStabilizer(random_spd(rng, 90), random_spd(rng, 12))
    here, there = random_Z(rng), random_Z(rng)
    there[0:6] = here[0:6]
    np.testing.assert_array_equal(
        stabilizer.wrench(motion_at(body, here), NO_STATE).couple,
        stabilizer.wrench(motion_at(body, there), NO_STATE).couple,
    )


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


def test_eq_25_translational_energy_is_the_work_against_the_spring(rng, body):
    stabilizer = TranslationalStabilizer(random_spd(rng, 900), random_spd(rng, 40))
    Z = still(random_Z(rng))

    def power(s):
        stretched = Z * np.repeat([1, 1, s, 1], 3)
        return -stabilizer.wrench(motion_at(body, stretched), NO_STATE).force @ Z[6:9]

    stored = stabilizer.stored(motion_at(body, Z), NO_STATE)
    assert stored == pytest.approx(integral(power), rel=1e-13)


def test_eq_25_rotational_energy_is_the_work_against_the_spring(rng, body):
    stabilizer = RotationalStabilizer(random_spd(rng, 90), random_spd(rng, 12))
    Z = still(random_Z(rng))

    def power(s):
        A = attitude(s * Z[0:3])
        spin = A.T @ derivative(lambda t: attitude((s + t) * Z[0:3]))
        Omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        turned_so_far = np.concatenate([s * Z[0:3], Z[3:12]])
        return -stabilizer.wrench(motion_at(body, turned_so_far), NO_STATE).couple @ Omega

    stored = stabilizer.stored(motion_at(body, Z), NO_STATE)
    assert stored == pytest.approx(integral(power), rel=1e-12)


def test_eq_27_potential_energy_is_minus_the_work_of_the_weight(rng, body):
    weight = rng.normal(size=3) * 100
    gravity, path = Gravity(weight), random_path(rng, body)
    change = gravity.stored(motion_at(body, path.Z(0.5)), NO_STATE) - gravity.stored(
        motion_at(body, path.Z(0.0)), NO_STATE
    )
    work = integral(lambda t: path.V(t) @ weight, 0.5)
    assert change == pytest.approx(-work, rel=1e-12)


def test_eq_27_potential_energy_is_zero_at_the_origin(rng, body):
    Z = random_Z(rng)
    Z[6:9] = 0
    assert Gravity(rng.normal(size=3)).stored(motion_at(body, Z), NO_STATE) == 0


def test_eq_01_weight_pulls_at_the_centre_and_nowhere_else(rng, body):
    weight = rng.normal(size=3)
    wrench = Gravity(weight).wrench(motion_at(body, random_Z(rng)), NO_STATE)
    np.testing.assert_array_equal(wrench.force, weight)
    np.testing.assert_array_equal([wrench.couple, wrench.contact_force], 0)
