"""Eq. 4, 6 to 8, 10 to 14, 26, 28 and 38: the contact point, its coordinates W, and its work."""

import numpy as np
import pytest
from support.differences import along, derivative, jacobian, relative_error, second_derivative
from support.path import held_path, random_path
from support.pose import turned
from support.reading import gain, kinetic_energy, read, total_energy
from support.systems import VARIANTS, random_body, random_state, random_system, random_Z

from rbstab.mechanics.algebra import cross_matrix
from rbstab.mechanics.constraint import centripetal_acceleration
from rbstab.mechanics.motion import contact_directions, motion_from_centre, motion_from_contact
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ManifoldCoordinates,
)
from rbstab.systems.system import System

TIED = [variant for variant in VARIANTS if variant != "permanent"]


Z_of, W_of = CentreCoordinates().from_motion, ContactCoordinates().from_motion


def test_eq_04_E_is_where_C_is_from_where_it_belongs_and_F_its_velocity(rng):
    path, anchor = random_path(rng, random_body(rng)), rng.normal(size=3)
    motion = motion_from_centre(path.body, anchor, path.Z())
    home = path.body.contact_point + anchor
    assert relative_error(motion.E, path.contact(0.0) - home) < 1e-14
    assert relative_error(motion.F, derivative(path.contact)) < 1e-12


def test_eq_04_state_is_kept_through_W_and_back(rng):
    body, anchor, Z = random_body(rng), rng.normal(size=3), random_Z(rng)
    back = motion_from_contact(body, anchor, W_of(motion_from_centre(body, anchor, Z)))
    assert relative_error(Z_of(back), Z) < 1e-15


def printed_jacobian(body, motion, sign):
    """Return ∂Z/∂W of eq. 6, or with the sign -1 ∂W/∂Z of eq. 7, as the paper prints them."""
    R, B_inverse = body.contact_cross, np.linalg.inv(motion.B)
    spin = motion.A @ cross_matrix(R @ motion.Omega)
    printed = np.eye(12)
    printed[6:9, :3] = sign * motion.A @ R @ B_inverse
    printed[9:, :3] = -sign * spin @ B_inverse
    printed[9:, 3:6] = sign * motion.A @ R
    return printed


def test_eq_06_and_07_the_printed_jacobians_are_those_of_both_coordinates(rng):
    body, anchor, y = random_body(rng), rng.normal(size=3), random_Z(rng)
    for sign, at, to in ((1, motion_from_contact, Z_of), (-1, motion_from_centre, W_of)):
        expected = jacobian(lambda y, at=at, to=to: to(at(body, anchor, y)), y)
        printed = printed_jacobian(body, at(body, anchor, y), sign)
        assert relative_error(printed, expected) < 1e-12


@pytest.mark.parametrize("variant", TIED)
def test_eq_08_rates_of_W_are_those_of_Z_seen_from_C(rng, variant):
    system = random_system(rng, variant)
    y = random_state(rng, system)

    def W(y):
        reading = read(system, y)
        return np.concatenate([reading.Theta, reading.Omega, reading.E, reading.F, reading.D])

    about_contact = type(system)(system.body, system.elements, ContactCoordinates(), system.anchor)
    expected = along(W, y, system.rates(y))
    actual = about_contact.rates(W(y))
    for block in range(0, len(y), 3):
        at = slice(block, block + 3)
        # `read` finds F by differences, whose error grows with the rate of the fastest state.
        assert np.abs(actual[at] - expected[at]).max() < 1e-11 * np.abs(expected).max()


def test_eq_38_loaded_position_is_the_anchor(rng):
    body, X_e = random_body(rng), rng.normal(size=3)
    Z = np.concatenate([np.zeros(6), X_e, np.zeros(3)])
    np.testing.assert_allclose(motion_from_centre(body, X_e, Z).E, 0, atol=1e-15)


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


CONNECTED = ("visco-elastic", "embedded")


def without_connector(system):
    """Return the system without its connector, whose energy is then not counted."""
    return System(system.body, system.elements[:3], system.coordinates, system.anchor)


@pytest.mark.parametrize("variant", CONNECTED)
@pytest.mark.parametrize("coordinates", [None, ContactCoordinates()], ids=["Z", "W"])
def test_eq_26_power_of_the_contact_force_is_what_the_other_forces_leave(rng, variant, coordinates):
    system = random_system(rng, variant, coordinates)
    y = random_state(rng, system)
    reading, observed = read(system, y), system.observe(y)
    kinetic_rate = along(lambda y: kinetic_energy(system.body, read(system, y)), y, system.rates(y))
    others = sum(w.force @ reading.V + w.couple @ reading.Omega for w in observed.wrenches)
    power = system.audited_rates(y)[-1]
    assert relative_error(power, kinetic_rate - others, abs(others) + abs(power)) < 1e-9


@pytest.mark.parametrize("variant", CONNECTED)
def test_eq_28_energy_less_the_work_of_the_contact_force_only_falls_by_damping(rng, variant):
    system = random_system(rng, variant)
    y = random_state(rng, system)
    energy_rate = along(lambda y: total_energy(without_connector(system), y), y, system.rates(y))
    power = system.audited_rates(y)[-1]
    V, Omega = read(system, y).V, y[3:6]
    lost = V @ gain(system, "L_t") @ V + Omega @ gain(system, "L_r") @ Omega
    assert relative_error(energy_rate - power, -lost, abs(power) + lost) < 1e-9


def test_eq_28_holds_off_the_sub_manifold_as_well(rng):
    # The contact point moves, so the force of constraint does work.
    system = random_system(rng, "permanent", ManifoldCoordinates())
    y = random_state(rng, system)
    energy_rate = along(lambda y: total_energy(system, y), y, system.rates(y))
    lyapunov_rate, power = system.audited_rates(y)[-2:]
    scale = abs(power) + abs(lyapunov_rate)
    assert abs(power) > 1e-3 * scale
    assert relative_error(energy_rate - power, lyapunov_rate, scale) < 1e-10
