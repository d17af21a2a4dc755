"""The angle θ2 alone: its rate, its acceleration, and the couple that acts on it."""

from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import PITCH


def direction(motion: Motion) -> Array:
    """Return b = [sin θ3, cos θ3, 0], the second row of B: θ̇2 = b'Ω.

    A couple τb, in body coordinates, has the power τ θ̇2. So it is the generalized force τ on θ2,
    and none on θ1 and θ3.
    """
    row: Array = motion.B[PITCH]
    return row


def rate(motion: Motion) -> Number:
    """Return θ̇2 = b'Ω, rad/s."""
    return direction(motion) @ motion.Omega


def acceleration(motion: Motion, Omega_rate: Array) -> Number:
    """Return θ̈2 = b'Ω̇ + θ̇3 (Ω1 cos θ3 - Ω2 sin θ3), rad/s².

    Args:
        motion: The motion.
        Omega_rate: Ω̇, shape (3,), rad/s², body.
    """
    sin3, cos3, _ = direction(motion)
    theta3_rate = motion.B[2] @ motion.Omega
    turning = motion.Omega[0] * cos3 - motion.Omega[1] * sin3
    return direction(motion) @ Omega_rate + theta3_rate * turning
