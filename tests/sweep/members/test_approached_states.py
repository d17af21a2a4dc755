"""Protects the rest states that many members approach: they equal those of single runs."""

import numpy as np
import pytest
from support.problems import bare_system
from support.rest import inverted_pendulum
from support.systems import VARIANTS, random_system

from rbstab.analysis.approached_state import lyapunov_zero
from rbstab.analysis.configuration import configurations
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.integrate.heyoka.symbols import parameter_values
from rbstab.mechanics.body import Body
from rbstab.sweep.members.approached_states import ApproachedStates, SharedState
from rbstab.systems.coordinates import ReducedCoordinates

# It falls from its upright position to either side, to where θ1 = 2 sin θ1.
STIFFNESS, MOMENT = [1.0, 3.0, 1.0], 2.0


def tilt():
    """Return the angle of the fallen pendulum, by iteration: the slope of 2 sin θ is -0.64."""
    theta = 1.9
    for _ in range(200):
        theta = 2 * np.sin(theta)
    return theta


def states_and_parameters(system, shared=None):
    return ApproachedStates(system, shared), parameter_values(system)[:, None]


@pytest.mark.parametrize("variant", VARIANTS)
def test_they_are_those_of_single_runs(variant):
    coordinates = ReducedCoordinates() if variant == "permanent" else None
    systems = [random_system(np.random.default_rng(k), variant, coordinates) for k in range(24)]
    at_rest = [configurations(system) for system in systems]
    parameters = np.array([parameter_values(system) for system in systems]).T
    moved = 0.2 * np.random.default_rng(1).normal(size=(at_rest[0].size, 24))
    last = np.array([body.unloaded for body in at_rest]).T + moved
    reached = ApproachedStates(systems[0], None).find(parameters, last)
    assert reached.approached.sum() >= 12
    for k in np.flatnonzero(reached.approached):
        system, motion = systems[k], at_rest[k].motion(last[:, k])
        states = last[at_rest[k].pose_size :, k]
        zero = lyapunov_zero(system, motion, states, nearest_rest_state(system))
        assert zero.approached
        assert reached.energy[k] == pytest.approx(zero.rest.energy, rel=1e-9, abs=1e-9)
        np.testing.assert_allclose(reached.orientation[k], zero.rest.motion.Theta, atol=1e-6)


def test_motions_that_end_at_the_shared_state_have_its_energy_to_the_last_bit():
    system = inverted_pendulum(STIFFNESS, MOMENT)
    near = np.array([tilt() + 1e-9, 0.0, 0.0])
    shared = SharedState(near, -0.123)
    states, parameters = states_and_parameters(system, shared)
    energy = tilt() ** 2 / 2 - MOMENT * (1 - np.cos(tilt()))
    last = np.array([[tilt() + 0.04, -1.0], [0.0, 0.0], [0.0, 0.0]])
    reached = states.find(np.repeat(parameters, 2, axis=1), last)
    assert reached.energy[0] == -0.123
    assert reached.orientation[0, 0] == near[0]
    assert reached.energy[1] == pytest.approx(energy, rel=1e-12)
    # A motion that ends farther away descends to the same state, and has the same energy.
    shared = SharedState(near, energy + 1e-13)
    reached = states_and_parameters(system, shared)[0].find(
        parameters, np.array([[1.2], [0.1], [0.0]])
    )
    assert reached.energy[0] == energy + 1e-13


def test_a_motion_that_is_broken_or_ends_beyond_the_range_has_none():
    states, parameters = states_and_parameters(inverted_pendulum([50.0, 1.0, 50.0], 20.0))
    # The second angle is soft: the body falls over its side, beyond ±π/2.
    last = np.array([[np.nan, 0.0], [0.1, 1.5], [0.0, 0.0]])
    assert states.find(np.repeat(parameters, 2, axis=1), last).approached.tolist() == [False, False]


@pytest.mark.parametrize("load", [1e-9, 1e-3, 1e3])
def test_a_small_load_is_balanced_too(load):
    """A free body that stabilizers hold by k rests with the energy -G²/2k."""
    stiffness = 50.0 * np.eye(3)
    body = Body(2.0, np.eye(3), np.array([0.1, 0.2, 0.3]))
    system = bare_system(body, weight=(0.0, load, 0.0), K_t=stiffness, K_r=stiffness)
    states, parameters = states_and_parameters(system)
    reached = states.find(parameters, np.zeros((6, 1)))
    assert reached.approached.tolist() == [True]
    assert reached.energy[0] == pytest.approx(-(load**2) / 100.0, rel=1e-9, abs=0)
