"""Wrong keys are reported: unknown, misspelt, missing, repeated, or of another variant."""

import pytest
from support.configs import FREE, PERMANENT, VISCO_ELASTIC, edited

from rbstab.config.errors import Location
from rbstab.config.source import parse_source

ROOT = (
    "body, controller, desired, elements, gravity, initial, integration, reference, "
    "schema_version, title"
)

MISSPELT = [
    ("title:", "titel:", "1:1: titel: is unknown (did you mean title?)"),
    ("contact_point:", "contact_pont:", "5:3: body.contact_pont: is unknown (did you mean contact"),
    ("  K_t:", "  Kt:", "8:3: controller.Kt: is unknown (did you mean K_t?)"),
    ("  K_t:", "  KT:", "8:3: controller.KT: is unknown (did you mean K_t?)"),
    ("initial:", "Initial:", "14:1: Initial: is unknown (did you mean initial?)"),
    ("duration:", "durration:", "18:3: integration.durration: is unknown (did you mean duration?)"),
    # All letters differ, but only in case.
    ("mass:", "MASS:", "3:3: body.MASS: is unknown (did you mean mass?)"),
]


@pytest.mark.parametrize(("old", "new", "expected"), MISSPELT)
def test_misspelt(complaints, old, new, expected):
    assert any(message.startswith(expected) for message in complaints(edited(old, new)))


UNKNOWN = [
    ("colour: red\n", f"20:1: colour: is unknown (expected one of {ROOT})"),
    ("5: red\n", f"20:1: 5: is unknown (expected one of {ROOT})"),
    ("null: red\n", f"20:1: null: is unknown (expected one of {ROOT})"),
    ("  qqq: 1\n", "20:3: integration.qqq: is unknown (expected one of atol, coordinates, "),
]


@pytest.mark.parametrize(("line", "expected"), UNKNOWN)
def test_unknown(complaints, line, expected):
    (message,) = complaints(VISCO_ELASTIC + line)
    assert message.startswith(expected)


IN_ANOTHER_SECTION = [
    ("mass: 3\n", "20:1: mass: is unknown (did you mean body.mass?)"),
    ("Samples: 3\n", "20:1: Samples: is unknown (did you mean integration.samples?)"),
    ("mas: 3\n", "20:1: mas: is unknown (did you mean body.mass?)"),
    ("  mass: 3\n", "20:3: integration.mass: is unknown (did you mean body.mass?)"),
    # Exact in another variant is nearer than K_t, which is close to it.
    ("K_d: [1, 1, 1]\n", "20:1: K_d: is unknown (did you mean controller.K_d?)"),
    ("slope: 1\n", "20:1: slope: is unknown (did you mean controller.surface.slope?)"),
    # Printed reference values have an orientation too, but nobody means them.
    (
        "orientation: [0, 0, 0]\n",
        "20:1: orientation: is unknown (did you mean initial.orientation or desired.orientation?",
    ),
    ("K_c: 5\n", "20:1: K_c: is unknown (did you mean controller.K_c?)"),
    ("x: 1\n", f"20:1: x: is unknown (expected one of {ROOT})"),
]


@pytest.mark.parametrize(("line", "expected"), IN_ANOTHER_SECTION)
def test_a_key_of_another_section(complaints, line, expected):
    (message,) = complaints(VISCO_ELASTIC + line)
    assert message.startswith(expected)


def test_unknown_in_a_flow_mapping(complaints):
    text = PERMANENT + "  coordinates: manifold\n  drift_control: {baumgarte: 5, rate: 1}\n"
    assert complaints(text) == [
        "19:33: integration.drift_control.rate: is unknown (expected one of baumgarte)"
    ]


OTHER_VARIANT = [
    (
        FREE + "  drift_control: none\n",
        "18:3: integration.drift_control: is not a key of the variant free "
        "(it belongs to permanent)",
    ),
    (
        edited("  K_t:", "  K_d: [1, 1, 1]\n  K_t:"),
        "8:3: controller.K_d: is not a key of the variant visco-elastic (it belongs to embedded)",
    ),
    (
        edited("  K_t:", "  anchor: origin\n  K_t:", FREE),
        "8:3: controller.anchor: is not a key of the variant free "
        "(it belongs to permanent, visco-elastic, embedded, sliding)",
    ),
    (
        edited("initial:", "initial:\n  position: [0, 0, 0]", PERMANENT),
        "13:3: initial.position: is not a key of the variant permanent "
        "(it belongs to free, visco-elastic, embedded, sliding)",
    ),
    (
        edited("initial:", "initial:\n  connector_state: [0, 0, 0]"),
        "15:3: initial.connector_state: is not a key of the variant visco-elastic "
        "(it belongs to embedded)",
    ),
]


@pytest.mark.parametrize(("text", "expected"), OTHER_VARIANT)
def test_key_of_another_variant(complaints, text, expected):
    assert complaints(text) == [expected]


def test_a_key_of_the_controller_where_elements_hold_the_body(complaints):
    found = complaints("schema_version: 2\n" + edited("visco-elastic", "none"))
    assert len(found) == 6
    assert found[0] == (
        "9:3: controller.K_t: is not a key of the variant none (it belongs to free, permanent, "
        "visco-elastic, embedded, sliding; here, `elements` hold the body)"
    )


MISSING = [
    (edited("  mass: 41.0\n", ""), ["3:3: body.mass: is missing (it is required)"]),
    (edited("  duration: 2.0\n", ""), ["18:3: integration.duration: is missing (it is required)"]),
    (
        edited("visco-elastic", "embedded"),
        [
            "7:3: controller.K_d: is missing (it is required)",
            "7:3: controller.L_d: is missing (it is required)",
        ],
    ),
    (VISCO_ELASTIC + "reference: {}\n", ["20:12: reference.source: is missing (it is required)"]),
    (
        PERMANENT + "  coordinates: manifold\n  drift_control: {}\n",
        ["19:18: integration.drift_control.baumgarte: is missing (it is required)"],
    ),
]


@pytest.mark.parametrize(("text", "expected"), MISSING)
def test_missing_key(complaints, text, expected):
    assert complaints(text) == expected


@pytest.mark.parametrize("section", ["body", "controller", "integration"])
def test_missing_section(complaints, section):
    """A missing section is reported at the start of its parent."""
    begin = VISCO_ELASTIC.index(f"{section}:")
    lines = VISCO_ELASTIC[begin:].splitlines(keepends=True)
    length = 1 + next((i for i, x in enumerate(lines[1:]) if x[0] != " "), len(lines) - 1)
    text = VISCO_ELASTIC[:begin] + "".join(lines[length:])
    (message,) = complaints(text)
    assert message.startswith(f"1:1: {section}: is missing (")


EMPTY = [
    ("body", "[1]", "is a list of 1"),
    ("body", "heavy", "is the text 'heavy'"),
    ("controller", "[1]", "is a list of 1"),
    ("controller", "5", "is 5"),
    ("integration", "2.0", "is 2"),
    ("initial", "~", "is empty"),
    ("reference", "paper", "is the text 'paper'"),
]


@pytest.mark.parametrize(("section", "value", "found"), EMPTY)
def test_section_that_is_no_mapping(complaints, section, value, found):
    lines = VISCO_ELASTIC.splitlines()
    names = [line.split(":")[0] for line in lines]
    if section in names:
        begin = names.index(section)
        end = begin + 1
        while end < len(lines) and lines[end].startswith(" "):
            end += 1
        lines[begin:end] = [f"{section}: {value}"]
    else:
        begin = len(lines)
        lines.append(f"{section}: {value}")
    where = f"{begin + 1}:{len(section) + 3}"
    assert complaints("\n".join(lines)) == [f"{where}: {section}: {found} (expected a mapping)"]


DUPLICATE = [
    (
        edited("mass: 41.0", "mass: 41.0\n  mass: 41.0"),
        ["4:3: body.mass: is given twice, first in line 3 (expected each key once)"],
    ),
    (
        VISCO_ELASTIC + "title: Other\n",
        ["20:1: title: is given twice, first in line 1 (expected each key once)"],
    ),
    (
        VISCO_ELASTIC + "gravity: [0, 0, -9.81]\n" * 3,
        [
            "21:1: gravity: is given twice, first in line 20 (expected each key once)",
            "22:1: gravity: is given twice, first in line 20 (expected each key once)",
        ],
    ),
    # A quoted key is the same key.
    (
        VISCO_ELASTIC + '"title": Other\n',
        ["20:1: title: is given twice, first in line 1 (expected each key once)"],
    ),
]


@pytest.mark.parametrize(("text", "expected"), DUPLICATE)
def test_duplicate(complaints, text, expected):
    assert complaints(text) == expected


def test_a_repeated_section_is_not_called_incomplete_where_it_is_complete(complaints):
    assert not any(x.startswith("3:9: body.mass") for x in complaints(VISCO_ELASTIC + "body: {}\n"))


def test_a_repeated_controller_is_called_repeated(complaints):
    found = complaints(VISCO_ELASTIC + "controller: {}\n")
    assert any("20:1: controller: is given twice" in message for message in found)


def test_a_misspelt_controller_is_named(complaints):
    assert any(
        "controllers: is unknown" in x for x in complaints(edited("controller:", "controllers:"))
    )


@pytest.mark.parametrize("key", ["<matrix>", "<diagonal>"])
def test_unknown_key_written_like_an_internal_name(complaints, key):
    assert any(f"20:1: {key}: is unknown" in x for x in complaints(VISCO_ELASTIC + f"{key}: 1\n"))


def test_unknown_key_written_like_an_internal_name_in_the_third_level(complaints):
    (message,) = complaints(VISCO_ELASTIC + "reference: {source: a, final: {<matrix>: 1}}\n")
    assert message.startswith("20:32: reference.final.<matrix>: is unknown")


@pytest.mark.parametrize("key", ["matrix", "diagonal"])
@pytest.mark.parametrize("before", ["title:", "  mass:", "  K_t:"])
def test_unknown_key_named_like_a_shape(complaints, key, before):
    indent = before[: len(before) - len(before.lstrip())]
    (message,) = complaints(edited(before, f"{indent}{key}: 1\n{before}"))
    assert f"{key}: is unknown" in message


def test_the_first_of_repeated_keys_is_kept_and_the_others_are_read():
    source = parse_source("b: {c: [1, 2]}\nb: {c: {d: 3}, e: *x}\nb: 4\na: 5\n", "x")
    assert source.data == {"b": {"c": [1, 2]}, "a": 5}
    assert [str(problem.location) for problem in source.problems] == ["x:2:1", "x:2:19", "x:3:1"]
    assert source.location(("b", "c", 1)) == Location("x", 1, 12)
    assert ("b", "c", "d") not in source.values
    assert ("b", "e") not in source.keys


def test_a_section_that_other_programs_have_is_not_a_misspelt_one(complaints):
    (message,) = complaints(VISCO_ELASTIC + "attitude: {deg: [0, 20, 0]}\n")
    assert message.startswith(
        "20:1: attitude: is unknown (did you mean initial.orientation or desired.orientation?"
    )
