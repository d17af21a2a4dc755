"""Motors with a limit or a lag: what they exert, and that power is stored, lost or supplied."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.differences import derivative
from support.path import random_path
from support.systems import random_body

from rbstab.elements.motors import (
    HardForce,
    HardTie,
    LateConnector,
    LateCouple,
    LateForce,
    LateTie,
    LimitedBodyCouple,
    LimitedCouple,
    LimitedForce,
)
from rbstab.elements.registry import longest_lag
from rbstab.mechanics.motion import motion_from_centre

K, L, M = (
    np.diag([900.0, 700.0, 500.0]),
    np.diag([50.0, 30.0, 20.0]),
    np.array([300.0, 200.0, 90.0]),
)
ENDS: dict[str, Any] = {
    "name": "one",
    "point": np.array([0.1, 0.2, -0.3]),
    "anchor": np.array([0.2, -0.1, 0.0]),
}

SUPPLYING = {
    "body": LimitedBodyCouple(K_r=K, L_r=L, limit=M),
    "force": LateForce(K_t=K, L_t=L, lag=0.2),
    "couple": LateCouple(K_r=K, L_r=L, lag=0.2),
    "connector": LateConnector(K_c=K, L_c=L, lag=0.2),
    "tie": LateTie(K_c=K, L_c=L, lag=0.2, **ENDS),
}
"""Motors that are not passive: one in body axes, and four with a lag beyond 0.04 s."""


def rate_of_stored(motor, path, states, rates):
    def stored(t):
        motion = motion_from_centre(path.body, np.zeros(3), path.Z(t))
        return motor.stored(motion, states + t * rates)

    return derivative(stored, 5e-5)


@pytest.mark.parametrize("name", SUPPLYING)
def test_what_is_supplied_closes_the_balance_along_a_path(rng, name):
    """The rate of what is stored = power taken from the body - dissipated + supplied."""
    motor, shares = SUPPLYING[name], []
    for _ in range(30):
        path = random_path(rng, random_body(rng))
        states = rng.normal(size=motor.state_size)
        motion = motion_from_centre(path.body, np.zeros(3), path.Z())
        rise = rate_of_stored(motor, path, states, motor.rates(motion, states))
        wrench = motor.wrench(motion, states)
        taken = -(wrench.force @ motion.V + wrench.couple @ motion.Omega)
        taken -= wrench.contact_force @ motion.F
        lost, supplied = motor.dissipated(motion, states), motor.supplied(motion, states)
        assert lost >= 0
        scale = abs(taken) + lost + abs(supplied)
        assert abs(rise - (taken - lost + supplied)) < 1e-7 * scale
        shares.append(supplied / scale)
    # It is no small share, and has both signs: such a motor is not passive.
    assert max(shares) > 0.05
    assert min(shares) < -0.05


def test_a_hard_limit_stores_and_loses_what_it_takes_on_all_of_its_sides(rng):
    """Slow, fast and far: inside of the limit, beyond it by the spring, or by the damper alone."""
    sides = set()
    for _ in range(60):
        path = random_path(rng, random_body(rng))
        still = HardTie(K_c=rng.uniform(1, 300) * K / 900, L_c=L, limit=M, **ENDS)
        motion = motion_from_centre(path.body, np.zeros(3), path.Z())
        motor = replace(still, mode=(still.guards(motion, np.zeros(0)) > 0).astype(float))
        rise = rate_of_stored(motor, path, np.zeros(0), np.zeros(0))
        wrench, lost = motor.wrench(motion, np.zeros(0)), motor.dissipated(motion, np.zeros(0))
        taken = -(wrench.force @ motion.V + wrench.couple @ motion.Omega)
        assert lost >= 0
        assert abs(rise - (taken - lost)) < 1e-7 * (abs(taken) + abs(rise))
        sides |= {tuple(motor.mode.reshape(4, 3)[:, axis]) for axis in range(3)}
        # The force by numpy's own clamp.
        here = motor.at_point(motion)
        told = motor.K_c @ here.E + L @ here.F
        np.testing.assert_allclose(wrench.force, -np.clip(told, -M, M), rtol=1e-12)
    assert len(sides) >= 5


def test_the_energy_of_a_hard_limit_is_continuous_where_it_switches():
    k, limit = np.diag(K), M
    for beyond in (0.0, 1.0):
        mode = np.repeat([0.0, 0.0, beyond, 0.0], 3)
        motor = HardForce(K_t=K, L_t=L, limit=limit, mode=mode)
        stored = motor.stored(motion_at(X=limit / k), np.zeros(0))
        assert stored == pytest.approx(0.5 * limit @ (limit / k), rel=1e-14)


def motion_at(Theta=(0, 0, 0), Omega=(0, 0, 0), X=(0, 0, 0), V=(0, 0, 0)):
    return motion_from_centre(BODY, np.zeros(3), np.array([*Theta, *Omega, *X, *V], float))


BODY = random_body(np.random.default_rng(1))


def test_a_force_has_its_limit_however_far_the_body_is():
    """By hand: y/√(1 + (y/M)²) is 0.6 M at y = 0.75 M, and M to five digits at 300 M."""
    motor = LimitedForce(K_t=K, L_t=L, limit=M)
    exerted = motor.wrench(motion_at(X=0.75 * M / np.diag(K)), np.zeros(0)).force
    np.testing.assert_allclose(exerted, -0.6 * M, rtol=1e-14)
    far = motor.wrench(motion_at(X=-200 * M / np.diag(K), V=-100 * M / np.diag(L)), np.zeros(0))
    np.testing.assert_allclose(far.force, M, rtol=1e-5)
    assert np.all(far.force < M)


def test_a_tiny_and_a_huge_limit_store_what_they_should():
    """½ x'Kx without round-off for a limit that is never felt, and M|x| for one always reached."""
    x = np.array([1e-3, -2e-3, 3e-3])
    for limit, expected in ((1e12, 0.5 * x @ K @ x), (1e-9, 1e-9 * np.abs(x).sum())):
        motor = LimitedForce(K_t=K, L_t=L, limit=np.full(3, limit))
        assert motor.stored(motion_at(X=x), np.zeros(0)) == pytest.approx(expected, rel=1e-8)


def test_a_couple_in_body_axes_is_limited_in_body_axes():
    """Of a body turned by -90° about z and pitched, both differ, and each keeps its own limit."""
    motion = motion_at(Theta=(0.3, 1.2, -1.4), Omega=(9, -20, 15))
    body = LimitedBodyCouple(K_r=K, L_r=L, limit=M).wrench(motion, np.zeros(0)).couple
    euler = LimitedCouple(K_r=K, L_r=L, limit=M).wrench(motion, np.zeros(0)).couple
    assert np.all(np.abs(body) < M)
    # Virtual work: a couple N has the components B⁻ᵀN on the Euler angles.
    on_angles = np.linalg.solve(motion.B.T, euler)
    assert np.all(np.abs(on_angles) < M)
    assert np.any(np.abs(euler) > M)


def test_the_longest_lag_is_where_a_damping_is_used_up(rng):
    for _ in range(20):
        roots = rng.normal(size=(2, 3, 3))
        stiffness, damping = (root @ root.T + 0.1 * np.eye(3) for root in roots)
        lag = longest_lag(stiffness, damping)
        # The least eigenvalue of K⁻¹L, by another algorithm.
        assert lag == pytest.approx(
            np.linalg.eigvals(np.linalg.inv(stiffness) @ damping).real.min()
        )
        smallest = np.linalg.eigvalsh(damping - lag * stiffness)[0]
        assert abs(smallest) < 1e-12 * np.linalg.norm(damping)
    # H and N of the first case of the paper.
    assert longest_lag((4100.0, 4100.0, 3280.0), (210.0, 210.0, 140.0)) == pytest.approx(140 / 3280)
    assert longest_lag((400.0, 400.0, 320.0), (60.0, 60.0, 42.0)) == pytest.approx(42 / 320)
    assert longest_lag((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)) == np.inf
    assert longest_lag((1.0, 1.0, 1.0), (1.0, 1.0, 0.0)) == 0.0
