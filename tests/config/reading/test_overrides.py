"""`--set key=value` changes any entry of a config, and its errors name the change."""

import pytest
from support.configs import PERMANENT, VISCO_ELASTIC, edited, plain

from rbstab.config.load import load_config
from rbstab.config.overrides import parse_key
from rbstab.config.source import key_of


def test_a_number(load):
    assert load(VISCO_ELASTIC, "body.mass=50").body.mass == 50.0


def test_an_entry_of_a_list(load):
    assert load(VISCO_ELASTIC, "controller.K_t[1]=1e3").controller.K_t == (4100.0, 1e3, 3280.0)
    assert load(VISCO_ELASTIC, "controller.K_t[0]=1").controller.K_t == (1.0, 4100.0, 3280.0)


def test_an_entry_of_a_matrix(load):
    text = edited("[10.0, 8.0, 0.4]", "[[10, 0, 0], [0, 8, 0], [0, 0, 0.4]]")
    config = load(text, "body.inertia[2][2]=6", "body.inertia[0][1]=1", "body.inertia[1][0]=1")
    assert config.body.inertia == ((10.0, 1.0, 0.0), (1.0, 8.0, 0.0), (0.0, 0.0, 6.0))


def test_a_list_and_a_matrix_as_a_whole(load):
    assert load(VISCO_ELASTIC, "gravity=[0, 0, -9.81]").gravity == (0.0, 0.0, -9.81)
    config = load(VISCO_ELASTIC, "body.inertia=[[3, 1, 0], [1, 3, 0], [0, 0, 3]]")
    assert config.body.inertia[0] == (3.0, 1.0, 0.0)


def test_a_new_section(load):
    config = load(VISCO_ELASTIC, "reference.source=a paper", "reference.final.velocity=[1, 2, 3]")
    assert config.reference.source == "a paper"
    assert config.reference.final.velocity == (1.0, 2.0, 3.0)
    text = PERMANENT + "  coordinates: manifold\n"
    config = load(text, "integration.drift_control.baumgarte=5")
    assert config.integration.drift_control.baumgarte == 5.0


def test_a_whole_section(load):
    config = load(VISCO_ELASTIC, "initial={orientation: [0, 0.5, 0]}")
    assert config.initial.orientation == (0.0, 0.5, 0.0)
    assert config.initial.angular_velocity == (0.0, 0.0, 0.0)


def test_values_are_yaml(load):
    assert load(VISCO_ELASTIC, "title=a = b").title == "a = b"
    assert load(VISCO_ELASTIC, 'title="5"').title == "5"
    assert load(VISCO_ELASTIC, "body.mass= 5  # kg").body.mass == 5.0
    assert load(VISCO_ELASTIC, "body.mass=1e-9").body.mass == 1e-9


def test_the_last_one_counts(load):
    assert load(VISCO_ELASTIC, "body.mass=-1", "body.mass=3").body.mass == 3.0


def test_what_is_wrong_in_the_file_may_be_put_right(load):
    text = edited("mass: 41.0", "mass: heavy")
    assert load(text, "body.mass=41").body.mass == 41.0
    assert load("", *[f"{key}={value}" for key, value in FROM_NOTHING]).body.mass == 1.0


FROM_NOTHING = [
    ("body.mass", "1"),
    ("body.inertia", "[1, 1, 1]"),
    ("body.contact_point", "[0, 0, 1]"),
    ("controller", "{variant: free, K_t: [1, 1, 1], L_t: [1, 1, 1]}"),
    ("controller.K_r", "[1, 1, 1]"),
    ("controller.L_r", "[1, 1, 1]"),
    ("integration.duration", "1"),
]

WRONG_VALUES = [
    ("body.mass=-1", "--set body.mass:1:11: body.mass: is -1 (expected a number greater than 0)"),
    ("body.mass=  -1", "--set body.mass:1:13: body.mass: is -1 (expected a number greater than 0)"),
    ("body.mass=heavy", "--set body.mass:1:11: body.mass: is the text 'heavy' (expected a number)"),
    ("gravity=[0, x, 0]", "--set gravity:1:13: gravity[1]: is the text 'x' (expected a number)"),
    ("gravity=[0, 0]", "--set gravity:1:9: gravity: has 2 entries (expected 3)"),
    (
        "controller.K_t[1]=-1",
        "--set controller.K_t[1]:1:19: controller.K_t[1]: is -1 (expected a number at least 0)",
    ),
    (
        "controller.variant=rigid",
        "--set controller.variant:1:20: controller.variant: is the text 'rigid' (expected one of",
    ),
    (
        "body.mass=*a",
        "--set body.mass:1:11: body.mass: is the alias *a (expected values written out)",
    ),
    ("body.mass=&a 5", "--set body.mass:1:11: body.mass: has the anchor &a (expected no anchors)"),
    (
        "body.mass=!!int 5",
        "--set body.mass:1:11: body.mass: has the tag tag:yaml.org,2002:int (expected no",
    ),
    ("body=5", "--set body:1:6: body: is 5 (expected a mapping)"),
    ("title=x\n---\ny", "--set title:2:1: starts a second document (expected one document)"),
    ("body.mass=\n  -1", "--set body.mass:2:3: body.mass: is -1 (expected a number greater"),
    ("reference.source=5", "--set reference.source:1:18: reference.source: is 5 (expected a text)"),
    ("reference.final.position=[1,2,3]", "--set reference.final.position:1:1: reference.source: "),
    ("body.mass=[1, 2", "--set body.mass:"),
    ("title=", "--set title:1:7: title: is empty (expected a text)"),
]


@pytest.mark.parametrize(("change", "expected"), WRONG_VALUES)
def test_wrong_value(complaints, change, expected):
    (message,) = complaints(VISCO_ELASTIC, change)
    assert message.startswith(expected)


def test_an_angle_that_the_config_gives_in_degrees_has_another_key(complaints):
    degrees = "initial.orientation={deg: [30, 0, 0]}"
    (message,) = complaints(VISCO_ELASTIC, degrees, "initial.orientation[0]=0.3")
    assert message.endswith("does not exist (given in degrees: initial.orientation.deg[0])")


WRONG_KEYS = [
    ("body.mas=5", "--set body.mas:1:1: body.mas: is unknown (did you mean mass?)"),
    ("bodi.mass=5", "--set bodi.mass:1:1: bodi: is unknown (did you mean body?)"),
    ("colour=red", "--set colour:1:1: colour: is unknown (expected one of body, controller, "),
    (
        "controller.K_d=[1, 1, 1]",
        "--set controller.K_d:1:1: controller.K_d: is not a key of the variant visco-elastic",
    ),
    ("body.mass.x=5", "--set body.mass.x:1:1: body.mass.x: does not exist (expected a key of"),
    ("body.mass.x.y=5", "--set body.mass.x.y:1:1: body.mass.x: does not exist (expected a key of"),
    ("body[0]=5", "--set body[0]:1:1: body[0]: does not exist (expected a key of the config)"),
    ("body.inertia.x=5", "--set body.inertia.x:1:1: body.inertia.x: does not exist (expected a"),
    ("controller.K_t[3]=5", "--set controller.K_t[3]:1:1: controller.K_t[3]: does not exist"),
    ("controller.K_t[3][0]=5", "--set controller.K_t[3][0]:1:1: controller.K_t[3]: does not exist"),
    ("body.mass", "--set body.mass:1:1: is not an assignment (expected key=value)"),
    ("=5", "--set :1:1: is not an assignment (expected key=value)"),
    ("", "--set :1:1: is not an assignment (expected key=value)"),
    ("body..mass=5", "--set body..mass:1:1: is no"),
    (".mass=5", "--set .mass:1:1: is no"),
    ("body.mass.=5", "--set body.mass.:1:1: is no"),
    ("body mass=5", "--set body mass:1:1: is no"),
    ("K_t[-1]=5", "--set K_t[-1]:1:1: is no"),
    ("K_t[01]=5", "--set K_t[01]:1:1: is no"),
    ("K_t[0=5", "--set K_t[0:1:1: is no"),
    ("K_t[9999999]=5", "--set K_t[9999999]:1:1: is no"),
]


@pytest.mark.parametrize(("change", "expected"), WRONG_KEYS)
def test_wrong_key(complaints, change, expected):
    (message,) = complaints(VISCO_ELASTIC, change)
    assert message.startswith(expected)


def test_several_wrong_changes(complaints):
    found = complaints(VISCO_ELASTIC, "a b=1", "body.mass=2", "body.mass.z=1", "=")
    assert [message.split(":")[0] for message in found] == [
        "--set ",
        "--set a b",
        "--set body.mass.z",
    ]


def test_all_wrong_changes_are_reported_at_once(complaints):
    """Also those that are found only when the whole config is checked."""
    found = complaints(VISCO_ELASTIC, "initial.oriention=3", "foo", "body.mass=")
    assert [message.split(":")[0] for message in found] == [
        "--set body.mass",
        "--set foo",
        "--set initial.oriention",
    ]


def test_errors_of_file_and_changes_together(complaints):
    text = edited("duration: 2.0", "duration: 0")
    assert complaints(text, "body.mass=-1") == [
        "--set body.mass:1:11: body.mass: is -1 (expected a number greater than 0)",
        "18:13: integration.duration: is 0 (expected a number greater than 0)",
    ]


def test_what_is_missing_in_a_changed_section_is_told_there(complaints):
    assert complaints(VISCO_ELASTIC, "body={mass: 1, inertia: [1, 1, 1]}") == [
        "--set body:1:6: body.contact_point: is missing (it is required)"
    ]


def test_places_of_the_replaced_value_are_forgotten(complaints):
    """An error below a changed key points into the change, never into the file."""
    text = edited("mass: 41.0", "mass: {a: {b: 1}}")
    (message,) = complaints(text, "body.mass={c: 1}")
    assert message.startswith("--set body.mass:1:11: body.mass: is a mapping")
    (message,) = complaints(VISCO_ELASTIC, "controller.K_t=[[1, 0, 0], [0, 1, 0], [0, 0]]")
    assert message.startswith("--set controller.K_t:1:39: controller.K_t[2]: has 2 entries")


@pytest.mark.parametrize(
    "path", [("a",), ("a", "b"), ("a", 0), ("a", 12, 3, "b_c", 0), ("K_t", 0, "x")]
)
def test_a_key_and_its_path_are_inverse(path):
    assert parse_key(key_of(path)) == path


@pytest.mark.parametrize("text", ["", ".", "a.", ".a", "a..b", "a[", "a[]", "a[x]", "[a]", "a b"])
def test_no_key(text):
    assert parse_key(text) is None


@pytest.mark.parametrize("change", ["title=", "initial=", "initial=  # x", "body="])
def test_an_empty_value_is_empty(complaints, change):
    (message,) = complaints(VISCO_ELASTIC, change)
    assert "is empty" in message


@pytest.mark.parametrize(
    ("change", "place"),
    [("body.mass=1\0", "1:12"), ("body.mass=\x1b[1m", "1:11"), ("body.mass=1\n \x1b", "2:2")],
)
def test_a_control_character_is_found_where_it_stands(complaints, change, place):
    (message,) = complaints(VISCO_ELASTIC, change)
    assert message.startswith(f"--set body.mass:{place}: ")


def test_problems_inside_a_value_name_the_whole_key(complaints):
    found = complaints(VISCO_ELASTIC, "body.mass={a: 1, a: 2}")
    assert any("body.mass.a: is given twice" in message for message in found)


@pytest.mark.parametrize("change", ["body.mass =5", "body-mass=5", "body..mass=5"])
def test_a_malformed_key_is_called_that(complaints, change):
    (message,) = complaints(VISCO_ELASTIC, change)
    assert "is not an assignment" not in message


def test_an_entry_of_a_default_can_be_set(load):
    assert load(VISCO_ELASTIC, "gravity[2]=-9.81").gravity == (0.0, 0.0, -9.81)


@pytest.mark.parametrize("initial", ["", "initial:\n  angular_velocity: [1, 2, 3]\n"])
def test_an_entry_of_a_default_in_a_section_can_be_set(load, initial):
    """The file may have the section without the key, or no such section."""
    begin, end = VISCO_ELASTIC.index("initial:"), VISCO_ELASTIC.index("integration:")
    text = VISCO_ELASTIC[:begin] + initial + VISCO_ELASTIC[end:]
    assert load(text, "initial.orientation[1]=0.1").initial.orientation == (0.0, 0.1, 0.0)


def test_a_single_change_may_be_a_text():
    """A single text is one change, and not a sequence of letters."""
    assert load_config(plain(), "body.mass=5").body.mass == 5.0


def test_the_place_of_a_section_that_a_change_creates(complaints):
    """A section that the file does not have is located at the change, and so is what it lacks."""
    change = "reference.final.orientation=[0, 0, 0]"
    (found,) = complaints(VISCO_ELASTIC, change)
    place = "--set reference.final.orientation:1:1"
    assert found == f"{place}: reference.source: is missing (it is required)"
    begin = VISCO_ELASTIC.index("integration:")
    found = complaints(VISCO_ELASTIC[:begin], change)
    assert "1:1: integration: is missing (it is required)" in found
    (found,) = complaints(VISCO_ELASTIC, "more.of.it=1")
    assert found.startswith("--set more.of.it:1:1: more: is unknown")


@pytest.mark.parametrize("parts", [17, 100_000])
@pytest.mark.parametrize("key", ["a.", "body.", "controller.K_t[0]."])
def test_a_key_with_too_many_parts(complaints, key, parts):
    (found,) = complaints(VISCO_ELASTIC, f"{key}{'.'.join('a' * parts)}=1")
    assert found.startswith(f"--set {key}")
    assert ": is not a key (" in found
    assert len(found) < 400


def test_a_key_with_the_largest_number_of_parts(complaints):
    (found,) = complaints(VISCO_ELASTIC, f"{'.'.join('a' * 16)}=1")
    assert "a: is unknown" in found
