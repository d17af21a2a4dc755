"""The coordinates Z (about the centre of gravity) and W (about the contact point), eq. 4 to 8."""

import numpy as np

from rbstab.mechanics import attitude
from rbstab.mechanics.algebra import IDENTITY, ZERO_MATRIX, cross_matrix
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array


def centre_state(motion: Motion) -> Array:
    """Z' = [Θ', Ω', X', V'] of a motion, shape (12,)."""
    return np.concatenate([motion.Theta, motion.Omega, motion.X, motion.V])


def contact_state(motion: Motion) -> Array:
    """W' = [Θ', Ω', E', F'] of a motion, shape (12,) (eq. 4, 38)."""
    return np.concatenate([motion.Theta, motion.Omega, motion.E, motion.F])


def jacobian_of_contact_state(body: Body, motion: Motion) -> Array:
    """∂W/∂Z at a motion, shape (12, 12) (eq. 7)."""
    turning, spinning, lever = _blocks(body, motion)
    return _unit_lower(-turning, spinning, -lever)


def jacobian_of_centre_state(body: Body, motion: Motion) -> Array:
    """∂Z/∂W at a motion, shape (12, 12) (eq. 6), the inverse of `jacobian_of_contact_state`."""
    turning, spinning, lever = _blocks(body, motion)
    return _unit_lower(turning, -spinning, lever)


def _blocks(body: Body, motion: Motion) -> tuple[Array, Array, Array]:
    """AŘB⁻¹, A(ŘΩ)ˇB⁻¹ and AŘ: how AR turns with Θ, and AŘΩ with Θ and with Ω (eq. 6, 7)."""
    A, B_inverse = motion.A, attitude.rate_matrix_inverse(motion.Theta)
    lever = A @ body.contact_cross
    spin = cross_matrix(body.contact_cross @ motion.Omega)
    return lever @ B_inverse, A @ spin @ B_inverse, lever


def _unit_lower(position: Array, velocity: Array, velocity_by_spin: Array) -> Array:
    zero, one = ZERO_MATRIX, IDENTITY
    return np.vstack(
        [
            np.hstack([one, zero, zero, zero]),
            np.hstack([zero, one, zero, zero]),
            np.hstack([position, zero, one, zero]),
            np.hstack([velocity, velocity_by_spin, zero, one]),
        ]
    )
