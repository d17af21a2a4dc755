"""Protects `initial: {attached: true}`: the contact point starts on its anchor (E = 0), whatever
the orientation, body, anchor and coordinates.
"""

import numpy as np
import pytest
from support.configs import BY_VARIANT, EMBEDDED, SLIDING, plain
from support.pose import attitude

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.config.numbers import shifted

THETA = [0.4, -0.3, 0.2]
R = np.array([0.15, 0.10, -0.42])
TIED = [name for name in BY_VARIANT if name != "permanent"]


def attached(text, *changes, Theta=THETA):
    data = plain(text)
    data["initial"] |= {"orientation": Theta, "attached": True}
    return load_config(data, changes)


def motion_at_start(config):
    problem = problem_of(config)
    system = problem.system
    return system.motion(problem.start[: system.coordinates.size])


@pytest.mark.parametrize("coordinates", ["Z", "W"])
@pytest.mark.parametrize("name", TIED)
def test_the_contact_point_is_on_its_anchor(name, coordinates):
    motion = motion_at_start(attached(BY_VARIANT[name], f"integration.coordinates={coordinates}"))
    np.testing.assert_allclose(motion.X, R - attitude(THETA) @ R, atol=1e-15)
    np.testing.assert_allclose(motion.E, 0, atol=1e-16)


def test_an_anchor_at_equilibrium():
    """The anchor is where C is when the springs K_t carry the weight upright: K_t⁻¹ m g + R."""
    change = "controller.anchor=equilibrium"
    motion = motion_at_start(attached(EMBEDDED, change, "gravity=[1, 2, -9.81]"))
    sunk = 41.0 * np.array([1, 2, -9.81]) / [4100, 4100, 3280]
    np.testing.assert_allclose(motion.X, sunk + R - attitude(THETA) @ R, atol=1e-15)
    np.testing.assert_allclose(motion.E, 0, atol=1e-16)


def test_a_sliding_connector_starts_on_its_surface_exactly():
    """Round-off in E would be on one side of s = E, and the connector would pull there."""
    for Theta in np.random.default_rng(1).uniform(-1, 1, (20, 3)).tolist():
        assert (motion_at_start(attached(SLIDING, Theta=Theta)).E == 0).all()


def test_the_velocity_stays_as_it_is_given():
    """So the contact point may move at the start: F = V - A (R × Ω) by eq. 4."""
    V, Omega = np.array([0.1, -0.2, 0.3]), np.array([16, 32, -16])
    motion = motion_at_start(attached(EMBEDDED, f"initial.velocity={V.tolist()}"))
    assert (motion.V == V).all()
    np.testing.assert_allclose(motion.F, V - attitude(THETA) @ np.cross(R, Omega), atol=1e-14)
    assert (motion_at_start(attached(EMBEDDED)).V == 0).all()


def test_the_derivative_of_the_start_by_the_orientation():
    """By a complex step, as sensitivities take it, against finite differences of A(Θ) R."""
    step = 1e-30
    moved = problem_of(shifted(attached(EMBEDDED), {("initial", "orientation", 1): 1j * step}))
    h = np.array([0, 1e-6, 0])
    expected = -(attitude(THETA + h) @ R - attitude(THETA - h) @ R) / 2e-6
    np.testing.assert_allclose(moved.start[6:9].imag / step, expected, atol=1e-9)
