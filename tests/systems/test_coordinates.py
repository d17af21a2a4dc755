"""Each choice of coordinates stands for one motion, and gives its rates and contact force."""

import numpy as np
import pytest
from support.differences import relative_error
from support.path import held_path, random_path
from support.systems import random_body, random_system

from rbstab.mechanics.motion import Wrench, motion_from_centre
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)

FREE = (CentreCoordinates(), ContactCoordinates())
HELD = (ReducedCoordinates(), ManifoldCoordinates(), ManifoldCoordinates(5.0))


@pytest.mark.parametrize("coordinates", [*FREE, *HELD], ids=lambda c: c.name)
def test_coordinates_of_a_motion_stand_for_that_motion(rng, coordinates):
    body, anchor = random_body(rng), rng.normal(size=3)
    path = held_path(rng, body, anchor) if coordinates.holds_contact else random_path(rng, body)
    motion = motion_from_centre(body, anchor, path.Z())
    y = coordinates.from_motion(motion)
    again = coordinates.motion(body, anchor, y)
    assert y.shape == (coordinates.size,)
    for name in motion._fields:
        # On a held path F is zero up to 1e-12, the error of its differences.
        assert relative_error(getattr(again, name), getattr(motion, name), 10.0) < 1e-13


@pytest.mark.parametrize("coordinates", FREE, ids=lambda c: c.name)
def test_contact_force_of_a_free_body_is_what_the_elements_exert(rng, coordinates):
    system = random_system(rng, "free", coordinates)
    force, couple, contact_force = rng.normal(size=(3, 3))
    wrench = Wrench(force, couple, contact_force)
    motion = system.motion(rng.normal(size=12))
    _, Lambda_ = coordinates.dynamics(system.body, motion, wrench)
    np.testing.assert_array_equal(Lambda_, wrench.contact_force)
