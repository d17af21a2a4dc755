"""Protects angles in degrees: `{deg: [...]}` means the same config as the radians, and says so by
its run id; only keys that are angles take it.
"""

from math import pi, radians

import pytest
from support.configs import BY_VARIANT, VISCO_ELASTIC, edited, plain
from support.json_schemas import schema_errors, validator_of

from rbstab.config.load import load_config, resolved, run_id
from rbstab.config.schema import json_schema

ZERO = "orientation: [0, 0, 0]"

GUARD = {"kind": "guard", "method": "stiff", "stiffness": 1000, "soft_angle": {"deg": 60}}


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_the_same_config_as_its_radians(variant: str) -> None:
    data = plain(BY_VARIANT[variant])
    degrees, rates = [170, -80.5, 0.25], [360, -90, 1e-3]
    given = {"orientation": {"deg": degrees}, "angular_velocity": {"deg": rates}}
    found = load_config({**data, "initial": given})
    in_radians = {
        "orientation": [radians(x) for x in degrees],
        "angular_velocity": [radians(x) for x in rates],
    }
    expected = load_config({**data, "initial": in_radians})
    assert found == expected
    assert run_id(found) == run_id(expected)
    assert resolved(found)["initial"]["angular_velocity"][0] == 2 * pi
    assert load_config(resolved(found)) == found


def test_from_the_command_line() -> None:
    found = load_config(plain(VISCO_ELASTIC), ["initial.orientation={deg: [0, 45, 0]}"])
    assert found.initial.orientation == (0.0, pi / 4, 0.0)


def test_an_angle_of_an_element() -> None:
    data = plain(VISCO_ELASTIC) | {"schema_version": 2, "elements": {"guard": GUARD}}
    assert load_config(data).elements["guard"].soft_angle == radians(60)
    for wrong in ({"deg": 95}, {"deg": "60"}, {"deg": 60, "rad": 1}):
        with pytest.raises(ValueError, match=r"elements\.guard\.soft_angle"):
            load_config(data | {"elements": {"guard": GUARD | {"soft_angle": wrong}}})


def test_editors_know_it() -> None:
    validator = validator_of(json_schema())
    for text in ("{deg: [0, 10, 0]}", "[0, 0.1, 0]"):
        assert schema_errors(validator, edited(ZERO, f"orientation: {text}")) == []
    for text in ("{deg: [0, 10]}", "{deg: 10}", "{rad: [0, 1, 0]}", "{deg: [0, 1, 0], rad: 1}"):
        assert schema_errors(validator, edited(ZERO, f"orientation: {text}")) != []
