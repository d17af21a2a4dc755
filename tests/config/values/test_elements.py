"""Protects the section `elements`: its values, its messages, and what schema version 1 refuses."""

import json
from typing import Any

import pytest
import yaml
from support.config_elements import (
    CONTROLLER,
    ONE_OF_EACH,
    RANGE,
    STRUT,
    TIE,
    UPRIGHT,
    YAML,
    config_data,
)
from support.configs import BY_VARIANT, edited, plain
from support.json_schemas import schema_errors, validator_of

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.config.schema import json_schema
from rbstab.config.units import unit_of

WRONG = """\
schema_version: 2
body: {mass: 41, inertia: [10, 8, 9], contact_point: [0.15, 0.10, -0.42]}
elements:
  Strut: {kind: spring, point: [0, 0, 0], anchor: [0, 0, 1], stiffness: 1, rest_length: 1}
  strut: {kind: spring, point: [0.02, 0], anchor: [0, x, -0.6], stiffnes: 4.0e3, rest_length: -1}
  a: {kind: sprng}
  b: {}
  c: 5
  gravity: {kind: attitude, K: [1, 1, 1], L: [1, 2, -3]}
  d: {kind: attitude, K: [[1, 1, 1], [0, 1, 1], [1, 1, 1]], L: [[1, 2, 0], [2, 1, 0], [0, 0, 1]]}
  e:
    kind: guard
    method: clip
    stiffness: 0
    outer_stiffness: -1
  f: {kind: guard, stiffness: yes, Stiffness: 1}
  b: {kind: guard}
  g: {kind: visco-elastic, point: 5, anchor: [0, 0, .inf], K_c: [1, 1], L_c: [[1, 2], 3, 4]}
  h: {kind: spring, colour: red}
  5: {kind: attitude, K: [1, 1, 1], L: [1, 1, 1]}
integration: {duration: 2}
"""

NAME = (
    "is not a name of an element "
    "(expected a lower-case letter, then up to 39 lower-case letters, digits or _)"
)
KIND = (
    "(expected one of spring, visco-elastic, embedded, sliding, attitude, ligament, python, guard, "
    "input)"
)
METHOD = "(expected one of barrier, stiff, repelling, stop)"
SPRING = KIND.replace(")", "; did you mean spring?)")
POSITIVE = "(expected a number greater than 0)"

ALL_OF_THEM = [
    f"4:3: elements.Strut: {NAME}",
    "5:10: elements.strut.stiffness: is missing (it is required)",
    "5:32: elements.strut.point: has 2 entries (expected 3)",
    "5:55: elements.strut.anchor[1]: is the text 'x' (expected a number)",
    "5:65: elements.strut.stiffnes: is unknown (did you mean stiffness?)",
    "5:95: elements.strut.rest_length: is -1 (expected a number at least 0)",
    f"6:13: elements.a.kind: is the text 'sprng' {SPRING}",
    f"7:6: elements.b.kind: is missing {KIND}",
    "8:6: elements.c: is 5 (expected a mapping with the key kind)",
    "9:3: elements.gravity: is a name that every system uses (expected another name)",
    f"9:53: elements.gravity.L[2]: is -3 {POSITIVE}",
    "10:26: elements.d.K: is not symmetric (expected a symmetric matrix)",
    "10:64: elements.d.L: is not positive definite, its smallest eigenvalue is -1 "
    "(expected positive eigenvalues)",
    f"13:13: elements.e.method: is the text 'clip' {METHOD}",
    f"16:6: elements.f.method: is missing {METHOD}",
    "17:3: elements.b: is given twice, first in line 7 (expected each key once)",
    "18:35: elements.g.point: is 5 (expected a list of 3)",
    "18:53: elements.g.anchor[2]: is inf (expected a finite number)",
    "18:65: elements.g.K_c: has 2 entries (expected 3)",
    "18:79: elements.g.L_c[0]: has 2 entries (expected 3)",
    "18:87: elements.g.L_c[1]: is 3 (expected a list of 3)",
    "18:90: elements.g.L_c[2]: is 4 (expected a list of 3)",
    "19:6: elements.h.anchor: is missing (it is required)",
    "19:6: elements.h.point: is missing (it is required)",
    "19:6: elements.h.rest_length: is missing (it is required)",
    "19:6: elements.h.stiffness: is missing (it is required)",
    "19:21: elements.h.colour: is unknown "
    "(expected one of anchor, damping, kind, point, rest_length, stiffness)",
    f"20:3: elements.5: {NAME}",
]


def test_all_at_once_in_order(complaints):
    assert complaints(WRONG) == ALL_OF_THEM


def element(**changes):
    """Return a valid config, with one element that has changes."""
    return config_data({"one": STRUT | changes})


def problems(data, *changes):
    """Return the problems of plain data, without their place."""
    with pytest.raises(ConfigError) as caught:
        load_config(data, changes)
    return [str(problem).partition(": ")[2] for problem in caught.value.problems]


@pytest.mark.parametrize("name", ["a", "strut", "a1_b", "x" * 40, "a__", "connector2"])
def test_names(name):
    assert list(load_config(config_data({name: STRUT})).elements) == [name]


@pytest.mark.parametrize("name", ["", "A", "1a", "_a", "a-b", "a b", "a.b", "ä", "x" * 41, "a\n"])
def test_names_that_are_none(name):
    (found,) = problems(config_data({name: STRUT}))
    assert NAME in found


@pytest.mark.parametrize("name", ["anchor", "body", "connector", "gravity", "kinetic"])
def test_names_that_every_system_uses(name):
    (found,) = problems(config_data({name: STRUT}))
    assert found == f"elements.{name}: is a name that every system uses (expected another name)"


@pytest.mark.parametrize("elements", [None, 5, [], "spring", [STRUT]])
def test_not_a_mapping(elements):
    data = config_data() | {"elements": elements}
    expected = "elements: is not a mapping (expected a mapping from names to elements)"
    assert problems(data) == [expected]


def test_at_most_a_hundred():
    many = {f"e{index}": UPRIGHT for index in range(101)}
    assert problems(config_data(many)) == ["elements: has 101 entries (expected at most 100)"]
    many.pop("e7")
    assert len(load_config(config_data(many)).elements) == 100


@pytest.mark.parametrize(
    ("kind", "found"),
    [
        ("zzz", "is the text 'zzz'"),
        ("", "is the text ''"),
        (5, "is 5"),
        (None, "is empty"),
        (["spring"], "is a list of 1"),
        ({"spring": 1}, "is a mapping"),
    ],
)
def test_unknown_kinds(kind, found):
    assert problems(element(kind=kind)) == [f"elements.one.kind: {found} {KIND}"]


@pytest.mark.parametrize("kind", ["Spring", "spring ", "sprong"])
def test_misspelt_kinds(kind):
    assert problems(element(kind=kind)) == [f"elements.one.kind: is the text {kind!r} {SPRING}"]


def test_no_kind():
    less = {name: value for name, value in STRUT.items() if name != "kind"}
    for one in (less, {}):
        assert problems(config_data({"one": one})) == [f"elements.one.kind: is missing {KIND}"]


@pytest.mark.parametrize(
    ("found", "wanted"),
    [("dampng", "damping"), ("rest_lenght", "rest_length"), ("Point", "point"), ("L_c", None)],
)
def test_unknown_keys(found, wanted):
    expected = f"did you mean {wanted}?" if wanted else "expected one of anchor, damping, kind, "
    (problem,) = problems(element(**{found: 1}))
    assert problem.startswith(f"elements.one.{found}: is unknown ({expected}")


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


def test_defaults():
    less = {name: value for name, value in STRUT.items() if name != "damping"}
    guard = {name: value for name, value in RANGE.items() if name != "outer_stiffness"}
    found = load_config(config_data({"a": less, "b": guard})).elements
    assert (found["a"].damping, found["b"].outer_stiffness) == (0.0, 0.0)


@pytest.mark.parametrize("key", ["K_c", "L_c"])
def test_matrices_that_are_not_positive_definite(key):
    singular = [[1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, 1.0]]
    (problem,) = problems(config_data({"one": TIE | {key: singular}}))
    assert problem.startswith(f"elements.one.{key}: is not positive definite beyond round-off")


# Schema versions, and the controller.


def test_version_one_has_no_elements():
    expected = "elements: is not a key of schema version 1 (expected schema_version: 2)"
    for elements in (ONE_OF_EACH, {}):
        data = config_data(elements)
        assert problems(data | {"schema_version": 1}) == [expected]
        del data["schema_version"]
        assert problems(data) == [expected]


def test_place_of_that_message(complaints):
    text = edited("schema_version: 2", "schema_version: 1", YAML) + (
        "controller: {variant: free, K_t: [1, 1, 1], L_t: [1, 1, 1], K_r: [1, 1, 1], "
        "L_r: [1, 1, 1]}\n"
    )
    assert complaints(text) == [
        "4:3: elements: is not a key of schema version 1 (expected schema_version: 2)"
    ]


def test_version_one_needs_a_controller(complaints):
    text = "\n".join(line for line in YAML.splitlines() if "version" not in line)
    found = complaints(text)
    assert "1:1: controller: is missing (it is required)" in found
    data = config_data({}, None)
    del data["elements"]
    assert "controller: is missing (it is required)" in problems(data | {"schema_version": 1})


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


@pytest.mark.parametrize("version", [0, 3, 2.5, "2", True, None])
def test_other_versions(version):
    found = problems(config_data() | {"schema_version": version})
    assert len(found) == 1
    assert found[0].startswith("schema_version: is ")
    assert "1 or 2" in found[0]


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_elements_beside_every_controller(variant):
    data = plain(BY_VARIANT[variant]) | {"schema_version": 2, "elements": ONE_OF_EACH}
    config = load_config(data)
    assert config.controller.variant == variant
    assert list(config.elements) == sorted(ONE_OF_EACH)


# Changes from the command line.


def test_set():
    data = config_data()
    found = load_config(
        data,
        [
            "elements.strut.stiffness=5",
            "elements.strut.point[1]=0.7",
            "elements.tie.K_c=[1, 2, 3]",
            "elements.new={kind: attitude, K: [1, 1, 1], L: [1, 1, 1]}",
        ],
    ).elements
    assert (found["strut"].stiffness, found["strut"].point[1]) == (5.0, 0.7)
    assert found["tie"].K_c == (1.0, 2.0, 3.0)
    assert list(found) == ["new", "range", "strut", "tie", "upright"]


def test_set_of_a_value_that_the_file_leaves_out(load):
    assert load(YAML, "elements.strut.damping=7").elements["strut"].damping == 7.0
    # Without a controller, the initial state has its defaults too.
    assert load(YAML, "initial.position[2]=0.5").initial.position == (0.0, 0.0, 0.5)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            "elements.strut.stifness=5",
            "--set elements.strut.stifness:1:1: elements.strut.stifness: is unknown "
            "(did you mean stiffness?)",
        ),
        (
            "elements.strut.stiffness=-5",
            "--set elements.strut.stiffness:1:26: elements.strut.stiffness: is -5 "
            "(expected a number greater than 0)",
        ),
        (
            "elements.strat.stiffness=5",
            f"--set elements.strat.stiffness:1:1: elements.strat.kind: is missing {KIND}",
        ),
        (
            "elements.strut.point[3]=5",
            "--set elements.strut.point[3]:1:1: elements.strut.point[3]: does not exist "
            "(expected a key of the config)",
        ),
    ],
)
def test_set_of_what_is_wrong(complaints, change, expected):
    assert complaints(YAML, change) == [expected]


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

REFUSED = [
    WRONG,
    edited("schema_version: 2", "schema_version: 1", YAML),
    edited("schema_version: 2\n", "", YAML),
    edited("schema_version: 2", "schema_version: 3", YAML),
    edited("kind: spring", "kind: sprng", YAML),
    edited("    kind: spring\n", "", YAML),
    edited("stiffness:", "stiffnes:", YAML),
    edited("stiffness: 900", "stiffness: -900", YAML),
    edited("[0.02, 0, 0.3]", "[0.02, 0]", YAML),
    edited("[60, 60, 42]", "[60, 60, -42]", YAML),
    edited("  strut:", "  Strut:", YAML),
    edited("  strut:", "  connector:", YAML),
    as_text(config_data({f"e{index}": UPRIGHT for index in range(101)})),
    as_text(config_data(controller={"variant": "none"} | {"K_t": [1.0] * 3})),
    as_text(config_data() | {"elements": [STRUT]}),
    as_text(config_data({"range": RANGE | {"method": "clip"}})),
    as_text(config_data({}) | {"schema_version": 1}),
    as_text(config_data({}, CONTROLLER | {"variant": "none"})),
]


@pytest.mark.parametrize("text", ACCEPTED)
def test_both_accept(validator, load, text):
    load(text)
    assert schema_errors(validator, text) == []


@pytest.mark.parametrize("text", REFUSED)
def test_both_refuse(validator, complaints, text):
    complaints(text)
    assert schema_errors(validator, text)
