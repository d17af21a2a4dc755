"""A body without forces moves by Euler's and Jacobi's closed solutions."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipj
from support.problems import ENGINES, bare_system, problem, solve

from rbstab.mechanics.body import Body

TIMES = np.linspace(0.0, 5.0, 101)
CONTACT_POINT = np.array([0.15, 0.1, -0.42])

# A hundred steps of 1e-12 each, in rad and rad/s.
ERROR = 1e-10


def spin_freely(engine, moments, Theta, Omega, velocity=(0.0, 0.0, 0.0)):
    system = bare_system(Body(3.0, np.diag(moments), CONTACT_POINT))
    start = np.concatenate([Theta, Omega, [0.1, -0.2, 0.3], velocity])
    trajectory = solve(engine, problem(system, start, TIMES))
    assert trajectory.status == "completed"
    return trajectory.states


def jacobi_spin(moments, Omega1, Omega3, t):
    """Return Ω(t) with Ω2(0) = 0 and Ω1, Ω3 > 0 (Landau & Lifshitz, section 37).

    The moments are in ascending order for L² > 2T J2, in descending order for L² < 2T J2.
    """
    J1, J2, J3 = moments
    energy = J1 * Omega1**2 + J3 * Omega3**2  # 2T
    square = (J1 * Omega1) ** 2 + (J3 * Omega3) ** 2  # L²
    rate = np.sqrt((J3 - J2) * (square - energy * J1) / (J1 * J2 * J3))
    modulus = (J2 - J1) * (energy * J3 - square) / ((J3 - J2) * (square - energy * J1))
    assert 0 < modulus < 1
    sn, cn, dn, _ = ellipj(rate * t, modulus)
    middle = np.sqrt((energy * J3 - square) / (J2 * (J3 - J2)))
    return np.array([Omega1 * cn, middle * sn, Omega3 * dn])


MOMENTS = np.array([1.0, 1.7, 2.2])

# L² > 2T J2, then L² < 2T J2: Ω circles the axis of the largest moment, or of the smallest.
SPINS = {"about the largest": (0.6, 1.2), "about the smallest": (1.5, 0.5)}


def expected_spin(spin, t):
    Omega1, Omega3 = spin
    if spin == SPINS["about the largest"]:
        return jacobi_spin(MOMENTS, Omega1, Omega3, t)
    # Axes 1 and 3 are swapped. Ω2 still grows at first: its rate is (J3 - J1)/J2 Ω3Ω1.
    return jacobi_spin(MOMENTS[::-1], Omega3, Omega1, t)[::-1]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("spin", SPINS.values(), ids=SPINS)
def test_triaxial_body_follows_jacobis_functions(engine, spin):
    Omega = np.array([spin[0], 0.0, spin[1]])
    momentum = MOMENTS * Omega
    size = np.linalg.norm(momentum)
    # The body is turned so that L lies along the inertial axis 1. In the body L is then
    # |L| (cos θ2 cos θ3, -cos θ2 sin θ3, sin θ2), so θ2 and θ3 follow from Ω.
    Theta = np.array([0.0, np.arcsin(momentum[2] / size), 0.0])
    states = spin_freely(engine, MOMENTS, Theta, Omega)
    expected = np.array([expected_spin(spin, t) for t in TIMES])
    np.testing.assert_allclose(states[:, 3:6], expected, rtol=0, atol=ERROR)
    in_body = MOMENTS * expected / size
    np.testing.assert_allclose(states[:, 1], np.arcsin(in_body[:, 2]), rtol=0, atol=ERROR)
    theta3 = np.unwrap(np.arctan2(-in_body[:, 1], in_body[:, 0]))
    np.testing.assert_allclose(states[:, 2], theta3, rtol=0, atol=ERROR)

    def precession(t):
        J1, J2, _ = MOMENTS
        first, second, _ = expected_spin(spin, t)
        return size * (J1 * first**2 + J2 * second**2) / ((J1 * first) ** 2 + (J2 * second) ** 2)

    for row in (20, 60, 100):
        theta1, _ = quad(precession, 0.0, TIMES[row], epsabs=1e-12, epsrel=1e-12, limit=200)
        assert states[row, 0] == pytest.approx(theta1, rel=0, abs=ERROR)
