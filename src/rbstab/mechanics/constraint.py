"""The contact point held fast: constraint force, projection and motion on the sub manifold.

The point is held by E = F = 0, whose derivative along the motion is the acceleration constraint
c'Ż + AΩ̌²R = 0 (eq. 13 and 14 with the sign corrected: the paper prints a minus).
"""

import numpy as np

from rbstab.mechanics.algebra import cross, inverse
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion, contact_directions, motion_from_centre
from rbstab.mechanics.numbers import Array


def centripetal_acceleration(body: Body, motion: Motion) -> Array:
    """AΩ̌²R, shape (3,), m/s², inertial: the part of Ḟ that is there without Ω̇ and V̇ (eq. 13).

    Here Ω̌²R = Ω × (Ω × R).
    """
    Omega = motion.Omega
    return motion.A @ cross(Omega, cross(Omega, body.contact_point))


def mobility(body: Body, c: Array) -> Array:
    """W = c'𝒥⁻¹c = I/m - AŘJ⁻¹ŘA', shape (3, 3), 1/kg: Ḟ per unit of Λ (the bracket of eq. 15)."""
    return c.T @ body.mass_matrix_inverse @ c


def constraint_force(body: Body, c: Array, applied: Array, demand: Array) -> Array:
    """Λ = -[c'𝒥⁻¹c]⁻¹(c'𝒥⁻¹𝓔 + γ), shape (3,), N, inertial, on the body at C (eq. 15).

    Args:
        body: The body.
        c: c of eq. 10, shape (12, 3).
        applied: 𝓔 of eq. 9, shape (12,).
        demand: γ, shape (3,), m/s²: Λ makes c'Ż = -γ. For the constraint itself γ = AΩ̌²R (the paper
            prints its sign reversed); Baumgarte's stabilization adds to it.
    """
    return -inverse(mobility(body, c)) @ (c.T @ body.mass_matrix_inverse @ applied + demand)


def partial_constraint_force(
    body: Body, c: Array, applied: Array, demand: Array, held: Array
) -> Array:
    """Λ on the held axes alone, by which these have c'Ż = -γ, shape (3,), N, inertial.

    With S the held axes, Λ_S = -(W_SS)⁻¹(c'𝒥⁻¹𝓔 + γ)_S, and 0 on the others; for all three axes
    this is eq. 15. The axes are picked by numbers, not by branches: M = diag(held), and
    Λ = -(MWM + I - M)⁻¹ M (c'𝒥⁻¹𝓔 + γ), whose matrix is W_SS beside an identity.

    Args:
        body: The body.
        c: c of eq. 10, shape (12, 3).
        applied: Everything else that acts, 𝓔 of eq. 9 plus c times the force on the axes that are
            not held, shape (12,).
        demand: γ, shape (3,), m/s².
        held: 1 for each held axis and 0 for each other, shape (3,).
    """
    picked = np.outer(held, held) * mobility(body, c) + np.diag(1.0 - held)
    return -(inverse(picked) @ (held * (c.T @ (body.mass_matrix_inverse @ applied) + demand)))


def projected(body: Body, c: Array, forces: Array) -> Array:
    """P x with P = c[c'𝒥⁻¹c]⁻¹c'𝒥⁻¹, where P² = P and Pc = c (eq. 16).

    Args:
        body: The body.
        c: c of eq. 10, shape (12, 3).
        forces: x, shape (12,); or (12, 12), where the identity gives P itself. P is never formed
            for a vector: that would cost a compiled engine a hundred times the operations.
    """
    return c @ (inverse(mobility(body, c)) @ (c.T @ (body.mass_matrix_inverse @ forces)))


def manifold_rates(body: Body, c: Array, applied: Array, demand: Array) -> Array:
    """Ż = 𝒥⁻¹[(I - P)𝓔 - c(c'𝒥⁻¹c)⁻¹γ], shape (12,): motion on the sub manifold (eq. 17).

    Arguments as in `constraint_force`; with its Λ this is 𝒥⁻¹(𝓔 + cΛ).
    """
    free_part = applied - projected(body, c, applied)
    return body.mass_matrix_inverse @ (free_part - c @ (inverse(mobility(body, c)) @ demand))


def baumgarte_demand(body: Body, motion: Motion, rate: float | Array) -> Array:
    """γ = AΩ̌²R + 2αF + α²E, so that Ë + 2αĖ + α²E = 0: drift dies out critically damped.

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
    """The state nearest to Z, in the metric of kinetic energy, with E = 0 and F = 0.

    Two Newton steps along 𝒥⁻¹c return the position (each squares what is left of E); then
    𝒥Ż := (I - P)𝒥Ż, the projection of eq. 16, takes F off the velocities.

    Args:
        body: The body.
        anchor: X_a, shape (3,), m.
        Z: The state [Θ, Ω, X, V], shape (12,), close to the sub manifold.

    Returns:
        The projected state, shape (12,).
    """
    for _ in range(2):
        motion = motion_from_centre(body, anchor, Z)
        step = _shift(body, motion, motion.E)
        Z = np.concatenate(
            [motion.Theta - motion.B @ step[3:6], motion.Omega, motion.X - step[9:12], motion.V]
        )
    motion = motion_from_centre(body, anchor, Z)
    step = _shift(body, motion, motion.F)
    return np.concatenate([motion.Theta, motion.Omega - step[3:6], motion.X, motion.V - step[9:12]])


def _shift(body: Body, motion: Motion, residual: Array) -> Array:
    """𝒥⁻¹c(c'𝒥⁻¹c)⁻¹ρ: the least shift of body and centre that moves C by ρ."""
    c = contact_directions(body, motion)
    return body.mass_matrix_inverse @ c @ inverse(mobility(body, c)) @ residual
