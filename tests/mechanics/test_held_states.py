"""Projection and Baumgarte's stabilization bring a state back to the submanifold."""

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation
from support.differences import along, relative_error
from support.path import held_path
from support.pose import attitude
from support.reading import read
from support.systems import random_body, random_state, random_system

from rbstab.mechanics.constraint import projected_state
from rbstab.mechanics.motion import contact_directions, motion_from_centre
from rbstab.systems.coordinates import ManifoldCoordinates


class Drifted:
    """A state off the submanifold by about a given distance, and its projection."""

    def __init__(self, rng, distance):
        self.body, self.anchor = random_body(rng), rng.normal(size=3)
        held = held_path(rng, self.body, self.anchor).Z()
        self.Z = held + distance * rng.normal(size=12)
        self.back = projected_state(self.body, self.anchor, self.Z)

    def motion(self, Z):
        return motion_from_centre(self.body, self.anchor, Z)

    def mass_matrix(self):
        """Return the mass matrix of [Ω, V]."""
        return block_diag(self.body.inertia, self.body.mass * np.eye(3))

    def directions(self, Z):
        """Return c of eq. 10 without its zero blocks."""
        c = contact_directions(self.body, self.motion(Z))
        return np.vstack([c[3:6], c[9:12]])


def velocities(Z):
    return np.concatenate([Z[3:6], Z[9:12]])


def test_projected_state_lies_on_the_sub_manifold(rng):
    drifted = Drifted(rng, 1e-3)
    motion = drifted.motion(drifted.back)
    # Each of the two steps squares the rest of E: 1e-3, 1e-6, 1e-12.
    assert np.abs(drifted.motion(drifted.Z).E).max() > 1e-4
    np.testing.assert_allclose(motion.E, 0, atol=1e-12)
    np.testing.assert_allclose(motion.F, 0, atol=1e-14 * np.abs(drifted.Z).max())


def test_projection_loses_as_little_kinetic_energy_as_any(rng):
    drifted = Drifted(rng, 0.1)
    placed = np.concatenate([drifted.back[0:3], drifted.Z[3:6], drifted.back[6:9], drifted.Z[9:12]])
    root = np.linalg.cholesky(drifted.mass_matrix()).T
    still_at_C = np.linalg.svd(drifted.directions(drifted.back).T)[2][3:].T
    # The nearest velocity with F = 0, by least squares.
    nearest = np.linalg.lstsq(root @ still_at_C, root @ velocities(placed), rcond=None)[0]
    assert relative_error(velocities(drifted.back), still_at_C @ nearest) < 1e-13


def test_projection_moves_the_body_by_the_least_shift(rng):
    drifted = Drifted(rng, 1e-6)
    turn = Rotation.from_matrix(attitude(drifted.Z[0:3]).T @ attitude(drifted.back[0:3]))
    shift = np.concatenate([turn.as_rotvec(), drifted.back[6:9] - drifted.Z[6:9]])
    root = np.linalg.cholesky(drifted.mass_matrix()).T
    to_contact = drifted.directions(drifted.Z).T @ np.linalg.inv(root)
    E = drifted.motion(drifted.Z).E
    least = np.linalg.solve(root, np.linalg.lstsq(to_contact, -E, rcond=None)[0])
    # The shift is least to first order; the error is of the order of the shift squared.
    assert relative_error(shift, least) < 1e-5


@pytest.mark.parametrize("rate", [0.0, 7.0])
def test_baumgarte_makes_drift_die_out_critically_damped(rng, rate):
    system = random_system(rng, "permanent", ManifoldCoordinates(rate))
    y = random_state(rng, system)
    drift = read(system, y)
    acceleration = along(lambda y: read(system, y).F, y, system.rates(y))
    expected = -2 * rate * drift.F - rate**2 * drift.E
    pace = np.abs(system.rates(y)).max()
    np.testing.assert_allclose(acceleration, expected, rtol=0, atol=1e-11 * pace)
    assert np.abs(drift.E).max() > 0.1
