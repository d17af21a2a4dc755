"""Points of the body: where they are, how fast they move, and what a force at one of them does.

The products with p are written as cross products, not with the matrix p̌. Its entries -p_i are
expressions, and a compiled engine would expand their products as those of two variables.
"""

from rbstab.mechanics.algebra import ZERO, cross
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array


def position(motion: Motion, point: Array) -> Array:
    """Return X + A p, shape (3,), m, inertial.

    Args:
        motion: The motion of the body.
        point: p, shape (3,), m, body coordinates, from the centre of gravity.
    """
    return motion.X + motion.A @ point


def velocity(motion: Motion, point: Array) -> Array:
    """Return V + A (Ω × p), shape (3,), m/s, inertial: the derivative of X + A p."""
    return motion.V + motion.A @ cross(motion.Omega, point)


def acceleration(motion: Motion, point: Array, Omega_rate: Array, V_rate: Array) -> Array:
    """Return V̇ + A(Ω̇ × p + Ω × (Ω × p)), shape (3,), m/s², inertial.

    Args:
        motion: The motion of the body.
        point: p, shape (3,), m, body coordinates, from the centre of gravity.
        Omega_rate: Ω̇, shape (3,), rad/s², body.
        V_rate: V̇, shape (3,), m/s², inertial.
    """
    Omega = motion.Omega
    return V_rate + motion.A @ (cross(Omega_rate, point) + cross(Omega, cross(Omega, point)))


def force_at(motion: Motion, point: Array, force: Array) -> Wrench:
    """Return the wrench of a force at a point of the body.

    At the centre of gravity, it is the same force and the couple p × A'f in body coordinates.

    Args:
        motion: The motion of the body.
        point: p, shape (3,), m, body coordinates, from the centre of gravity.
        force: f, shape (3,), N, inertial.
    """
    return Wrench(force, cross(point, motion.A.T @ force), ZERO)
