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


def with_angles(text: str) -> str:
    return edited(ZERO, f"orientation: {text}")


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


WRONG = [
    (
        "{deg: [0, 90, 0]}",
        "θ2 = 1.5708 rad (90°) is outside the range of eq. 5 (expected ",
    ),
    (
        "{deg: [181, 0, 0]}",
        "θ1 = 3.15905 rad (181°) is outside the range of eq. 5 (expected ",
    ),
    (
        "20deg",
        "initial.orientation: is the text '20deg' (expected a list of 3, or {deg: [0, 20, 0]})",
    ),
    ("{deg: 5}", "initial.orientation.deg: is 5 (expected a list of 3)"),
    ("{deg: [0, 1]}", "initial.orientation.deg: has 2 entries (expected 3)"),
    ("{deg: [0, x, 1]}", "initial.orientation.deg[1]: is the text 'x' (expected a number)"),
    ("{deg: [0, .nan, 1]}", "initial.orientation.deg[1]: is nan (expected a finite number)"),
    ("{}", "initial.orientation.deg: is missing (it is required)"),
    ("{degs: [0, 1, 1]}", "initial.orientation.degs: is unknown (did you mean deg?)"),
]


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_wrong_degrees(complaints, text: str, message: str) -> None:
    found = complaints(with_angles(text))
    assert any(message in line for line in found), found
    # The place is that of the value itself, in line 15.
    assert all(line.startswith("15:") for line in found)


def test_a_text_in_place_of_one_angle_names_degrees() -> None:
    data = plain(VISCO_ELASTIC) | {"schema_version": 2}
    with pytest.raises(ValueError, match=r"is the text '70deg' \(expected a number, or \{deg: 20"):
        load_config(data | {"elements": {"guard": GUARD | {"soft_angle": "70deg"}}})


def test_only_angles_take_degrees(complaints) -> None:
    (found,) = complaints(edited("[0.15, 0.10, -0.42]", "{deg: [0, 0, 0]}"))
    assert found.endswith("body.contact_point: is a mapping (expected a list of 3)")
    elements = {"guard": GUARD | {"stiffness": {"deg": 60}}}
    with pytest.raises(ValueError, match=r"elements\.guard\.stiffness: is a mapping"):
        load_config(plain(VISCO_ELASTIC) | {"schema_version": 2, "elements": elements})


def test_editors_know_it() -> None:
    validator = validator_of(json_schema())
    for text in ("{deg: [0, 10, 0]}", "[0, 0.1, 0]"):
        assert schema_errors(validator, with_angles(text)) == []
    for text in ("{deg: [0, 10]}", "{deg: 10}", "{rad: [0, 1, 0]}", "{deg: [0, 1, 0], rad: 1}"):
        assert schema_errors(validator, with_angles(text)) != []
