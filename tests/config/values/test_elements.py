"""Protects the section `elements`: its values, its messages, and what schema version 1 refuses."""

import json
from typing import Any

import pytest
import yaml
from support.config_elements import (
    ONE_OF_EACH,
    RANGE,
    STRUT,
    TIE,
    UPRIGHT,
    YAML,
    config_data,
)
from support.configs import BY_VARIANT, plain
from support.json_schemas import schema_errors, validator_of

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.config.schema import json_schema
from rbstab.config.units import unit_of


def element(**changes):
    """Return a valid config, with one element that has changes."""
    return config_data({"one": STRUT | changes})


def problems(data, *changes):
    """Return the problems of plain data, without their place."""
    with pytest.raises(ConfigError) as caught:
        load_config(data, changes)
    return [str(problem).partition(": ")[2] for problem in caught.value.problems]


NO_NAMES = ["", "A", "1a", "_a", "a-b", "a b", "a.b", "ä", "x" * 41, "a\n"]
RESERVED = ["anchor", "body", "connector", "gravity", "kinetic"]


@pytest.mark.parametrize("name", [*NO_NAMES, *RESERVED])
def test_names_that_are_none(name):
    (found,) = problems(config_data({name: STRUT}))
    expected = "is a name that every system uses" if name in RESERVED else "is not a name of an"
    assert expected in found


@pytest.mark.parametrize("name", ["a", "strut", "a1_b", "x" * 40, "a__", "connector2"])
def test_names(name):
    assert list(load_config(config_data({name: STRUT})).elements) == [name]


def test_at_most_a_hundred():
    many = {f"e{index}": UPRIGHT for index in range(101)}
    assert problems(config_data(many)) == ["elements: has 101 entries (expected at most 100)"]
    many.pop("e7")
    assert len(load_config(config_data(many)).elements) == 100


@pytest.mark.parametrize("kind", ONE_OF_EACH)
def test_each_key_without_a_default_is_required(kind):
    whole = ONE_OF_EACH[kind]
    for key in set(whole) - {"damping", "outer_stiffness", "kind"}:
        less = {name: value for name, value in whole.items() if name != key}
        words = "it is required"
        if key == "method":
            words = "expected one of barrier, stiff, repelling, stop"
        expected = [f"elements.one.{key}: is missing ({words})"]
        assert problems(config_data({"one": less})) == expected


# Schema versions, and the controller.


def test_version_one_has_no_variant_none():
    data = config_data({}, {"variant": "none"}) | {"schema_version": 1}
    del data["elements"]
    assert problems(data) == [
        "controller: has the variant none (expected schema_version: 2 beside it)"
    ]


def test_version_two_without_a_controller_has_the_variant_none():
    absent, stated = load_config(config_data(controller=None)), {"variant": "none"}
    assert absent.controller.variant == "none"
    assert load_config(config_data(controller=stated)) == absent
    assert load_config(config_data({}, None)).elements == {}
    wrong = problems(config_data({}, stated | {"K_t": [1.0, 1.0, 1.0]}))
    assert wrong[0].startswith("controller.K_t: is not a key of the variant none")
    wrong_ones: list[Any] = [None, {}, 5]
    for controller in wrong_ones:
        data = config_data() | {"controller": controller}
        assert problems(data)[0].startswith("controller")


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_elements_beside_every_controller(variant):
    data = plain(BY_VARIANT[variant]) | {"schema_version": 2, "elements": ONE_OF_EACH}
    config = load_config(data)
    assert config.controller.variant == variant
    assert list(config.elements) == sorted(ONE_OF_EACH)


# Changes from the command line.


def test_set_of_a_value_that_the_file_leaves_out(load):
    assert load(YAML, "elements.strut.damping=7").elements["strut"].damping == 7.0
    # Without a controller, the initial state has its defaults too.
    assert load(YAML, "initial.position[2]=0.5").initial.position == (0.0, 0.0, 0.5)


# Units, in the files of sweeps and in reports.


@pytest.mark.parametrize(
    ("key", "kinds", "unit"),
    [
        ("elements.strut.stiffness", [("spring", None)], "N/m"),
        ("elements.strut.stiffness", [("guard", "barrier")], "N m"),
        ("elements.strut.stiffness", [("guard", "stiff")], "N m/rad"),
        ("elements.strut.stiffness", [("spring", None), ("guard", "barrier")], ""),
        ("elements.strut.point", [("spring", None), ("visco-elastic", None)], "m"),
        ("elements.upright.L", [("attitude", None)], "N m s/rad"),
        ("elements.tie.L_c", [("visco-elastic", None)], "N s/m"),
        ("elements.strut.kind", [("spring", None)], ""),
        ("elements.strut.stiffness", [], ""),
        ("controller.L_c", [], "N s/m"),
    ],
)
def test_units(key, kinds, unit):
    assert unit_of(key, kinds) == unit


# The JSON Schema accepts and refuses the same.


@pytest.fixture(scope="module")
def validator():
    return validator_of(json_schema())


def as_text(data):
    """Return plain data as YAML without aliases, by way of JSON."""
    return yaml.safe_dump(json.loads(json.dumps(data)))


def test_schema_has_the_kinds_with_their_units():
    found = json_schema()["$defs"]
    expected = {
        "SpringElement": {"kind", *STRUT},
        "ViscoElasticElement": set(TIE),
        "AttitudeElement": set(UPRIGHT),
        "BarrierGuardElement": set(RANGE),
    }
    for name, keys in expected.items():
        assert set(found[name]["properties"]) == keys
        assert found[name]["additionalProperties"] is False
    assert found["SpringElement"]["properties"]["damping"]["default"] == 0
    assert found["SpringElement"]["properties"]["stiffness"]["description"].endswith("N/m")
    assert found["ViscoElasticElement"]["properties"]["point"]["description"].startswith("point")


ACCEPTED = [
    YAML,
    as_text(config_data()),
    as_text(config_data({})),
    as_text(config_data(controller=None)),
    as_text(config_data(controller={"variant": "none"})),
    as_text(plain(BY_VARIANT["permanent"]) | {"schema_version": 2, "elements": ONE_OF_EACH}),
]


@pytest.mark.parametrize("text", ACCEPTED)
def test_both_accept(validator, load, text):
    load(text)
    assert schema_errors(validator, text) == []
