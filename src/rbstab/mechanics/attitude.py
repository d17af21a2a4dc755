"""The attitude of the body: Euler angles Θ, the rotation A and the rate matrix B."""

import math

import numpy as np

from rbstab.mechanics.algebra import IDENTITY
from rbstab.mechanics.numbers import Array, Number, cos, sin


def rotation(Theta: Array) -> Array:
    """Return A(Θ) = A1(θ1) A2(θ2) A3(θ3), from body to inertial coordinates (eq. 2).

    It turns about x by θ1, then about the new y by θ2, then about the new z by θ3.

    Args:
        Theta: Θ, shape (3,), rad.

    Returns:
        A, shape (3, 3), orthonormal; its inverse is its transpose.
    """
    A1, A2, A3 = _turns(Theta, 0.0, 1.0)
    return A1 @ A2 @ A3


def rotations(Theta: Array) -> Array:
    """Return A(Θ) of many attitudes, shape (m, 3, 3); Θ has the shape (m, 3), rad."""
    turns = _turns(Theta.T, np.zeros(len(Theta)), np.ones(len(Theta)))
    A1, A2, A3 = (np.moveaxis(turn, -1, 0) for turn in turns)
    return A1 @ A2 @ A3


def _turns(Theta: Array, zero: Number | Array, unity: Number | Array) -> tuple[Array, Array, Array]:
    """Return A1(θ1), A2(θ2), A3(θ3); Θ has the shape (3,), or (3, m) for m attitudes."""
    (s1, s2, s3), (c1, c2, c3) = sin(Theta), cos(Theta)
    A1 = np.array([[unity, zero, zero], [zero, c1, -s1], [zero, s1, c1]])
    A2 = np.array([[c2, zero, s2], [zero, unity, zero], [-s2, zero, c2]])
    A3 = np.array([[c3, -s3, zero], [s3, c3, zero], [zero, zero, unity]])
    return A1, A2, A3


def tilt(Theta: Array, desired: Array) -> Array:
    """Return the tilt of attitudes: the angle of the rotation between each and the desired one.

    It is the φ in [0, π] with |A(Θ) - A(Θ_desired)| = 2√2 sin(φ/2), by the Frobenius norm. So it is
    the same for all Euler angles of one attitude.

    Args:
        Theta: Θ, shape (m, 3), rad.
        desired: Θ of the desired attitude, shape (3,), rad.

    Returns:
        φ, shape (m,), rad.
    """
    away = rotations(Theta) - rotation(desired)
    chord = np.sqrt((away * away).sum(axis=(1, 2)) / 8.0)
    return np.asarray(2.0 * np.arcsin(np.minimum(chord, 1.0)))


def half_sine_squared(A: Array) -> Number:
    """Return sin²(φ/2) = |A - I|²/8, by the Frobenius norm, of the tilt φ of A from Θ = 0.

    It is smooth where φ is not, at 0, and as exact there.
    """
    away = (A - IDENTITY).ravel()
    return (away @ away) / 8.0


def half_sine_squared_rate(A: Array, Omega: Array) -> Number:
    """Return the derivative of `half_sine_squared`: (A₃₂ - A₂₃, A₁₃ - A₃₁, A₂₁ - A₁₂) Ω / 4."""
    return ((A - A.T)[[2, 0, 1], [1, 2, 0]] @ Omega) / 4.0


def quaternions(A: Array) -> Array:
    """Return unit quaternions w, x, y, z of rotations along a motion; their sign does not jump.

    Args:
        A: Shape (n, 3, 3).

    Returns:
        Shape (n, 4); NaN where A is not finite.
    """
    # Imported late: it takes a while.
    from scipy.spatial.transform import Rotation

    wxyz, finite = np.full((len(A), 4), np.nan), np.isfinite(A).all(axis=(1, 2))
    wxyz[finite] = Rotation.from_matrix(A[finite]).as_quat(scalar_first=True)
    signs = np.where((wxyz[1:] * wxyz[:-1]).sum(axis=1) < 0, -1, 1)
    return np.asarray(wxyz * np.cumprod([1, *signs])[: len(wxyz), None])


def rate_matrix(Theta: Array) -> Array:
    """Return B(Θ), with Θ̇ = B(Θ) Ω (eq. 1); it is singular where cos θ2 = 0.

    The second row is [sin θ3, cos θ3, 0]. The paper prints it divided by cos θ2, but then Ȧ = A Ω̌
    fails.

    Args:
        Theta: Θ, shape (3,), rad.

    Returns:
        B, shape (3, 3), dimensionless, from body rates to angle rates.
    """
    (_, s2, s3), (_, c2, c3) = sin(Theta), cos(Theta)
    a, b = c3 / c2, s3 / c2
    return np.array([[a, -b, 0.0], [s3, c3, 0.0], [-s2 * a, s2 * b, 1.0]])


def rate_matrix_inverse(Theta: Array) -> Array:
    """Return B⁻¹(Θ), with Ω = B⁻¹(Θ) Θ̇; it is singular, but finite, where cos θ2 = 0.

    Its columns are the axes of θ1, θ2 and θ3 in body coordinates.

    Args:
        Theta: Θ, shape (3,), rad.

    Returns:
        B⁻¹, shape (3, 3), dimensionless, from angle rates to body rates.
    """
    (_, s2, s3), (_, c2, c3) = sin(Theta), cos(Theta)
    return np.array([[c2 * c3, s3, 0.0], [-c2 * s3, c3, 0.0], [s2, 0.0, 1.0]])


def is_upright(Theta: Array) -> Array:
    """Return whether |θ2| < π/2: then Euler angles, shape (3,) or (3, m), rad, are regular.

    θ1 and θ3 may be any angles: no equation is singular there, and the angles are never wrapped.
    """
    upright: Array = np.abs(Theta[1]) < math.pi / 2
    return upright


def in_range(Theta: Array) -> Array:
    """Return whether Euler angles are in the range of eq. 5: ±π, ±π/2 (open) and ±π.

    Args:
        Theta: Θ, shape (3,) or (3, m), rad.
    """
    theta1, _, theta3 = np.abs(Theta)
    inside: Array = (theta1 <= math.pi) & is_upright(Theta) & (theta3 <= math.pi)
    return inside


def regularity(Theta: Array) -> Number:
    """Return cos θ2 = 1 / det B; the range of eq. 5 ends where it is zero."""
    return cos(Theta)[1]
