"""Protects `initial: {attached: true}`: the contact point starts on its anchor (E = 0), whatever
the orientation, body, anchor and coordinates; configs without the key keep their ids.
"""

import copy
import pickle

import numpy as np
import pytest
from support.configs import BY_VARIANT, EMBEDDED, PERMANENT, edited, plain
from support.json_schemas import schema_errors, validator_of
from support.pose import attitude

from rbstab.config.build import problem_of
from rbstab.config.load import load_config, resolved, run_id
from rbstab.config.numbers import shifted
from rbstab.config.schema import json_schema

THETA = [0.4, -0.3, 0.2]
R = np.array([0.15, 0.10, -0.42])
TIED = [name for name in BY_VARIANT if name != "permanent"]
ATTACHED = edited("orientation: [0, 0, 0]", f"orientation: {THETA}\n  attached: true")
GIVEN = "initial.position: is given beside attached: true, from which it follows"

SLIDING = edited("visco-elastic", "sliding").replace(
    "  K_c: [12300, 12300, 9840]\n  L_c: [600, 600, 420]\n",
    "  K_s: [9, 9, 9]\n  surface: position\n",
)


def attached(data, *changes):
    return load_config(data, [f"initial.orientation={THETA}", "initial.attached=true", *changes])


def motion_at_start(config):
    problem = problem_of(config)
    system = problem.system
    return system.motion(problem.start[: system.coordinates.size])


@pytest.mark.parametrize("coordinates", ["Z", "W"])
@pytest.mark.parametrize("name", TIED)
def test_the_contact_point_is_on_its_anchor(name, coordinates):
    config = attached(plain(BY_VARIANT[name]), f"integration.coordinates={coordinates}")
    motion = motion_at_start(config)
    np.testing.assert_allclose(motion.X, R - attitude(THETA) @ R, atol=1e-15)
    np.testing.assert_allclose(motion.E, 0, atol=1e-16)


def test_an_anchor_at_equilibrium():
    """The anchor is where C is when the springs K_t carry the weight upright: K_t⁻¹ m g + R."""
    change = "controller.anchor=equilibrium"
    motion = motion_at_start(attached(plain(EMBEDDED), change, "gravity=[1, 2, -9.81]"))
    sunk = 41.0 * np.array([1, 2, -9.81]) / [4100, 4100, 3280]
    np.testing.assert_allclose(motion.X, sunk + R - attitude(THETA) @ R, atol=1e-15)
    np.testing.assert_allclose(motion.E, 0, atol=1e-16)


def test_a_sliding_connector_starts_on_its_surface_exactly():
    """Round-off in E would be on one side of s = E, and the connector would pull there."""
    for Theta in np.random.default_rng(1).uniform(-1, 1, (20, 3)).tolist():
        config = attached(plain(SLIDING), f"initial.orientation={Theta}")
        assert (motion_at_start(config).E == 0).all()


def test_the_velocity_stays_as_it_is_given():
    """So the contact point may move at the start: F = V - A (R × Ω) by eq. 4."""
    V, Omega = np.array([0.1, -0.2, 0.3]), np.array([16, 32, -16])
    motion = motion_at_start(attached(plain(), f"initial.velocity={V.tolist()}"))
    assert (motion.V == V).all()
    np.testing.assert_allclose(motion.F, V - attitude(THETA) @ np.cross(R, Omega), atol=1e-14)
    assert (motion_at_start(attached(plain())).V == 0).all()


def test_a_held_body_is_always_attached():
    held = load_config(plain(PERMANENT))
    assert run_id(load_config(plain(PERMANENT), ["initial.attached=true"])) == run_id(held)
    with pytest.raises(ValueError, match="attached: is false for a body that is held") as caught:
        load_config(plain(PERMANENT), ["initial.attached=false"])
    assert "--set initial.attached:1:18: " in str(caught.value)


@pytest.mark.parametrize("name", BY_VARIANT)
def test_configs_without_the_key_are_as_they_were(name):
    config = load_config(plain(BY_VARIANT[name]))
    assert "attached" not in resolved(config)["initial"]
    if name in TIED:
        assert resolved(config)["initial"]["position"] == [0, 0, 0]
        assert run_id(load_config(plain(BY_VARIANT[name]), ["initial.attached=false"])) == run_id(
            config
        )


def test_it_is_stored_and_loads_again():
    config = load_config(plain(ATTACHED))
    initial = resolved(config)["initial"]
    assert initial["attached"] is True
    assert "position" not in initial
    assert load_config(resolved(config)) == config
    assert pickle.loads(pickle.dumps(config)) == config  # noqa: S301 (made here)
    assert copy.deepcopy(config) == config
    assert run_id(config) != run_id(load_config(plain(ATTACHED), ["initial.attached=false"]))


def test_no_position_beside_it(load):
    for given in ("[0.1, 0, 0]", "[0, 0, 0]"):
        with pytest.raises(ValueError, match=GIVEN) as caught:
            load(ATTACHED.replace("attached: true", f"attached: true\n  position: {given}"))
        assert ".yaml:17:13: initial.position: is given" in str(caught.value)
    with pytest.raises(ValueError, match=GIVEN):
        load_config(plain(ATTACHED), ["initial.position[0]=0.1"])


def test_the_schema_for_editors():
    validator = validator_of(json_schema())
    assert not schema_errors(validator, ATTACHED)
    both = ATTACHED.replace("attached: true", "attached: true\n  position: [0, 0, 0]")
    assert schema_errors(validator, both)
    held = edited("initial:", "initial:\n  attached: true", PERMANENT)
    assert not schema_errors(validator, held)
    assert schema_errors(validator, held.replace("attached: true", "attached: false"))


def test_the_derivative_of_the_start_by_the_orientation():
    """By a complex step, as sensitivities take it, against finite differences of A(Θ) R."""
    config, step = load_config(plain(ATTACHED)), 1e-30
    moved = problem_of(shifted(config, {("initial", "orientation", 1): 1j * step}))
    h = np.array([0, 1e-6, 0])
    expected = -(attitude(THETA + h) @ R - attitude(THETA - h) @ R) / 2e-6
    np.testing.assert_allclose(moved.start[6:9].imag / step, expected, atol=1e-9)
