"""Eq. 4, 6, 7, 8 and 38: the contact point, and the coordinates W that belong to it."""

import numpy as np
import pytest
from support.differences import along, derivative, jacobian, relative_error
from support.path import random_path
from support.reading import read
from support.systems import VARIANTS, random_body, random_state, random_system, random_Z

from rbstab.mechanics.coordinates import (
    centre_state,
    contact_state,
    jacobian_of_centre_state,
    jacobian_of_contact_state,
)
from rbstab.mechanics.motion import motion_from_centre, motion_from_contact
from rbstab.systems.coordinates import ContactCoordinates

TIED = [variant for variant in VARIANTS if variant != "permanent"]


def moved_by_both(body, anchor, Z):
    """Return the motion of a state by Z and by W."""
    motion = motion_from_centre(body, anchor, Z)
    return motion, motion_from_contact(body, anchor, contact_state(motion))


def test_eq_04_E_is_where_C_is_from_where_it_belongs_and_F_its_velocity(rng):
    path, anchor = random_path(rng, random_body(rng)), rng.normal(size=3)
    motion = motion_from_centre(path.body, anchor, path.Z())
    home = path.body.contact_point + anchor
    assert relative_error(motion.E, path.contact(0.0) - home) < 1e-14
    assert relative_error(motion.F, derivative(path.contact)) < 1e-12


def test_eq_04_state_is_kept_through_W_and_back(rng):
    body, anchor, Z = random_body(rng), rng.normal(size=3), random_Z(rng)
    _, back = moved_by_both(body, anchor, Z)
    assert relative_error(centre_state(back), Z) < 1e-15


def test_eq_06_jacobian_of_centre_state(rng):
    body, anchor, W = random_body(rng), rng.normal(size=3), random_Z(rng)
    motion = motion_from_contact(body, anchor, W)
    expected = jacobian(lambda W: centre_state(motion_from_contact(body, anchor, W)), W)
    assert relative_error(jacobian_of_centre_state(body, motion), expected) < 1e-12


def test_eq_07_jacobian_of_contact_state(rng):
    body, anchor, Z = random_body(rng), rng.normal(size=3), random_Z(rng)
    motion = motion_from_centre(body, anchor, Z)
    expected = jacobian(lambda Z: contact_state(motion_from_centre(body, anchor, Z)), Z)
    assert relative_error(jacobian_of_contact_state(body, motion), expected) < 1e-12


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
