"""Points of the body and θ2: their rates along a path, and the work of a force and of a couple."""

import numpy as np
from scipy.spatial.transform import Rotation
from support.differences import derivative, relative_error, second_derivative
from support.path import random_path
from support.systems import random_body, random_Z

from rbstab.mechanics import pitch, point
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


def path(rng):
    """Return the motion at t = 0, Ω̇ there, and θ2 as a function of time, of a turning body."""
    Z = random_Z(rng)
    Z[1] = rng.uniform(-1, 1)
    Omega_rate = rng.normal(size=3) * 2.0
    first = Rotation.from_euler("XYZ", Z[:3])
    # The rotation vector φ of the body since t = 0 has φ̇ = Ω and φ̈ = Ω̇ there, up to t³.
    turn = [Z[3:6], Omega_rate]

    def theta2(t):
        turned = first * Rotation.from_rotvec(turn[0] * t + turn[1] * t**2 / 2)
        return turned.as_euler("XYZ")[1]

    return motion_from_centre(random_body(rng), np.zeros(3), Z), Omega_rate, theta2


def test_rate_is_the_derivative_of_the_angle(rng):
    for _ in range(5):
        motion, _, theta2 = path(rng)
        assert abs(pitch.rate(motion) - derivative(theta2, 1e-3)) < 1e-10


def test_acceleration_is_the_second_derivative_of_the_angle(rng):
    for _ in range(5):
        motion, Omega_rate, theta2 = path(rng)
        acceleration = pitch.acceleration(motion, Omega_rate)
        assert abs(acceleration - second_derivative(theta2, 3e-3)) < 1e-8 * (1 + abs(acceleration))
        # The part without Ω̇ is not negligible.
        assert abs(acceleration - pitch.direction(motion) @ Omega_rate) > 1e-3


def test_a_couple_along_the_direction_works_on_this_angle_alone(rng):
    """Its generalized forces are B⁻ᵀN, because N'Ω = (B⁻ᵀN)'Θ̇."""
    motion, _, _ = path(rng)
    forces = np.linalg.inv(motion.B).T @ (3.0 * pitch.direction(motion))
    np.testing.assert_allclose(forces, [0.0, 3.0, 0.0], atol=1e-12)
