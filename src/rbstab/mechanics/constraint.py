"""The held contact point: constraint force, projection and motion on the submanifold.

The constraint is E = F = 0. Its derivative along the motion is the acceleration constraint
c'Ż + AΩ̌²R = 0 (eq. 13 and 14 with the sign corrected: the paper prints a minus).
"""

import numpy as np

from rbstab.mechanics.algebra import cross, inverse
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion, contact_directions, motion_from_centre
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, V_OF_Z


def centripetal_acceleration(body: Body, motion: Motion) -> Array:
    """Return AΩ̌²R, shape (3,), m/s², inertial: the part of Ḟ without Ω̇ and V̇ (eq. 13).

    Here Ω̌²R = Ω × (Ω × R).
    """
    Omega = motion.Omega
    return motion.A @ cross(Omega, cross(Omega, body.contact_point))


def mobility(body: Body, c: Array) -> Array:
    """Return W = c'𝒥⁻¹c = I/m - AŘJ⁻¹ŘA', shape (3, 3), 1/kg (the bracket of eq. 15).

    W Λ is the part of Ḟ that Λ causes. This W is not the state W of eq. 4.
    """
    return c.T @ body.mass_matrix_inverse @ c


def constraint_force(body: Body, c: Array, applied: Array, demand: Array) -> Array:
    """Return Λ = -[c'𝒥⁻¹c]⁻¹(c'𝒥⁻¹𝓔 + γ), the force on the body at C (eq. 15).

    With P = c[c'𝒥⁻¹c]⁻¹c'𝒥⁻¹ of eq. 16, cΛ = -P𝓔 - c[c'𝒥⁻¹c]⁻¹γ. So 𝒥⁻¹(𝓔 + cΛ) is Ż of eq. 17.

    Args:
        body: The body.
        c: c of eq. 10, shape (12, 3).
        applied: 𝓔 of eq. 9, shape (12,).
        demand: γ, shape (3,), m/s²: Λ makes c'Ż = -γ. Without drift control γ = AΩ̌²R (the paper
            prints the opposite sign). See `baumgarte_demand` for a γ that also damps drift.

    Returns:
        Λ, shape (3,), N, inertial.
    """
    return -inverse(mobility(body, c)) @ (c.T @ body.mass_matrix_inverse @ applied + demand)


def baumgarte_demand(body: Body, motion: Motion, rate: float | Array) -> Array:
    """Return γ = AΩ̌²R + 2αF + α²E.

    Then Ë + 2αĖ + α²E = 0, so drift decays with critical damping.

    Args:
        body: The body.
        motion: The motion.
        rate: α, 1/s.

    Returns:
        γ, shape (3,), m/s², inertial.

    Source: J. Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1-16.
    """
    drift = 2.0 * rate * motion.F + rate * rate * motion.E
    return centripetal_acceleration(body, motion) + drift


def projected_state(body: Body, anchor: Array, Z: Array) -> Array:
    """Return the state nearest to Z with E = 0 and F = 0, in the metric of kinetic energy.

    Two Newton steps along 𝒥⁻¹c make E zero; they converge quadratically. Then the projection
    𝒥Ż := (I - P)𝒥Ż of eq. 16 makes F zero.

    Args:
        body: The body.
        anchor: X_a, shape (3,), m.
        Z: The state [Θ, Ω, X, V], shape (12,), close to the submanifold.

    Returns:
        The projected state, shape (12,).
    """
    for _ in range(2):
        motion = motion_from_centre(body, anchor, Z)
        step = _shift(body, motion, motion.E)
        Z = np.concatenate(
            [motion.Theta - motion.B @ step[OMEGA], motion.Omega, motion.X - step[V_OF_Z], motion.V]
        )
    motion = motion_from_centre(body, anchor, Z)
    step = _shift(body, motion, motion.F)
    return np.concatenate(
        [motion.Theta, motion.Omega - step[OMEGA], motion.X, motion.V - step[V_OF_Z]]
    )


def _shift(body: Body, motion: Motion, residual: Array) -> Array:
    """Return 𝒥⁻¹c(c'𝒥⁻¹c)⁻¹ρ: the smallest shift of the state that moves C by ρ."""
    c = contact_directions(body, motion)
    return body.mass_matrix_inverse @ c @ inverse(mobility(body, c)) @ residual
