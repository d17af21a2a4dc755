"""The initial orientation must lie in the range of eq. 5; the message suspects degrees."""

import math

import pytest
from support.configs import edited

ORIENTATION = "orientation: [0, 0, 0]"

REFUSED = [
    ("[0, 1.6, 0]", "θ2 = 1.6 rad is outside the range of eq. 5 (expected between -π/2 and π/2)"),
    ("[0, -1.6, 0]", "θ2 = -1.6 rad is outside the range of eq. 5 (expected between -π/2 and π/2)"),
    ("[4, 0, 0]", "θ1 = 4 rad is outside the range of eq. 5 (expected between -π and π)"),
    ("[0, 0, -4]", "θ3 = -4 rad is outside the range of eq. 5 (expected between -π and π)"),
    ("[0, 90, 0]", "θ2 = 90 rad is outside the range of eq. 5; degrees? (expected between -π/2"),
    ("[-180, 0, 0]", "θ1 = -180 rad is outside the range of eq. 5; degrees? (expected between -π"),
    ("[0, 0, 10]", "θ3 = 10 rad is outside the range of eq. 5; degrees? (expected between -π and"),
    ("[0, 6.3, 0]", "θ2 = 6.3 rad is outside the range of eq. 5; degrees? ("),
    ("[0, 6.2, 0]", "θ2 = 6.2 rad is outside the range of eq. 5 ("),
    # B(Θ) is singular at the bound itself.
    (f"[0, {math.pi / 2!r}, 0]", "θ2 = 1.5708 rad is outside the range of eq. 5 ("),
    (f"[0, {-math.pi / 2!r}, 0]", "θ2 = -1.5708 rad is outside the range of eq. 5 ("),
    ("[3.15, 0, 0]", "θ1 = 3.15 rad is outside the range of eq. 5 ("),
]


@pytest.mark.parametrize(("value", "expected"), REFUSED)
def test_refused(complaints, value, expected):
    (message,) = complaints(edited(ORIENTATION, f"orientation: {value}"))
    assert message.startswith(f"15:16: initial.orientation: {expected}")


ACCEPTED = [
    (0.0, 1.569, 0.0),
    (0.0, -1.569, 0.0),
    (math.pi, 0.0, -math.pi),
    (-math.pi, 0.0, math.pi),
    (3.0, 0.0, 3.0),
]


@pytest.mark.parametrize("value", ACCEPTED)
def test_accepted(load, value):
    config = load(edited(ORIENTATION, f"orientation: {list(value)}"))
    assert config.initial.orientation == value


def test_a_number_that_is_not_finite_is_told_as_such(complaints):
    found = complaints(edited(ORIENTATION, "orientation: [0, .nan, 0]"))
    assert found == ["15:20: initial.orientation[1]: is nan (expected a finite number)"]


def test_every_angle_outside_is_reported(complaints):
    assert complaints(edited(ORIENTATION, "orientation: [90, 2, -90]")) == [
        "15:16: initial.orientation: θ1 = 90 rad, θ2 = 2 rad, θ3 = -90 rad are outside the range "
        "of eq. 5; degrees? (expected between -π and π, -π/2 and π/2, -π and π)"
    ]
