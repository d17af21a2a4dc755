"""Protects inputs as people write them: they are read as meant, or refused with what to write."""

from fractions import Fraction
from math import radians
from typing import Any

import numpy as np
import pytest
from support.configs import PERMANENT, PLAN, VISCO_ELASTIC, edited, messages_of, plain
from support.leg import held

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.simulate import simulate
from rbstab.mechanics.attitude import quaternions, rotation, rotations
from rbstab.sweep.plan.dump import plan_data
from rbstab.sweep.plan.load import load_plan


def test_a_matrix_of_numpy_is_symmetric_to_round_off() -> None:
    R = rotation(np.array([0.3, 0.5, -0.7]))
    J = R @ np.diag([3.0, 2.0, 1.5]) @ R.T
    J[0, 1] += 1e-13
    assert (J != J.T).any()
    data = plain(VISCO_ELASTIC)
    data["body"]["inertia"] = J.tolist()
    read = np.array(load_config(data).body.inertia)
    assert (read == read.T).all()
    assert np.abs(read - J).max() < 1e-12


WHOLE = {"samples": 1e3, "step_limit": 1e6}


def test_whole_floats_are_whole_numbers() -> None:
    data = plain(VISCO_ELASTIC) | {"schema_version": 1.0}
    data["integration"] |= WHOLE
    found = load_config(data)
    assert (found.integration.samples, found.integration.step_limit) == (1000, 1000000)
    assert type(found.integration.samples) is int
    plan = {"base": data, "design": "random", "members": 1e1, "seed": 3.0}
    vary: dict[str, Any] = {"body.mass": {"uniform": [1, 2]}}
    assert load_plan({**plan, "vary": vary}).members == 10
    lists = {"body.mass": {"linspace": [1, 2, 5e0]}}
    assert load_plan({"base": data, "vary": lists}).members == 5


# By hand: 90° about z; the composition of turns about x, the new y and the new z.
ROTATIONS = [
    ({"matrix": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}, (0, 0, 90)),
    ({"matrix": [[1, 0, 0], [0, 0, -1], [0, 1, 0]]}, (90, 0, 0)),
    ({"quaternion": [0.5**0.5, 0, 0, 0.5**0.5]}, (0, 0, 90)),
    ({"quaternion": [-(0.5**0.5), -(0.5**0.5), 0, 0]}, (90, 0, 0)),
    ({"quaternion": [0.8660254, 0, 0.5, 0]}, (0, 60, 0)),
    # A turn of 90° about x, and then of 60° about the new y, which is z.
    ({"quaternion": [0.61237244, 0.61237244, 0.35355339, 0.35355339]}, (90, 60, 0)),
]


@pytest.mark.parametrize(("given", "degrees"), ROTATIONS)
def test_an_attitude_as_a_rotation(given: dict[str, Any], degrees: tuple[float, ...]) -> None:
    found = load_config({**plain(PERMANENT), "initial": {"orientation": given}})
    assert found.initial.orientation == pytest.approx([radians(x) for x in degrees], abs=1e-7)
    A = rotation(np.array(found.initial.orientation))
    if "matrix" in given:
        assert pytest.approx(np.array(given["matrix"]), abs=1e-15) == A


def test_a_result_has_its_rotations() -> None:
    given = {"orientation": {"quaternion": [0.5**0.5, 0, 0, 0.5**0.5]}}
    result = simulate({**base_in_degrees(), "initial": given})
    assert result.rotation.shape == (2, 3, 3)
    assert result.quaternion.shape == (2, 4)
    assert result.rotation[0] == pytest.approx(
        np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-15
    )
    assert abs(result.quaternion[0] @ given["orientation"]["quaternion"]) == pytest.approx(1)


def test_quaternions_of_a_motion_do_not_jump() -> None:
    """A body that turns about x: half the angle, through more than a turn."""
    angle = np.linspace(0, 9, 200)
    Theta = np.stack([angle, 0 * angle, 0 * angle], axis=1)
    found = quaternions(rotations(Theta))
    expected = np.stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle], axis=1)
    assert found == pytest.approx(expected * np.sign(found[0, 0]), abs=1e-12)


IN_DEGREES = {"orientation": {"deg": [1, 0, 0]}, "angular_velocity": {"deg": [0, 0, 90]}}

KEY, RIGHT = "initial.angular_velocity[2]", "initial.angular_velocity.deg[2]"


def base_in_degrees() -> dict[str, Any]:
    """Return a body of which v(0) is 0.1699 J at 90 degrees per second about z."""
    return held(**IN_DEGREES) | {"integration": {"duration": 0.1, "samples": 2}}


def plan_of(key: str, distribution: dict[str, Any], base: Any = None) -> dict[str, Any]:
    return {"base": base or base_in_degrees(), "vary": {key: distribution}}


def test_one_key_has_one_unit() -> None:
    """Wherever numbers are named, a key in radians of a value in degrees is refused."""
    values = {"values": [0, 45, 90]}
    expected = f"is in radians, but the config gives degrees (expected {RIGHT})"
    config = load_config(base_in_degrees())
    for wrong in (
        lambda: load_plan(plan_of(KEY, values)),
        lambda: load_config(base_in_degrees(), [f"{KEY}=45"]),
        lambda: tolerances_of(config, [f"{KEY}=±5"]),
    ):
        with pytest.raises(ConfigError) as caught:
            wrong()
        assert str(caught.value).endswith(expected)
    with pytest.raises(
        ConfigError, match=r"body\.mass\.deg: is not an angle \(expected body\.mass\)"
    ):
        load_plan(plan_of("body.mass.deg", values))
    # A factor means the same in every unit.
    scaled = load_plan(plan_of("initial.angular_velocity", {"scale": {"values": [1, 0.5]}}))
    assert scaled.config_of(1).initial.angular_velocity[2] == radians(45)
    (tolerance,) = tolerances_of(config, [f"{KEY}=±10%"])
    assert float(tolerance.radius) == pytest.approx(radians(9), rel=1e-15)


@pytest.mark.parametrize("base", [None, base_in_degrees() | {"initial": {}}])
def test_a_key_in_degrees(base: Any) -> None:
    """It means degrees also where the base is in radians, such as that of a stored plan."""
    plan = load_plan(plan_of(RIGHT, {"values": [0, 45, 90]}, base))
    configs = [plan.config_of(member) for member in range(3)]
    rates = [config.initial.angular_velocity[2] for config in configs]
    assert rates == [0, radians(45), radians(90)]
    assert [varied.key for varied in load_plan(plan_data(plan)).varied_keys] == [RIGHT]
    changed = load_config(base or base_in_degrees(), [f"{RIGHT}=45"])
    assert changed.initial.angular_velocity[2] == radians(45)
    config = load_config(base or base_in_degrees())
    (tolerance,) = tolerances_of(config, [f"{RIGHT}=±5"])
    # Rounded up: no start within 5° is left out. These are the first digits of π/180.
    assert 0 < tolerance.radius / 5 - Fraction("0.017453292519943295769236907") < 1e-20


def test_the_energy_of_a_member_in_degrees() -> None:
    plan = load_plan(plan_of(RIGHT, {"values": [0, 45, 90]}))
    assert simulate(plan.config_of(2))["lyapunov"][0] == pytest.approx(0.1699, abs=5e-5)


def test_an_angle_of_an_element_in_degrees() -> None:
    guard = {"kind": "guard", "method": "stiff", "stiffness": 1000, "soft_angle": {"deg": 60}}
    base = base_in_degrees() | {"schema_version": 2, "elements": {"deg": guard}}
    plan = load_plan(plan_of("elements.deg.soft_angle.deg", {"values": [30, 40]}, base))
    assert plan.config_of(0).elements["deg"].soft_angle == radians(30)
    with pytest.raises(ConfigError, match=r"expected elements\.deg\.soft_angle\.deg"):
        load_plan(plan_of("elements.deg.soft_angle", {"values": [0.3, 0.4]}, base))


def test_a_start_beyond_the_range_in_a_plan(tmp_path) -> None:
    (tmp_path / "visco-elastic.yaml").write_text(VISCO_ELASTIC)
    plan = tmp_path / "plan.yaml"
    plan.write_text(
        edited(
            "body.mass: {values: [40, 50]}",
            "initial.orientation.deg[1]: {values: [0, 89.99]}",
            PLAN,
        )
    )
    (message,) = messages_of(load_plan, plan, ())
    assert "at member 1 initial.orientation has cos θ2 = 0.00017" in message
