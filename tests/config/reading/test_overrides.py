"""`--set key=value` changes any entry of a config, and its errors name the change."""

import pytest
from support.configs import VISCO_ELASTIC, edited, plain

from rbstab.config.load import load_config
from rbstab.config.numbers import value_at
from rbstab.config.source import key_of
from rbstab.config.units import parse_key


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


@pytest.mark.parametrize(
    "path", [("a",), ("a", "b"), ("a", 0), ("a", 12, 3, "b_c", 0), ("K_t", 0, "x")]
)
def test_a_key_and_its_path_are_inverse(path):
    assert parse_key(key_of(path)) == path


@pytest.mark.parametrize("text", ["", ".", "a.", ".a", "a..b", "a[", "a[]", "a[x]", "[a]", "a b"])
def test_no_key(text):
    assert parse_key(text) is None


def test_a_single_change_may_be_a_text():
    """A single text is one change, and not a sequence of letters."""
    assert load_config(plain(), "body.mass=5").body.mass == 5.0


K_T = "controller.K_t"

# Changes, and where a value then stands.
SET = [
    (["body.mass=50"], "body.mass", 50.0),
    (["body.mass= 5  # kg"], "body.mass", 5.0),
    (["body.mass=1e-9"], "body.mass", 1e-9),
    (["body.mass=-1", "body.mass=3"], "body.mass", 3.0),
    (["title=a = b"], "title", "a = b"),
    (['title="5"'], "title", "5"),
    ([f"{K_T}[1]=1e3"], K_T, (4100.0, 1e3, 3280.0)),
    (["body.inertia[0]=1"], "body.inertia", (1.0, 8.0, 0.4)),
    (["gravity=[0, 0, -9.81]"], "gravity", (0.0, 0.0, -9.81)),
    (["gravity[2]=-9.81"], "gravity", (0.0, 0.0, -9.81)),
    (
        ["body.inertia=[[3, 1, 0], [1, 3, 0], [0, 0, 3]]", "body.inertia[2][2]=6"],
        "body.inertia",
        ((3.0, 1.0, 0.0), (1.0, 3.0, 0.0), (0.0, 0.0, 6.0)),
    ),
    (["initial={orientation: [0, 0.5, 0]}"], "initial.angular_velocity", (0.0, 0.0, 0.0)),
    (["initial={}", "initial.orientation[1]=0.1"], "initial.orientation", (0.0, 0.1, 0.0)),
    (["reference.source=a", "reference.final.velocity=[1, 2, 3]"], "reference.source", "a"),
]


@pytest.mark.parametrize(("changes", "key", "expected"), SET)
def test_a_value_is_set(load, changes, key, expected):
    assert value_at(load(VISCO_ELASTIC, *changes), parse_key(key) or ()) == expected


# Changes, and the source, the place and the key of each problem.
WRONG = [
    (["body.mass=  -1"], ["body.mass:1:13 body.mass"]),
    (["body.mass=heavy"], ["body.mass:1:11 body.mass"]),
    (["body.mass=\n  -1"], ["body.mass:2:3 body.mass"]),
    (["body.mass=[1, 2"], ["body.mass:2:1 body.mass"]),
    (["body.mass=1\0"], ["body.mass:1:12 body.mass"]),
    (["body.mass=1\n \x1b"], ["body.mass:2:2 body.mass"]),
    (["body.mass=*a"], ["body.mass:1:11 body.mass"]),
    (["body.mass={a: 1, a: 2}"], ["body.mass:1:11 body.mass", "body.mass:1:18 body.mass.a"]),
    (["gravity=[0, x, 0]"], ["gravity:1:13 gravity[1]"]),
    ([f"{K_T}[1]=-1"], [f"{K_T}[1]:1:19 {K_T}[1]"]),
    ([f"{K_T}=[[1, 0, 0], [0, 1, 0], [0, 0]]"], [f"{K_T}:1:39 {K_T}[2]"]),
    (["controller.variant=rigid"], ["controller.variant:1:20 controller.variant"]),
    (["body=5"], ["body:1:6 body"]),
    (["body="], ["body:1:6 body"]),
    (["body={mass: 1, inertia: [1, 1, 1]}"], ["body:1:6 body.contact_point"]),
    (["title=x\n---\ny"], ["title:2:1 title"]),
    (["reference.final.position=[1,2,3]"], ["reference.final.position:1:1 reference.source"]),
    (["more.of.it=1"], ["more.of.it:1:1 more"]),
    (["bodi.mass=5"], ["bodi.mass:1:1 bodi"]),
    (["controller.K_d=[1, 1, 1]"], ["controller.K_d:1:1 controller.K_d"]),
    (["body.mass.x.y=5"], ["body.mass.x.y:1:1 body.mass.x"]),
    (["body[0]=5"], ["body[0]:1:1 body[0]"]),
    ([f"{K_T}[3][0]=5"], [f"{K_T}[3][0]:1:1 {K_T}[3]"]),
    ([".".join("a" * 16) + "=1"], [".".join("a" * 16) + ":1:1 a"]),
    (
        ["initial.orientation={deg: [30, 0, 0]}", "initial.orientation[0]=0.3"],
        ["initial.orientation[0]:1:1 initial.orientation[0]"],
    ),
    # All at once, also those that are found only when the whole config is checked.
    (
        ["initial.oriention=3", "body.mass="],
        ["body.mass:1:11 body.mass", "initial.oriention:1:1 initial.oriention"],
    ),
]


@pytest.mark.parametrize(("changes", "expected"), WRONG)
def test_wrong_changes(complaints, changes, expected):
    found = complaints(VISCO_ELASTIC, *changes)
    assert [" ".join(message.split(": ")[:2]) for message in found] == [
        f"--set {x}" for x in expected
    ]


NO_KEY = [
    "body.mass",
    "=5",
    "",
    "body..mass=5",
    ".mass=5",
    "body mass=5",
    "body.mass =5",
    "K[-1]=5",
]
NO_KEY += ["K[01]=5", "K[0=5", "K[9999999]=5", ".".join("a" * 17) + "=5"]


@pytest.mark.parametrize("change", NO_KEY)
def test_what_is_no_assignment(complaints, change):
    assert complaints(VISCO_ELASTIC, change) == [
        f"--set {change.partition('=')[0]}:1:1: is not an assignment of a key "
        "(expected key=value with a key like body.inertia[0])"
    ]


def test_whole_messages(complaints):
    text = edited("duration: 2.0", "duration: 0")
    assert complaints(text, "body.mass=-1", "body.mas=5", "body.mass.x=5") == [
        "--set body.mas:1:1: body.mas: is unknown (did you mean mass?)",
        "--set body.mass:1:11: body.mass: is -1 (expected a number greater than 0)",
        "--set body.mass.x:1:1: body.mass.x: does not exist (expected a key of the config)",
        "18:13: integration.duration: is 0 (expected a number greater than 0)",
    ]
