"""Protects the config of a stop: its keys and ranges, one of them, and the start inside it."""

import pytest
from support.stops import stop
from support.switching import data, guard

from rbstab.config.build import problem_of
from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.elements.guards.stop import Stop
from rbstab.systems.parameters import parameters


def said(elements, **sections):
    """Return the messages of a wrong config, without the place in the file."""
    with pytest.raises(ConfigError) as caught:
        load_config(data(elements, **sections))
    return [str(line).partition(": ")[2] for line in str(caught.value).splitlines()]


@pytest.mark.parametrize("restitution", [0, 0.5, 1])
def test_numbers_reach_the_element(restitution):
    problem = problem_of(load_config(data({"end": stop(restitution, 0.7)})))
    (element,) = [one for one in problem.system.elements if isinstance(one, Stop)]
    numbers = parameters(problem.system)
    assert [numbers["end.angle"], numbers["end.restitution"]] == [0.7, restitution]
    assert element.mode.tolist() == [0, 0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"restitution": 1.01}, "restitution: is 1.01 (expected a number at most 1)"),
        ({"restitution": -0.1}, "restitution: is -0.1 (expected a number at least 0)"),
        ({"angle": 0}, "angle: is 0 (expected a number greater than 0)"),
        ({"angle": 1.6}, "angle: is 1.6 (expected a number less than 1.57079632679)"),
        ({"soft_angle": 0.2}, "soft_angle: is unknown"),
    ],
)
def test_wrong_numbers(change, message):
    (found,) = said({"end": stop() | change})
    assert found.startswith(f"elements.end.{message}")


def test_one_stop():
    expected = "(expected one: the body would never reach the others)"
    found = said({"a": stop(), "b": stop(angle=0.4)})
    assert found == [f"elements: has several stops: a, b {expected}"]


@pytest.mark.parametrize("angle", [0.3, 0.31])
def test_a_soft_guard_acts_inside_the_stop(angle):
    found = said({"end": stop(), "soft": guard("repelling", 4.0, angle)})
    message = "elements: has a soft_angle that is not inside the stop end: soft"
    assert found == [f"{message} (expected less than 0.3)"]
    load_config(data({"end": stop(), "soft": guard("repelling", 4.0, 0.29)}))


@pytest.mark.parametrize("pitch", [0.301, -0.301])
def test_a_motion_starts_inside(pitch):
    found = said({"end": stop()}, initial={"orientation": [2.0, pitch, 2.0]})
    message = "initial: has |θ2| = 0.301 rad, beyond the stop end"
    assert found == [f"{message} (expected orientation[1] between ±0.3)"]
    load_config(data({"end": stop()}, {"orientation": [2.0, -0.3, 2.0]}))


def test_a_wrong_stop_hides_no_other_message():
    found = said({"end": stop() | {"angle": "x"}}, initial={"orientation": [0, "y", 0]})
    assert [line.partition(":")[0] for line in found] == [
        "elements.end.angle",
        "initial.orientation[1]",
    ]
