"""Attitudes and angles are read as people write them: in degrees, as rotations, or refused."""

from fractions import Fraction
from math import pi, radians
from typing import Any

import numpy as np
import pytest
from support.configs import BY_VARIANT, PERMANENT, VISCO_ELASTIC, plain
from support.leg import held

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config, resolved, run_id
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.simulate import simulate
from rbstab.mechanics.attitude import quaternions, rotation, rotations
from rbstab.sweep.plan.load import load_plan, plan_data

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
def test_an_attitude_as_a_rotation(given, degrees):
    config = load_config({**plain(PERMANENT), "initial": {"orientation": given}})
    assert config.initial.orientation == pytest.approx([radians(x) for x in degrees], abs=1e-7)
    A = rotation(np.array(config.initial.orientation))
    if "matrix" in given:
        assert pytest.approx(np.array(given["matrix"]), abs=1e-15) == A


def base_in_degrees(**elements):
    start = {"orientation": {"deg": [1, 0, 0]}, "angular_velocity": {"deg": [0, 0, 90]}}
    return held(**start) | {
        "integration": {"duration": 0.1, "samples": 2},
        "schema_version": 2,
        "elements": elements,
    }


def test_a_result_has_its_rotations():
    given = {"orientation": {"quaternion": [0.5**0.5, 0, 0, 0.5**0.5]}}
    result = simulate({**base_in_degrees(), "initial": given})
    expected = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert result.rotation[0] == pytest.approx(expected, abs=1e-15)
    assert abs(result.quaternion[0] @ given["orientation"]["quaternion"]) == pytest.approx(1)


def test_quaternions_of_a_motion_do_not_jump():
    """A body that turns about x: half the angle, through more than a turn."""
    angle = np.linspace(0, 9, 200)
    Theta = np.stack([angle, 0 * angle, 0 * angle], axis=1)
    computed = quaternions(rotations(Theta))
    expected = np.stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle], axis=1)
    assert computed == pytest.approx(expected * np.sign(computed[0, 0]), abs=1e-12)


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_degrees_are_the_same_config_as_their_radians(variant):
    data = plain(BY_VARIANT[variant]) | {"schema_version": 2}
    guard = {"kind": "guard", "method": "stiff", "stiffness": 1000}

    def config(angles: Any) -> Any:
        initial = {
            "orientation": angles([170, -80.5, 0.25]),
            "angular_velocity": angles([360, -90, 1e-3]),
        }
        elements = {"guard": guard | {"soft_angle": angles(85)}}
        return load_config({**data, "initial": initial, "elements": elements})

    in_degrees = config(lambda degrees: {"deg": degrees})
    expected = config(lambda x: radians(x) if isinstance(x, int) else [radians(y) for y in x])
    assert (in_degrees, run_id(in_degrees)) == (expected, run_id(expected))
    assert resolved(in_degrees)["initial"]["angular_velocity"][0] == 2 * pi


KEY, RIGHT = "initial.angular_velocity[2]", "initial.angular_velocity.deg[2]"


def plan_of(key, distribution, base=None):
    return {"base": base or base_in_degrees(), "vary": {key: distribution}}


def test_one_key_has_one_unit():
    """Wherever numbers are named, a key in radians of a value in degrees is refused."""
    values = {"values": [0, 0.45]}
    config = load_config(base_in_degrees())
    guard = {"kind": "guard", "method": "stiff", "stiffness": 9, "soft_angle": {"deg": 60}}
    guarded = base_in_degrees(deg=guard)
    for wrong, expected in (
        (lambda: load_plan(plan_of(KEY, values)), RIGHT),
        (lambda: load_config(base_in_degrees(), [f"{KEY}=45"]), RIGHT),
        (lambda: tolerances_of(config, [f"{KEY}=±5"]), RIGHT),
        (lambda: load_plan(plan_of("body.mass.deg", values)), "body.mass"),
        (
            lambda: load_plan(plan_of("elements.deg.soft_angle", values, guarded)),
            "elements.deg.soft_angle.deg",
        ),
    ):
        with pytest.raises(ConfigError) as caught:
            wrong()
        assert str(caught.value).endswith(f"(expected {expected})")
    # A factor means the same in every unit.
    scaled = load_plan(plan_of("initial.angular_velocity", {"scale": {"values": [1, 0.5]}}))
    assert scaled.config_of(1).initial.angular_velocity[2] == radians(45)
    (tolerance,) = tolerances_of(config, [f"{KEY}=±10%"])
    assert float(tolerance.radius) == pytest.approx(radians(9), rel=1e-15)
    plan = load_plan(plan_of("elements.deg.soft_angle.deg", {"values": [30, 40]}, guarded))
    assert plan.config_of(0).elements["deg"].soft_angle == radians(30)


@pytest.mark.parametrize("initial", [base_in_degrees()["initial"], {}])
def test_a_key_in_degrees_means_degrees(initial):
    """Also where the base is in radians, such as that of a stored plan."""
    base = base_in_degrees() | {"initial": initial}
    plan = load_plan(plan_of(RIGHT, {"values": [0, 45, 90]}, base))
    rates = [plan.config_of(member).initial.angular_velocity[2] for member in range(3)]
    assert rates == [0, radians(45), radians(90)]
    assert [varied.key for varied in load_plan(plan_data(plan)).varied_keys] == [RIGHT]
    changed = load_config(base, [f"{RIGHT}=45"])
    assert changed.initial.angular_velocity[2] == radians(45)
    (tolerance,) = tolerances_of(load_config(base), [f"{RIGHT}=±5"])
    # Rounded up: no start within 5° is left out. These are the first digits of π/180.
    assert 0 < tolerance.radius / 5 - Fraction("0.017453292519943295769236907") < 1e-20


READS = "expected other coordinates, or elements that do not: no K_r, guards or Python"
STOP = {"kind": "guard", "method": "stop", "angle": 1.2, "restitution": 0.5}
BARRIER = {"kind": "guard", "method": "barrier", "stiffness": 1.0}


def in_quaternions(text=VISCO_ELASTIC, elements=None, K_r=0):
    data = plain(text) | {"schema_version": 2, "elements": elements or {}}
    data["controller"]["K_r"] = K_r
    data["integration"]["coordinates"] = "quaternion"
    return data


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (in_quaternions(K_r=[0, 0, 1e-6]), "controller.K_r"),
        (in_quaternions(K_r=[[0, 0, 0], [0, 1, 0], [0, 0, 0]]), "controller.K_r"),
        (in_quaternions(elements={"stop": STOP}), "stop"),
        (in_quaternions(elements={"rim": BARRIER}, K_r=[1, 1, 1]), "controller.K_r, rim"),
        (in_quaternions(PERMANENT, K_r=[1, 1, 1]), "controller.K_r"),
    ],
)
def test_quaternions_are_refused_where_an_element_reads_angles(data, what):
    with pytest.raises(ConfigError) as error:
        load_config(data)
    assert str(error.value).endswith(
        f"integration: has coordinates: quaternion, but {what} may read Euler angles ({READS})"
    )


def test_in_quaternions_a_start_at_the_pole_is_one_as_any_other():
    data = in_quaternions(PERMANENT)
    data["initial"]["orientation"] = [0.1, 1.5707963267948, 0.2]
    config = load_config(data)
    assert config.integration.coordinates == "quaternion"
    assert "drift_control" not in resolved(config)["integration"]
    data["integration"]["coordinates"] = "reduced"
    with pytest.raises(ConfigError, match="cos θ2"):
        load_config(data)
    assert run_id(load_config(data, ["initial={}"])) != run_id(
        load_config(data, ["initial={}", "integration.coordinates=quaternion"])
    )
