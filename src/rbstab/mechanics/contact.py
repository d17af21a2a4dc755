"""The displacement and the velocity of the contact point C (eq. 4, 32, 38)."""

from rbstab.mechanics.algebra import cross
from rbstab.mechanics.body import Body
from rbstab.mechanics.numbers import Array


def displacement(body: Body, A: Array, X: Array, anchor: Array) -> Array:
    """Return E = X + A R - R - X_a, from the anchor to C (eq. 4; with X_a = X_e, eq. 38).

    Args:
        body: The body, for R.
        A: Rotation from body to inertial coordinates, shape (3, 3).
        X: Position of the centre of gravity, shape (3,), m, inertial.
        anchor: X_a, displacement of the anchor from its place at X = 0, Θ = 0, shape (3,), m.

    Returns:
        E, shape (3,), m, inertial.
    """
    return X + A @ body.contact_point - body.contact_point - anchor


def velocity(body: Body, A: Array, Omega: Array, V: Array) -> Array:
    """Return F = Ė = V - A Ř Ω (eq. 4), with -ŘΩ = Ω × R.

    Args:
        body: The body, for R.
        A: Rotation from body to inertial coordinates, shape (3, 3).
        Omega: Angular velocity, shape (3,), rad/s, body.
        V: Velocity of the centre of gravity, shape (3,), m/s, inertial.

    Returns:
        F, shape (3,), m/s, inertial.
    """
    return V + A @ cross(Omega, body.contact_point)


def centre_position(body: Body, A: Array, E: Array, anchor: Array) -> Array:
    """Return X = E - AR + R + X_a: eq. 4 solved for X; with E = 0, eq. 32.

    Args:
        body: The body, for R.
        A: Rotation from body to inertial coordinates, shape (3, 3).
        E: Displacement of the contact point, shape (3,), m, inertial.
        anchor: X_a, as in `displacement`, shape (3,), m.
    """
    return E - A @ body.contact_point + body.contact_point + anchor


def centre_velocity(body: Body, A: Array, Omega: Array, F: Array) -> Array:
    """Return V = F + A Ř Ω: eq. 4 solved for V; with F = 0, eq. 32.

    Args:
        body: The body, for R.
        A: Rotation from body to inertial coordinates, shape (3, 3).
        Omega: Angular velocity, shape (3,), rad/s, body.
        F: Velocity of the contact point, shape (3,), m/s, inertial.
    """
    return F - A @ cross(Omega, body.contact_point)
