"""Rotations by SciPy, which shares nothing with the equations under test."""

from scipy.spatial.transform import Rotation


def attitude(Theta):
    """Roll, then pitch, then yaw, each about the axis as the body has carried it."""
    return Rotation.from_euler("XYZ", Theta).as_matrix()


def angles(A):
    """The angles inside the range of eq. 5."""
    return Rotation.from_matrix(A).as_euler("XYZ")


def turned(A, Omega, t):
    """A after the body has turned for a time t at a constant Ω."""
    return A @ Rotation.from_rotvec(Omega * t).as_matrix()
