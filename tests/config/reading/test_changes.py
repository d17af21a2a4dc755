"""`--set key=value` changes any entry of a config; a config can be a mapping from Python."""

from collections import OrderedDict
from types import MappingProxyType

import numpy as np
import pytest
from support.config_elements import YAML
from support.configs import BY_VARIANT, VISCO_ELASTIC, edited, plain

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.config.numbers import value_at
from rbstab.config.source import key_of
from rbstab.config.units import parse_key


@pytest.mark.parametrize(
    "path", [("a",), ("a", "b"), ("a", 0), ("a", 12, 3, "b_c", 0), ("K_t", 0, "x")]
)
def test_a_key_and_its_path_are_inverse(path):
    assert parse_key(key_of(path)) == path


def test_what_is_wrong_in_the_file_may_be_put_right(load):
    text = edited("mass: 41.0", "mass: heavy")
    assert load(text, "body.mass=41").body.mass == 41.0
    from_nothing = [
        "body={mass: 1, inertia: [1, 1, 1], contact_point: [0, 0, 1]}",
        "controller={variant: free, K_t: [1, 1, 1], L_t: [1, 1, 1]}",
        "controller.K_r=[1, 1, 1]",
        "integration.duration=1",
    ]
    assert load("", *from_nothing).body.mass == 1.0
    # A single text is one change, and not a sequence of letters.
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


def test_what_the_file_leaves_out_can_be_set(load):
    assert load(YAML, "elements.strut.damping=7").elements["strut"].damping == 7.0
    # Without a controller, the initial state has its defaults too.
    assert load(YAML, "initial.position[2]=0.5").initial.position == (0.0, 0.0, 0.5)


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
def test_a_wrong_change_is_told_with_its_place_and_its_key(complaints, changes, expected):
    messages = complaints(VISCO_ELASTIC, *changes)
    assert [" ".join(message.split(": ")[:2]) for message in messages] == [
        f"--set {x}" for x in expected
    ]


NO_KEYS = ["", ".", "a.", ".a", "a..b", "a[", "a[]", "a[x]", "[a]", "a b", "a ", "K[-1]", "K[01]"]
NO_KEYS += ["K[0", "K[9999999]", ".".join("a" * 17)]


@pytest.mark.parametrize("change", ["body.mass", *(f"{key}=5" for key in NO_KEYS)])
def test_what_is_no_assignment(complaints, change):
    assert complaints(VISCO_ELASTIC, change) == [
        f"--set {change.partition('=')[0]}:1:1: is not an assignment of a key "
        "(expected key=value with a key like body.inertia[0])"
    ]


def test_whole_messages_of_changes(complaints):
    text = edited("duration: 2.0", "duration: 0")
    assert complaints(text, "body.mass=-1", "body.mas=5", "body.mass.x=5") == [
        "--set body.mas:1:1: body.mas: is unknown (did you mean mass?)",
        "--set body.mass:1:11: body.mass: is -1 (expected a number greater than 0)",
        "--set body.mass.x:1:1: body.mass.x: does not exist (expected a key of the config)",
        "18:13: integration.duration: is 0 (expected a number greater than 0)",
    ]


def with_body(**changes):
    data = plain()
    data["body"] |= changes
    return data


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_a_mapping_gives_the_config_of_the_file(load, variant):
    assert load_config(plain(BY_VARIANT[variant])) == load(BY_VARIANT[variant])


@pytest.mark.parametrize(
    "data",
    [
        with_body(inertia=(10.0, 8.0, 0.4)),
        with_body(inertia=np.array([10.0, 8.0, 0.4])),
        with_body(inertia=[np.float64(10), np.int64(8), 0.4]),
        *(with_body(mass=kind(41)) for kind in (int, np.float64, np.float32, np.int8, np.array)),
        OrderedDict(reversed(plain().items())),
        MappingProxyType(plain()),
    ],
)
def test_kinds_of_numbers_and_containers(data):
    config = load_config(data)
    assert (config, repr(config)) == (load_config(plain()), repr(load_config(plain())))


@pytest.mark.parametrize("kind", [tuple, list, np.array])
def test_the_mapping_is_neither_changed_nor_kept(kind):
    inertia = kind([10.0, 8.0, 0.4])
    data = with_body(inertia=inertia)
    config = load_config(data, ["body.inertia[1]=9", "gravity=[0, 0, 1]"])
    assert data == plain() | {"body": data["body"]}
    assert list(inertia) == [10.0, 8.0, 0.4]
    data["body"]["inertia"] = -1.0
    assert config.body.inertia == (10.0, 9.0, 0.4)


ITSELF = plain()
ITSELF["body"]["again"] = ITSELF

REFUSED = [
    (with_body(mass=-1), "body.mass: is -1 (expected a number greater than 0)"),
    (with_body(mass=float("nan")), "body.mass: is nan (expected a finite number)"),
    (with_body(mass=np.bool_(True)), "body.mass: is true (expected a number)"),
    (with_body(mass=1j), "body.mass: is a complex (expected a number)"),
    (with_body(mass=None), "body.mass: is empty (expected a number)"),
    *((with_body(mass=x), "body.mass: is ") for x in (object(), b"41", 10**400, range)),
    (with_body(mass=np.array([1.0])), "body.mass: is a list of 1 (expected a number)"),
    (with_body(inertia=np.zeros((2, 3))), "body.inertia: has 2 entries (expected 3)"),
    (with_body(inertia=np.array(["a", "1", "1"])), "body.inertia[0]: is the text 'a'"),
    (with_body(inertia={10.0, 8.0, 0.4}), "body.inertia: is "),
    (plain() | {"titel": "x"}, "titel: is unknown (did you mean title?)"),
    (plain() | {5: "x"}, "5: is unknown (expected one of schema_version,"),
    (plain() | {"controller": None}, "controller: is "),
    (plain() | {"[key]": None}, "[key]: is unknown"),
    (
        plain() | {"schema_version": 2, "elements": {"a": {"[key]": 1}}},
        "elements.a.kind: is missing",
    ),
    (
        plain() | {"controller": {"variant": "none"}},
        "controller: has the variant none (expected schema_version: 2 beside it)",
    ),
    (ITSELF, "is nested too deeply (at most 16 levels)"),
]


@pytest.mark.parametrize(("data", "expected"), REFUSED)
def test_wrong_plain_data_is_refused(data, expected):
    with pytest.raises(ConfigError) as caught:
        load_config(data)
    assert str(caught.value).splitlines()[0].startswith(f"config:1:1: {expected}")


@pytest.mark.parametrize("wrong", [None, 5, [1]])
def test_what_is_neither_path_nor_mapping(wrong):
    with pytest.raises(TypeError):
        load_config(wrong)


@pytest.mark.parametrize("nest", [lambda value: [value], lambda value: {"a": value}])
def test_the_depth_of_nesting_is_that_of_a_file(nest):
    """As in a file: 16 levels with the outermost mapping, and a value in the innermost one."""
    value = 1
    for _ in range(15):
        value = nest(value)
    with pytest.raises(ConfigError, match="more: is unknown"):
        load_config(plain() | {"more": value})
    with pytest.raises(ConfigError, match="is nested too deeply"):
        load_config(plain() | {"more": nest(value)})
