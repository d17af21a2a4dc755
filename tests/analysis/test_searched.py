"""Protects searches for rest states without a proof: the energy, the equations, and proofs."""

import numpy as np
import pytest
from support.config_elements import config_data
from support.configs import BY_VARIANT, plain

from rbstab.analysis.descents.searched import searched_minima, searched_rest_states
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment.proof import prove

STRUT = {
    "kind": "spring",
    "stiffness": 600.0,
    "rest_length": 0.4,
    "damping": 2.0,
    "point": [0.2, 0.1, 0.0],
    "anchor": [0.9, 0.1, 0.0],
}

GUARDS = {
    "repelling": {"method": "repelling", "couple": 3000.0, "soft_angle": 0.005},
    "stop": {"method": "stop", "angle": 0.005, "restitution": 0.5},
}


def system_of(data):
    return problem_of(load_config(data)).system


def test_it_finds_what_is_proved():
    config = load_config(plain(BY_VARIANT["permanent"]))
    proof = prove(config)
    searched = searched_rest_states(problem_of(config).system)
    assert proof.proved
    assert len(searched) == len(proof.states)
    for rest_state, other in zip(searched, proof.states, strict=True):
        np.testing.assert_allclose(rest_state.state.motion.Theta, other.orientation, atol=1e-6)
        assert rest_state.index == other.index


@pytest.mark.parametrize("method", GUARDS)
def test_a_body_that_a_load_presses_against_a_guard(method):
    """Also where a force jumps there: the couple of a repelling guard, or a stop."""
    guard = {"kind": "guard"} | GUARDS[method]
    gravity = [4000.0 / 41.0, 0.0, -9.81]
    initial = {"orientation": [0, 0, 0]}
    elements = {"strut": STRUT, "range": guard}
    system = system_of(config_data(elements, gravity=gravity, initial=initial))
    minima = searched_minima(system)
    expected = nearest_rest_state(system)
    assert minima
    nearest = min(minima, key=lambda minimum: abs(minimum.state.energy - expected.energy))
    assert nearest.state.energy == pytest.approx(expected.energy, rel=1e-6)
    np.testing.assert_allclose(nearest.state.motion.Theta, expected.motion.Theta, atol=1e-4)
    assert abs(nearest.state.motion.Theta[1]) > 0.0049
