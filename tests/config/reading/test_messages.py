"""Problems are told all at once, in order, one line each, short, without control characters."""

import pytest
from support.configs import VISCO_ELASTIC, edited, plain

from rbstab.config.errors import ConfigError, ConfigProblem, Location
from rbstab.config.load import load_config
from rbstab.elements.registry import KINDS as ALL_KINDS
from rbstab.elements.registry import SELECTORS

VARIANTS = "expected one of free, permanent, visco-elastic, embedded, sliding"
CHOSEN = [*(kind for kind in ALL_KINDS if kind not in SELECTORS), "python", *SELECTORS]
KINDS = f"(expected one of {', '.join(CHOSEN)})"

MASS, INERTIA, POINT = "mass: 41.0", "inertia: [10.0, 8.0, 0.4]", "[0.15, 0.10, -0.42]"
ORIENTATION, DURATION, SAMPLES = "orientation: [0, 0, 0]", "duration: 2.0", "samples: 11"

# An edit of the visco-elastic config, and its whole message.
TEXTS = [
    ("  K_t:", "  Kt:", "8:3: controller.Kt: is unknown (did you mean K_t?)"),
    (
        MASS,
        f"{MASS}\n  colour: 1",
        "4:3: body.colour: is unknown (expected one of mass, inertia, contact_point)",
    ),
    (
        SAMPLES,
        "samples: 11\nslope: 1",
        "20:1: slope: is unknown (did you mean controller.surface.slope?)",
    ),
    (
        "  K_t:",
        "  K_d: [1, 1, 1]\n  K_t:",
        "8:3: controller.K_d: is not a key of the variant visco-elastic (it belongs to embedded)",
    ),
    ("  mass: 41.0\n", "", "3:3: body.mass: is missing (it is required)"),
    (
        MASS,
        f"{MASS}\n  {MASS}",
        "4:3: body.mass: is given twice, first in line 3 (expected each key once)",
    ),
    (MASS, "mass: -1", "3:9: body.mass: is -1 (expected a number greater than 0)"),
    (MASS, "mass: -.Inf", "3:9: body.mass: is -inf (expected a finite number)"),
    (MASS, "mass: False", "3:9: body.mass: is false (expected a number)"),
    (MASS, f"mass: {'x' * 41}", f"3:9: body.mass: is the text '{'x' * 37}...' (expected a number)"),
    (SAMPLES, "samples: 1.5", "19:12: integration.samples: is 1.5 (expected a whole number)"),
    (
        SAMPLES,
        f"samples: -1{'0' * 15}",
        "19:12: integration.samples: is a whole number of more than 15 digits (expected a number "
        "at least 2)",
    ),
    (
        SAMPLES,
        "samples: 11\n  engine: Scipy",
        "20:11: integration.engine: is the text 'Scipy' (expected scipy or heyoka; did you mean "
        "scipy?)",
    ),
    (
        DURATION,
        "duration: 9e-100",
        "19:12: integration.samples: 11 samples in 9e-100 s are too close (expected at least "
        "1e-100 s between samples)",
    ),
    (POINT, "[1, 2]", "5:18: body.contact_point: has 2 entries (expected 3)"),
    (INERTIA, "inertia: 5", "4:12: body.inertia: is 5 (expected three numbers or a 3x3 matrix)"),
    (
        INERTIA,
        "inertia: [[1, 2, 0], [0, 9, 0], [0, 0, 1]]",
        "4:12: body.inertia: is not symmetric (expected a symmetric matrix)",
    ),
    (
        "L_r: [60, 60, 42]",
        "L_r: [[1, 2, 0], [2, 1, 0], [0, 0, 1]]",
        "11:8: controller.L_r: is not positive semidefinite, its smallest eigenvalue is -1 "
        "(expected no negative eigenvalue)",
    ),
    (
        "title: Case",
        f"title: {'x' * 201}",
        "1:8: title: has 201 characters (expected at most 200 characters)",
    ),
    (
        ORIENTATION,
        "orientation: {deg: [90, 100, -181]}",
        "15:16: initial.orientation: θ2 = 1.74533 rad (100°), θ3 = -3.15905 rad (-181°) are "
        "outside the range of eq. 5 (expected θ1 and θ3 between ±180°, θ2 inside of ±90°; degrees "
        "are {deg: [...]})",
    ),
    (
        ORIENTATION,
        "orientation: {deg: [0, 89.99, 0]}",
        "15:16: initial.orientation: has cos θ2 = 0.00017, and a run ends where it is 0.001 or "
        "less (expected |θ2| below 89.9427°, or a smaller integration.range_bound)",
    ),
    (
        ORIENTATION,
        "orientation: 20deg",
        "15:16: initial.orientation: is the text '20deg' (expected a list of 3, or {deg: [0, 20, "
        "0]})",
    ),
    (
        "visco-elastic",
        "Visco Elastic",
        f"7:12: controller.variant: is the text 'Visco Elastic' ({VARIANTS}; did you mean "
        "visco-elastic?)",
    ),
    (
        SAMPLES,
        "samples: 11\nschema_version: 3",
        "20:17: schema_version: is 3, which this version of rbstab cannot read (expected 1 or 2)",
    ),
    (
        SAMPLES,
        "samples: 11\nelements: {}",
        "20:11: elements: is not a key of schema version 1 (expected schema_version: 2)",
    ),
    (
        "title: Case",
        "schema_version: 2\nelements: {a: {kind: sprng}}",
        f"2:22: elements.a.kind: is the text 'sprng' {KINDS[:-1]}; did you mean spring?)",
    ),
    (
        "title: Case",
        "schema_version: 2\nelements: {A: {kind: attitude, K: [1, 1, 1], L: [1, 1, 1]}}",
        "2:12: elements.A: is not a name of an element (expected a lower-case letter, then up to "
        "39 lower-case letters, digits or _)",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), TEXTS)
def test_whole_messages(complaints, old, new, message):
    assert complaints(edited(old, new)) == [message]


MANY = """\
title: ""
body:
  mass: -1
  inertia: [10, 8]
  contact_point: [0, x, 0]
  mass: 2
controller:
  variant: visco-elastic
  K_t: [[1, 2, 0], [2, 1, 0], [0, 0, 1]]
  L_t: [1, 1, 1]
  K_r: &a [1, 1, 1]
  L_r: *a
  Kc: [1, 1, 1]
  L_c: [1, 1, 1]
  L_d: [1, 1, 1]
initial:
  orientation: [0, 90, 0]
integration:
  duration: .inf
  samples: 1
  coordinates: w
elements:
  b: {}
  d: {kind: guard, method: repelling, stiffness: 1.0, soft_angle: 1.6}
  s: {kind: input, quantity: force, point: [0, 0, 0], direction: [0, 0, 0], amplitude: 1, signal: 1}
schema_version: 3
"""


def test_all_problems_at_once_in_the_order_of_their_places(complaints):
    assert [" ".join(message.split(": ")[:2]) for message in complaints(MANY)] == [
        "1:8 title",
        "3:9 body.mass",
        "4:12 body.inertia",
        "5:22 body.contact_point[1]",
        "6:3 body.mass",
        "8:3 controller.K_c",
        "9:8 controller.K_t",
        "11:8 controller.K_r",
        "12:8 controller.L_r",
        "13:3 controller.Kc",
        "15:3 controller.L_d",
        "17:16 initial.orientation",
        "19:13 integration.duration",
        "20:12 integration.samples",
        "21:16 integration.coordinates",
        "23:6 elements.b.kind",
        "24:6 elements.d.couple",
        "24:39 elements.d.stiffness",
        "24:67 elements.d.soft_angle",
        "25:66 elements.s.direction",
        "25:99 elements.s.signal",
        "26:17 schema_version",
    ]


def test_a_key_of_the_controller_where_elements_hold_the_body(complaints):
    messages = complaints("schema_version: 2\n" + edited("visco-elastic", "none"))
    assert len(messages) == 6
    assert messages[0].endswith("embedded, sliding; here, `elements` hold the body)")


def test_a_repeated_section_is_not_called_incomplete_where_it_is_complete(complaints):
    messages = complaints(VISCO_ELASTIC + "body: {}\ncontroller: {}\n")
    assert [message.split(" (")[0] for message in messages] == [
        "20:1: body: is given twice, first in line 2",
        "21:1: controller: is given twice, first in line 6",
    ]


@pytest.mark.parametrize("section", ["body", "controller", "integration"])
def test_a_missing_section_is_told_at_the_start_of_its_parent(complaints, section):
    begin = VISCO_ELASTIC.index(f"{section}:")
    indented = VISCO_ELASTIC[begin:].replace("\n  ", "\r")
    text = VISCO_ELASTIC[:begin] + indented.partition("\n")[2].replace("\r", "\n  ")
    assert complaints(text) == [f"1:1: {section}: is missing (it is required)"]


def test_a_long_list_ends_with_how_many_are_left_out():
    """The order is by place, not by text: line 10 comes after line 9."""
    problems = [
        ConfigProblem(Location("a", line, 3 - line % 2), "k", "is wrong", "")
        for line in range(150, 0, -1)
    ]
    shown = [str(problem) for problem in ConfigError(problems).problems]
    assert shown[:99] == [f"a:{line}:{3 - line % 2}: k: is wrong" for line in range(1, 100)]
    assert shown[99:] == ["a:100:3: 51 more problems are not listed"]
    assert str(ConfigError(problems[50:]).problems[-1]) == "a:100:3: k: is wrong"
    # A caller that does not import ConfigError can catch ValueError.
    assert issubclass(ConfigError, ValueError)


STEERING = ["a\\e[31mb", "a\\u009b31m", "a\\nb: 2", "a\\rb", "a\\bb", "\\u202eevil", "a\\0b"]
STEERING += ["a\\u2028b"]


def printed(*arguments):
    with pytest.raises(ConfigError) as caught:
        load_config(*arguments)
    assert str(caught.value).isprintable()
    return str(caught.value)


@pytest.mark.parametrize("key", STEERING)
def test_no_key_can_steer_the_terminal(write, key):
    assert ":20:1: " in printed(write(f'{VISCO_ELASTIC}"{key}": 1\n'))


def test_no_name_and_no_change_can_steer_the_terminal(tmp_path):
    assert "\\x1b[31mred\\n.yaml:1:1: " in printed(tmp_path / "\x1b[31mred\n.yaml")
    for change in ("body.m\x1b[31m=1", 'body.mass="\\e[31m"', "body.mass=\x1b[3"):
        printed(plain(), [change])


@pytest.mark.parametrize("name", ["key", "problem"])
def test_long_texts_are_cut_in_a_message(name):
    def shown(length):
        texts = {"key": "k", "problem": "p", name: "x" * length}
        return str(ConfigProblem(Location("a.yaml"), **texts, expected=""))

    assert "x" * 200 in shown(200)
    assert "x" * 197 + "..." in shown(201)
    assert "x" * 198 not in shown(201)


@pytest.mark.parametrize(
    "line", ["? {}\n: 1\n", "a: !{} 1\n", "a: &{} 1\n", "a: *{}\n", "a: '{}\n", "a: {}]\n: ["]
)
def test_no_message_is_long(complaints, line):
    """A message is one line of a terminal, whatever the file has: a key, a tag, an alias."""
    messages = complaints(VISCO_ELASTIC + line.format("x" * 100_000))
    assert messages
    assert all(len(message) < 700 for message in messages)
