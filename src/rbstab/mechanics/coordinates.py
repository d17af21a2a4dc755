"""The coordinates Z (about the centre of gravity) and W (about the contact point), eq. 4 to 8."""

import numpy as np

from rbstab.mechanics import attitude
from rbstab.mechanics.algebra import IDENTITY, ZERO_MATRIX, cross_matrix
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array


def centre_state(motion: Motion) -> Array:
    """Return Z' = [Θ', Ω', X', V'] of a motion, shape (12,)."""
    return np.concatenate([motion.Theta, motion.Omega, motion.X, motion.V])


def contact_state(motion: Motion) -> Array:
    """Return W' = [Θ', Ω', E', F'] of a motion, shape (12,) (eq. 4, 38)."""
    return np.concatenate([motion.Theta, motion.Omega, motion.E, motion.F])


def jacobian_of_contact_state(body: Body, motion: Motion) -> Array:
    """Return ∂W/∂Z at a motion, shape (12, 12) (eq. 7)."""
    E_block, F_block, spin_block = _blocks(body, motion)
    return _unit_lower(-E_block, F_block, -spin_block)


def jacobian_of_centre_state(body: Body, motion: Motion) -> Array:
    """Return ∂Z/∂W at a motion, shape (12, 12) (eq. 6); inverse of `jacobian_of_contact_state`."""
    E_block, F_block, spin_block = _blocks(body, motion)
    return _unit_lower(E_block, -F_block, spin_block)


def _blocks(body: Body, motion: Motion) -> tuple[Array, Array, Array]:
    """Return AŘB⁻¹, A(ŘΩ)ˇB⁻¹ and AŘ, the blocks of eq. 6 and 7.

    They come from ∂(AR)/∂Θ = -AŘB⁻¹, ∂(AŘΩ)/∂Θ = -A(ŘΩ)ˇB⁻¹ and ∂(AŘΩ)/∂Ω = AŘ.
    """
    A, B_inverse = motion.A, attitude.rate_matrix_inverse(motion.Theta)
    lever = A @ body.contact_cross
    spin = cross_matrix(body.contact_cross @ motion.Omega)
    return lever @ B_inverse, A @ spin @ B_inverse, lever


def _unit_lower(position: Array, velocity: Array, velocity_by_spin: Array) -> Array:
    """Return the lower triangular matrix with these blocks and identities on the diagonal."""
    zero, one = ZERO_MATRIX, IDENTITY
    return np.vstack(
        [
            np.hstack([one, zero, zero, zero]),
            np.hstack([zero, one, zero, zero]),
            np.hstack([position, zero, one, zero]),
            np.hstack([velocity, velocity_by_spin, zero, one]),
        ]
    )
