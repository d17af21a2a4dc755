"""Eq. 2, 5 and the matrix B of eq. 1 describe the attitude; the printed B does not."""

import numpy as np
import pytest
from support.differences import derivative, relative_error
from support.pose import angles, attitude, turned
from support.systems import random_Z

from rbstab.mechanics.attitude import (
    in_range,
    is_upright,
    rate_matrix,
    regularity,
    rotation,
)


def skew(Omega):
    return np.cross(Omega, np.eye(3)).T


def printed_rate_matrix(Theta):
    """Return B as the paper prints it: its second row is divided by cos θ2."""
    return rate_matrix(Theta) / np.array([[1.0], [np.cos(Theta[1])], [1.0]])


def test_eq_02_rotation_is_roll_pitch_yaw_about_carried_axes(rng):
    Theta = random_Z(rng)[:3]
    assert relative_error(rotation(Theta), attitude(Theta)) < 1e-14


def test_eq_01_angle_rates_follow_the_turning_body(rng):
    Theta, Omega = np.split(random_Z(rng)[:6], 2)
    A = attitude(Theta)
    expected = derivative(lambda t: angles(turned(A, Omega, t)), 1e-3)
    assert relative_error(rate_matrix(Theta) @ Omega, expected) < 1e-11


def test_eq_01_rotation_rate_is_A_times_spin(rng):
    Theta, Omega = np.split(random_Z(rng)[:6], 2)

    def rotation_rate(B):
        return derivative(lambda t: rotation(Theta + t * (B @ Omega)), 1e-3)

    expected = rotation(Theta) @ skew(Omega)
    assert relative_error(rotation_rate(rate_matrix(Theta)), expected) < 1e-12
    assert relative_error(rotation_rate(printed_rate_matrix(Theta)), expected) > 1e-2


def test_eq_01_determinant_of_the_rate_matrix(rng):
    Theta = random_Z(rng)[:3]
    assert regularity(Theta) * np.linalg.det(rate_matrix(Theta)) == pytest.approx(1, rel=1e-14)


@pytest.mark.parametrize("end", [-1, 1])
def test_eq_05_regularity_changes_sign_at_the_end_of_the_range(end):
    # Roll and yaw have negative cosines.
    inside = regularity(np.array([2.0, end * (np.pi / 2 - 1e-6), -2.5]))
    outside = regularity(np.array([2.0, end * (np.pi / 2 + 1e-6), -2.5]))
    # θ2 is rounded to 1e-16, so a cosine of 1e-6 has ten correct digits.
    assert inside == pytest.approx(1e-6, rel=1e-9)
    assert outside == pytest.approx(-1e-6, rel=1e-9)


def test_eq_05_range_of_the_angles():
    half, most = np.pi / 2, np.pi
    beside = np.nextafter(half, 0)
    assert is_upright(np.array([9.0, beside, 9.0]))
    assert not is_upright(np.array([0.0, half, 0.0]))
    assert not is_upright(np.array([0.0, -half - 0.1, 0.0]))
    inside = [(0, 0, 0), (most, -beside, -most), (-most, beside, most)]
    outside = [(3.2, 0, 0), (-3.2, 0, 0), (0, half, 0), (0, -1.6, 0), (0, 0, 3.2), (0, 0, -3.2)]
    assert in_range(np.array(inside, dtype=float).T).tolist() == [True] * 3
    assert in_range(np.array(outside, dtype=float).T).tolist() == [False] * 6
