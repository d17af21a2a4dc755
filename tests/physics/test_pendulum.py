"""A body held at its contact point under gravity moves like a pendulum and a spinning top."""

import numpy as np
import pytest
from scipy.special import ellipj, ellipk
from support.problems import ENGINES, bare_system, held_start, problem, solve

from rbstab.mechanics.body import Body
from rbstab.systems.coordinates import ManifoldCoordinates, ReducedCoordinates

MASS, GRAVITY = 2.5, 9.81
LENGTH = 0.7
COORDINATES = {"reduced": ReducedCoordinates(), "manifold": ManifoldCoordinates(0.0)}

ERROR = 1e-10

each_engine = pytest.mark.parametrize("engine", ENGINES)
each_coordinates = pytest.mark.parametrize("coordinates", COORDINATES.values(), ids=COORDINATES)


def swing(engine, system, Theta, Omega, times):
    """Return the observations along the motion of a held body."""
    start = held_start(system, np.asarray(Theta, float), np.asarray(Omega, float))
    trajectory = solve(engine, problem(system, start, times))
    assert trajectory.status == "completed"
    return [system.observe(state) for state in trajectory.states]


def pendulum(coordinates):
    # The contact point lies above the centre, so the body hangs down at Θ = 0.
    body = Body(MASS, np.diag([0.5, 0.3, 0.2]), np.array([0.0, 0.0, LENGTH]))
    return bare_system(body, coordinates, weight=(0.0, 0.0, -MASS * GRAVITY))


@each_coordinates
@each_engine
@pytest.mark.parametrize("axis", [0, 1])
def test_planar_pendulum_swings_as_the_elliptic_functions_say(engine, coordinates, axis):
    system = pendulum(coordinates)
    inertia = (0.5, 0.3)[axis] + MASS * LENGTH**2
    pace = np.sqrt(MASS * GRAVITY * LENGTH / inertia)
    modulus = np.sin(1.2 / 2)
    period = 4 * ellipk(modulus**2) / pace
    times = np.linspace(0.0, period, 41)
    seen = swing(engine, system, 1.2 * np.eye(3)[axis], np.zeros(3), times)
    angles = np.array([o.motion.Theta for o in seen])
    # From rest at 1.2 rad: sin(θ/2) = k sn(K - ω t), with the period 4K/ω.
    sn, cn, *_ = ellipj(ellipk(modulus**2) - pace * times, modulus**2)
    np.testing.assert_allclose(angles[:, axis], 2 * np.arcsin(modulus * sn), rtol=0, atol=ERROR)
    assert angles[-1, axis] == pytest.approx(1.2, rel=0, abs=ERROR)
    np.testing.assert_allclose(np.delete(angles, axis, 1), 0.0, rtol=0, atol=ERROR)
    rates = np.array([o.motion.Omega for o in seen])[:, axis]
    np.testing.assert_allclose(rates, -2 * modulus * pace * cn, rtol=0, atol=10 * ERROR)


@each_coordinates
@each_engine
def test_fast_top_precesses_steadily(engine, coordinates):
    # Gravity acts along the inertial axis -1, so θ1 is the angle of precession and θ3 of spin. The
    # top's axis e3 has the centre at +l e3 from the pin, and the angle n to the vertical, with
    # sin θ2 = cos n. Steady motion about the pin: I3 ω3 p - I1 p² cos n = m g l.
    transverse, axial = 0.4, 0.25
    body = Body(MASS, np.diag([transverse, transverse, axial]), np.array([0.0, 0.0, -LENGTH]))
    system = bare_system(body, coordinates, weight=(-MASS * GRAVITY, 0.0, 0.0))
    about_pin = transverse + MASS * LENGTH**2
    theta2, precession = 0.5, 1.7
    cos_n = np.sin(theta2)
    axial_spin = MASS * GRAVITY * LENGTH + about_pin * precession**2 * cos_n
    axial_spin /= axial * precession
    spin = axial_spin - precession * cos_n
    # Ω = A2'e1 θ1' + e3 θ3' at θ3 = 0.
    Omega = [precession * np.cos(theta2), 0.0, axial_spin]
    times = np.linspace(0.0, 2.0, 21)
    seen = swing(engine, system, [0.0, theta2, 0.0], Omega, times)
    angles = np.array([o.motion.Theta for o in seen])
    expected = np.stack([precession * times, np.full(21, theta2), spin * times], axis=1)
    # The spin is 45 rad/s, and large terms cancel.
    np.testing.assert_allclose(angles, expected, rtol=0, atol=1e-9)
