"""Protects the state at which v is zero: the minimum below the last sample of the motion."""

from dataclasses import replace

import numpy as np
import pytest
from support.rest import inverted_pendulum

from rbstab.analysis.approached_state import lyapunov_zero
from rbstab.analysis.configuration import configurations
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.mechanics.algebra import ZERO

NO_OWN_STATES = np.zeros(0)


def zero_from(system, q):
    at_rest = configurations(system)
    q = np.asarray(q, dtype=float)
    states = q[at_rest.pose_size :]
    return lyapunov_zero(system, at_rest.motion(q), states, nearest_rest_state(system))


@pytest.mark.parametrize("side", [1, -1])
def test_a_fallen_pendulum_counts_from_its_own_side(side):
    """Upright it stands still without a slope, so the descent from there stays there."""
    zero = zero_from(inverted_pendulum([1.0, 3.0, 1.0], 2.0), [side * 0.4, 0.05, 0.02])
    tilt = side * 1.8954942670339809  # θ = 2 sin θ
    np.testing.assert_allclose(zero.rest.motion.Theta, [tilt, 0, 0], atol=1e-7)
    assert zero.rest.energy == pytest.approx(tilt**2 / 2 - 2 * (1 - np.cos(tilt)), rel=1e-9)
    assert zero.approached
    assert zero.is_lowest


def test_a_shallower_valley_says_that_a_lower_state_is_known():
    system = inverted_pendulum([1.0, 3.0, 1.0], 2.0)
    upright = nearest_rest_state(system)
    motion = configurations(system).motion(np.array([0.4, 0.0, 0.0]))
    zero = lyapunov_zero(system, motion, NO_OWN_STATES, upright)
    assert zero.rest.energy < upright.energy
    assert zero.is_lowest
    deeper = replace(upright, energy=zero.rest.energy - 1.0)
    zero = lyapunov_zero(system, motion, NO_OWN_STATES, deeper)
    assert zero.approached
    assert not zero.is_lowest


def test_a_motion_that_falls_out_of_the_range_counts_from_the_known_state():
    system = inverted_pendulum([50.0, 1.0, 50.0], 20.0)
    zero = zero_from(system, [0.0, 1.5, 0.0])
    assert not zero.approached
    np.testing.assert_array_equal(zero.rest.motion.Theta, ZERO)
