"""Protects the config of elements that switch: keys, ranges, defaults, methods and combinations."""

import pickle

import pytest
from support.switching import data, guard, ligament

from rbstab.config.build import problem_of
from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config, resolved
from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.guards.soft_guards import RepellingGuard, StiffGuard
from rbstab.elements.ligament import Ligament
from rbstab.systems.parameters import parameters


def said(elements, **sections):
    """Return the messages of a wrong config, without the place in the file."""
    with pytest.raises(ConfigError) as caught:
        load_config(data(elements, **sections))
    return [str(line).partition(": ")[2] for line in str(caught.value).splitlines()]


@pytest.mark.parametrize(
    ("section", "kind"),
    [
        (ligament(), Ligament),
        (guard("stiff", 4.0), StiffGuard),
        (guard("repelling", 4.0), RepellingGuard),
        ({"kind": "guard", "method": "barrier", "stiffness": 4.0}, Barrier),
    ],
)
def test_kind_and_method_choose_the_element(section, kind):
    config = load_config(data({"it": section}))
    assert type(problem_of(config).system.elements[-1]) is kind
    given = resolved(config)["elements"]["it"]
    assert {key: given[key] for key in ("kind", "method") if key in given} == {
        key: section[key] for key in ("kind", "method") if key in section
    }
    again = pickle.loads(pickle.dumps(config))  # noqa: S301  # made on the same line
    assert again == config


def test_numbers_reach_the_element():
    config = load_config(data({"a": ligament(damping=3.0), "b": ligament()}))
    numbers = parameters(problem_of(config).system)
    found = [numbers[f"a.{name}"] for name in ("stiffness", "slack_length", "toe_strain")]
    assert found == [80.0, 1.0, 0.05]
    assert [numbers["a.damping"], numbers["b.damping"]] == [3.0, 0.0]
    soft = parameters(problem_of(load_config(data({"a": guard("repelling", 7.0, 0.4)}))).system)
    assert [soft["a.couple"], soft["a.soft_angle"]] == [7.0, 0.4]


@pytest.mark.parametrize("method", ["stiff", "repelling"])
@pytest.mark.parametrize(
    ("angle", "message"),
    [
        (0.0, "is 0 (expected a number greater than 0)"),
        (-0.3, "is -0.3 (expected a number greater than 0)"),
        (1.6, "is 1.6 (expected a number less than 1.57079632679)"),
    ],
)
def test_soft_angle_is_within_the_range(method, angle, message):
    assert said({"it": guard(method, 4.0, angle)}) == [f"elements.it.soft_angle: {message}"]
    load_config(data({"it": guard(method, 4.0, 1.57)}))


def test_methods_that_cannot_stop_at_a_switch_are_refused():
    (message,) = said({"it": ligament()}, integration={"method": "LSODA"})
    assert message.startswith("integration: has method: LSODA")
    assert "of it" in message
    for method in ("DOP853", "RK45", "Radau"):
        load_config(data({"it": ligament()}, integration={"method": method}))
    # heyoka does not use the method; a smooth element may be integrated by LSODA.
    load_config(data({"it": ligament()}, integration={"method": "LSODA", "engine": "heyoka"}))
    smooth = {"kind": "guard", "method": "barrier", "stiffness": 4.0}
    load_config(data({"it": smooth}, integration={"method": "LSODA"}))


STABILIZERS = {"K_t": [1, 1, 1], "L_t": [1, 1, 1], "K_r": [1, 1, 1], "L_r": [1, 1, 1]}


def test_projection_is_refused():
    held = {"variant": "permanent"} | STABILIZERS
    settings = {"coordinates": "manifold", "drift_control": "projection"}
    config = {"integration": settings, "controller": held}
    (message,) = said({"it": ligament()}, **config)
    assert message.startswith("integration: has drift_control: projection")


def test_implicit_steps_of_a_sliding_connector_are_refused_beside_them():
    sliding = {"variant": "sliding", "K_s": [1, 1, 1], "surface": "position"} | STABILIZERS
    settings = {"coordinates": "W"}
    load_config(data({"it": ligament()}, controller=sliding, integration=settings))
    implicit = sliding | {"law": {"implicit": 1e-3}}
    (message,) = said({"it": ligament()}, controller=implicit, integration=settings)
    assert message.startswith("elements: has it beside a sliding connector with implicit steps")
