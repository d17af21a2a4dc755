"""Rotation of the body about its held contact point, with six states (section 3.2).

`motion.motion_from_contact` with E = F = 0 gives X and V from these states (eq. 32).
"""

from rbstab.mechanics.algebra import cross
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array


def angular_acceleration(body: Body, motion: Motion, force: Array, couple: Array) -> Array:
    """Return Ω̇ from (J - mŘ²)Ω̇ = f(Ω) + N - ŘA'(G + H) - mŘΩ̌²R (eq. 21, and 35 corrected).

    The last term equals the paper's mŘ(ŘΩ)ˇΩ, because (R × Ω) × Ω = Ω × (Ω × R).

    Args:
        body: The body.
        motion: A motion on the submanifold.
        force: G + H, shape (3,), N, inertial.
        couple: N, shape (3,), N m, body.

    Returns:
        Ω̇, shape (3,), rad/s², body.
    """
    Omega, R = motion.Omega, body.contact_point
    centripetal = body.mass * cross(Omega, cross(Omega, R))
    moment = body.gyroscopic_couple(Omega) + couple
    moment = moment - body.contact_cross @ (motion.A.T @ force + centripetal)
    return body.inertia_about_contact_inverse @ moment


def holding_force(body: Body, motion: Motion, force: Array, Omega_rate: Array) -> Array:
    """Return Λ = -(G + H) - mA(ŘΩ)ˇΩ + mAŘΩ̇ = mV̇ - G - H (eq. 20).

    Args:
        body: The body.
        motion: A motion on the submanifold.
        force: G + H, shape (3,), N, inertial.
        Omega_rate: Ω̇ of `angular_acceleration`, shape (3,), rad/s², body.

    Returns:
        Λ, shape (3,), N, inertial, on the body at C.
    """
    Omega, lever = motion.Omega, body.contact_cross
    acceleration = motion.A @ (lever @ Omega_rate - cross(lever @ Omega, Omega))
    return body.mass * acceleration - force
