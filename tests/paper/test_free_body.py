"""Eq. 1, 3 and 9: the equations of motion follow from Newton's law for each particle."""

import numpy as np
import pytest
from scipy.linalg import block_diag
from support.differences import relative_error
from support.path import random_path
from support.systems import random_body

from rbstab.mechanics.motion import (
    Wrench,
    applied_forces,
    contact_directions,
    free_rates,
    motion_from_centre,
)


def wrench_along(path, rng):
    """Return forces that move the body along a path: a random Λ at C, the rest at the centre."""
    Lambda_ = rng.normal(size=3) * 100
    at_contact = np.cross(path.contact(0.0) - path.X(0.0), Lambda_)
    moment = path.moment_about(path.X(0.0)) - at_contact
    return Wrench(path.force() - Lambda_, path.A(0.0).T @ moment, Lambda_)


@pytest.fixture
def carried(rng):
    """Return a path, the motion on it, and the forces that move the body along it."""
    path = random_path(rng, random_body(rng))
    motion = motion_from_centre(path.body, rng.normal(size=3), path.Z())
    return path, motion, wrench_along(path, rng)


def test_eq_01_accelerations_are_those_of_the_path(carried):
    path, motion, wrench = carried
    rates = free_rates(path.body, motion, wrench)
    for actual, expected in zip(np.split(rates, 4), np.split(path.Z_rates(), 4), strict=True):
        # Ω̇ is a second difference with an error of 1e-11, times the condition number of J.
        assert relative_error(actual, expected) < 1e-9


def test_eq_03_and_09_applied_and_contact_forces_give_the_rates_of_the_path(carried):
    path, motion, wrench = carried
    forces = applied_forces(path.body, motion, wrench.force, wrench.couple)
    forces = forces + contact_directions(path.body, motion) @ wrench.contact_force
    # Eq. 3: the mass matrix has the blocks I, J, I, M.
    mass_matrix = block_diag(np.eye(3), path.body.inertia, np.eye(3), path.body.mass * np.eye(3))
    assert relative_error(forces, mass_matrix @ path.Z_rates()) < 1e-10
    assert relative_error(path.body.mass_matrix_inverse @ mass_matrix, np.eye(12)) < 1e-14


def test_eq_09_printed_order_of_blocks_is_not_that_of_Z(carried):
    path, motion, wrench = carried
    turning, spinning, moving, pushing = np.split(
        applied_forces(path.body, motion, wrench.force, wrench.couple), 4
    )
    printed = np.concatenate([moving, pushing, turning, spinning])
    forces = printed + contact_directions(path.body, motion) @ wrench.contact_force
    rates = path.body.mass_matrix_inverse @ forces
    assert relative_error(rates, path.Z_rates()) > 1e-2
