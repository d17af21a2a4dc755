"""Points of the body: their places and velocities along a path, and the work of a force there."""

import numpy as np
from support.differences import derivative, relative_error
from support.path import random_path
from support.systems import random_body, random_Z

from rbstab.mechanics import point
from rbstab.mechanics.motion import motion_from_centre


def test_position_and_velocity_along_a_path(rng):
    path, p = random_path(rng, random_body(rng)), rng.normal(size=3)

    def place(t):
        return path.X(t) + path.A(t) @ p

    motion = motion_from_centre(path.body, rng.normal(size=3), path.Z())
    assert relative_error(point.position(motion, p), place(0.0)) < 1e-14
    assert relative_error(point.velocity(motion, p), derivative(place)) < 1e-10


def test_force_has_the_power_of_its_point_and_no_other(rng):
    motion = motion_from_centre(random_body(rng), rng.normal(size=3), random_Z(rng))
    for _ in range(5):
        p, f = rng.normal(size=(2, 3))
        wrench = point.force_at(motion, p, f)
        power = wrench.force @ motion.V + wrench.couple @ motion.Omega
        np.testing.assert_allclose(power, f @ point.velocity(motion, p), rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(wrench.contact_force, 0)
        # The moment about the centre of gravity, turned into body coordinates.
        arm = motion.A @ p
        np.testing.assert_allclose(motion.A @ wrench.couple, np.cross(arm, f), atol=1e-13)
