"""The motion of the body at one instant, and the equations of motion of the free body."""

from typing import NamedTuple

import numpy as np

from rbstab.mechanics import attitude, contact
from rbstab.mechanics.algebra import IDENTITY, ZERO, ZERO_MATRIX, cross
from rbstab.mechanics.body import Body
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import E_OF_W, F_OF_W, OMEGA, THETA, V_OF_Z, X_OF_Z


class Motion(NamedTuple):
    """All quantities that forces may depend on: vectors of shape (3,), matrices of shape (3, 3).

    Theta (rad) and Omega (rad/s, body) describe the rotation of the body. X (m) and V (m/s) are the
    position and velocity of its centre of gravity, inertial. A and B are computed from Theta. E (m)
    and F (m/s) are the contact point's displacement from its anchor and its velocity, inertial.
    time (s) is the time of the run; only signals depend on it. While a quaternion is integrated,
    Theta is its vector part r, and B its rate matrix; no element may read them then.
    """

    Theta: Array
    Omega: Array
    X: Array
    V: Array
    A: Array
    B: Array
    E: Array
    F: Array
    time: Number = 0.0


class Wrench(NamedTuple):
    """All forces on the body except the constraint force, each of shape (3,).

    force (N, inertial) acts at the centre of gravity. couple (N m) is in body coordinates.
    contact_force (N, inertial) acts on the body at the contact point C.
    """

    force: Array
    couple: Array
    contact_force: Array


Turned = tuple[Array, Array]
"""A and B, shape (3, 3) each, of a body whose attitude is not given by Θ."""


def motion_from_centre(body: Body, anchor: Array, Z: Array, turned: Turned | None = None) -> Motion:
    """Return the motion at the state Z' = [Θ', Ω', X', V'], shape (12,), by eq. 2 and 4.

    Args:
        body: The body.
        anchor: X_a, shape (3,), m, inertial.
        Z: The state.
        turned: A and B of an attitude that Θ does not give; None: from Θ.
    """
    Theta, Omega, X, V = Z[THETA], Z[OMEGA], Z[X_OF_Z], Z[V_OF_Z]
    A, B = turned or _turned(Theta)
    return Motion(
        Theta,
        Omega,
        X,
        V,
        A,
        B,
        contact.displacement(body, A, X, anchor),
        contact.velocity(body, A, Omega, V),
    )


def motion_from_contact(
    body: Body, anchor: Array, W: Array, turned: Turned | None = None
) -> Motion:
    """Return the motion at the state W' = [Θ', Ω', E', F'], shape (12,), by eq. 2 and 4.

    Eq. 4 is solved for X and V. With E = F = 0 this is the body held at its contact point:
    X = -AR + R + X_a and V = AŘΩ (eq. 32).

    Args:
        body: The body.
        anchor: X_a, shape (3,), m, inertial.
        W: The state.
        turned: A and B of an attitude that Θ does not give; None: from Θ.
    """
    Theta, Omega, E, F = W[THETA], W[OMEGA], W[E_OF_W], W[F_OF_W]
    A, B = turned or _turned(Theta)
    return Motion(
        Theta,
        Omega,
        contact.centre_position(body, A, E, anchor),
        contact.centre_velocity(body, A, Omega, F),
        A,
        B,
        E,
        F,
    )


def _turned(Theta: Array) -> Turned:
    """Return A and B of Euler angles (eq. 2 and 1)."""
    return attitude.rotation(Theta), attitude.rate_matrix(Theta)


def motion_on_anchor(body: Body, anchor: Array, Theta: Array, Omega: Array, V: Array) -> Motion:
    """Return the motion with the contact point on its anchor, E = 0: X = -AR + R + X_a (eq. 32).

    V is any velocity of the centre of gravity, so the contact point may move: F = V - AŘΩ (eq. 4).
    E is exactly zero. Eq. 4 would leave the round-off of X in it, and a sliding connector acts on
    the sign of E.

    Args:
        body: The body.
        anchor: X_a, shape (3,), m, inertial.
        Theta: Θ, shape (3,), rad.
        Omega: Ω, shape (3,), rad/s, body.
        V: Velocity of the centre of gravity, shape (3,), m/s, inertial.
    """
    X = contact.centre_position(body, attitude.rotation(Theta), ZERO, anchor)
    Z = np.concatenate([Theta, Omega, X, V])
    return motion_from_centre(body, anchor, Z)._replace(E=ZERO.copy())


def applied_forces(body: Body, motion: Motion, force: Array, couple: Array) -> Array:
    """Return 𝓔 = [BΩ, f(Ω) + N, V, G + H] of eq. 9, shape (12,).

    The blocks are in the order of Z; the paper prints them in another order.

    Args:
        body: The body, for f.
        motion: The motion.
        force: G + H, shape (3,), N, inertial, at the centre of gravity.
        couple: N, shape (3,), N m, body.
    """
    return np.concatenate(
        [
            motion.B @ motion.Omega,
            body.gyroscopic_couple(motion.Omega) + couple,
            motion.V,
            force,
        ]
    )


def contact_directions(body: Body, motion: Motion) -> Array:
    """Return c of eq. 10, shape (12, 3): c' = [0, -AŘ, 0, I], so that c'Ż = Ḟ - AΩ̌²R.

    cΛ is the effect of Λ. Its second block ŘA'Λ is the moment R × A'Λ in body coordinates (eq. 1).
    """
    lever = body.contact_cross @ motion.A.T
    return np.concatenate([ZERO_MATRIX, lever, ZERO_MATRIX, IDENTITY])


def free_rates(body: Body, motion: Motion, wrench: Wrench) -> Array:
    """Return Ż = 𝒥⁻¹(𝓔 + cΛ), shape (12,): eq. 1, 3 and 9.

    Args:
        body: The body.
        motion: The motion.
        wrench: G + H, N and Λ.
    """
    # cΛ = [0, R × A'Λ, 0, Λ]: the cross product needs half as many operations as the matrix ŘA'.
    moment = cross(body.contact_point, motion.A.T @ wrench.contact_force)
    force = wrench.force + wrench.contact_force
    return body.mass_matrix_inverse @ applied_forces(body, motion, force, wrench.couple + moment)
