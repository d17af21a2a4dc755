"""The initial orientation must lie in the range of eq. 5; the message names it in degrees too."""

import math

import pytest
from support.configs import edited

ORIENTATION = "orientation: [0, 0, 0]"

OUTSIDE = (
    "is outside the range of eq. 5 (expected θ1 and θ3 between ±180°, θ2 inside of ±90°; degrees "
    "are {deg: [...]})"
)

REFUSED = [
    ("[0, 1.6, 0]", "θ2 = 1.6 rad (91.6732°)"),
    ("[0, -1.6, 0]", "θ2 = -1.6 rad (-91.6732°)"),
    ("[4, 0, 0]", "θ1 = 4 rad (229.183°)"),
    ("[0, 0, -4]", "θ3 = -4 rad (-229.183°)"),
    ("[0, 90, 0]", "θ2 = 90 rad (5156.62°)"),
    # B(Θ) is singular at the bound itself.
    (f"[0, {math.pi / 2!r}, 0]", "θ2 = 1.5708 rad (90°)"),
    (f"[0, {-math.pi / 2!r}, 0]", "θ2 = -1.5708 rad (-90°)"),
    ("[3.15, 0, 0]", "θ1 = 3.15 rad (180.482°)"),
]


@pytest.mark.parametrize(("value", "expected"), REFUSED)
def test_refused(complaints, value, expected):
    (message,) = complaints(edited(ORIENTATION, f"orientation: {value}"))
    assert message == f"15:16: initial.orientation: {expected} {OUTSIDE}"


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
    (message,) = complaints(edited(ORIENTATION, "orientation: [90, 2, -90]"))
    assert message.startswith(
        "15:16: initial.orientation: θ1 = 90 rad (5156.62°), θ2 = 2 rad (114.592°), "
        "θ3 = -90 rad (-5156.62°) are outside the range of eq. 5 ("
    )
