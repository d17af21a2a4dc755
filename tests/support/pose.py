"""Rotations by SciPy, which shares no code with the equations under test."""

from scipy.spatial.transform import Rotation


def attitude(Theta):
    """Return A(Θ): roll, then pitch, then yaw, each about the current body axis."""
    return Rotation.from_euler("XYZ", Theta).as_matrix()


def angles(A):
    """Return the angles Θ of A, inside the range of eq. 5."""
    return Rotation.from_matrix(A).as_euler("XYZ")


def turned(A, Omega, t):
    """Return A after the body has turned for a time t at a constant Ω."""
    return A @ Rotation.from_rotvec(Omega * t).as_matrix()
