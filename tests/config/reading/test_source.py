"""A config is one document of a part of YAML 1.2: mappings, lists and plain values, with places."""

import math

import pytest
import yaml
from support.configs import VISCO_ELASTIC, edited

from rbstab.config import source
from rbstab.config.source import MAX_DEPTH, parse_source

# What PyYAML, which follows YAML 1.1, reads in another way, stays a text.
TEXTS = """
685.230_15e+03 1_000 0x1F 0o14 0b11 190:20:30 1e e5 . + 1.2.3 --1 1e5.0 ١٢ inf nan NaN Infinity
yes no on Off y tRue nULL 2020-01-01 = <<
"""

SCALARS = {
    **{text: text for text in [*TEXTS.split(), "1 2", "2020-01-01 12:00:00"]},
    "'1'": "1",
    '"true"': "true",
    "''": "",
    '"~"': "~",
    "|\n  1": "1\n",
    ">-\n  1\n  2": "1 2",
    "true": True,
    "True": True,
    "FALSE": False,
    "false": False,
    **dict.fromkeys(["null", "NULL", "~", ""]),
    "1e-9": 1e-9,
    "1E5": 1e5,
    "1e+5": 1e5,
    ".5": 0.5,
    "-.5e1": -5.0,
    "5.": 5.0,
    "5.e2": 500.0,
    "+3": 3,
    "0": 0,
    "-0": 0,
    "-0.0": -0.0,
    "41": 41,
    "41.0": 41.0,
    "012": 12,
    ".inf": math.inf,
    "+.INF": math.inf,
    "-.Inf": -math.inf,
    "1e999": math.inf,
    **dict.fromkeys([".nan", ".NaN", ".NAN"], math.nan),
    "9" * 18: 999999999999999999,
    "9" * 19: 1e19,
}


@pytest.mark.parametrize(("text", "value"), SCALARS.items())
def test_a_scalar_is_that_of_yaml_1_2(text, value):
    # The text of a value has its type and its sign too.
    assert repr(parse_source(f"x: {text}\n", "a").data["x"]) == repr(value)


def test_nested_data_and_keys_are_texts():
    text = 'a:\n  - {b: [1, 2.5, x], c: }\n  - - true\n    - ~\n1e5: []\n~: {}\n"1": no\n'
    inner = [{"b": [1, 2.5, "x"], "c": None}, [True, None]]
    assert parse_source(text, "a").data == {"a": inner, "1e5": [], "~": {}, "1": "no"}


def test_a_missing_value_has_the_place_of_its_nearest_parent():
    parsed = parse_source("a:\n  - {b: 1, c: 2}\n  -   3\n", "name")
    assert str(parsed.location(("a", 0, "x", "y"), of_key=True)) == "name:2:5"
    assert str(parsed.location(("z",))) == "name:1:1"


def test_the_first_of_repeated_keys_is_kept_and_the_others_are_read():
    read = parse_source("b: {c: [1, 2]}\nb: {c: {d: 3}, e: *x}\nb: 4\na: 5\n", "x")
    assert read.data == {"b": {"c": [1, 2]}, "a": 5}
    assert [str(problem.location) for problem in read.problems] == ["x:2:1", "x:2:19", "x:3:1"]
    assert str(read.location(("b", "c", 1))) == "x:1:12"
    assert ("b", "c", "d") not in read.values
    assert ("b", "e") not in read.keys


def test_files_of_the_largest_depth_stay_valid():
    """The limit may grow, and never shrink."""
    assert MAX_DEPTH == 16
    text = "[" * MAX_DEPTH + "]" * MAX_DEPTH
    assert repr(parse_source(text, "text").data) == text


@pytest.fixture(params=["compiled", "pure Python"])
def _reader(request, monkeypatch):
    """Run a test with and without libyaml: messages must not depend on it."""
    if request.param == "pure Python":
        monkeypatch.setattr(source, "_Loader", yaml.SafeLoader)
    else:
        assert source._Loader is yaml.CSafeLoader


EITHER_READER = pytest.mark.usefixtures("_reader")
MASS = "mass: 41.0"
NO_KEY = "is a key that is no plain text"

# A text, and how the only message begins. The value of an alias is unknown: its type is no problem.
REFUSED = [
    (edited(MASS, "mass: *m"), "3:9: body.mass: is the alias *m (expected values written out)"),
    (edited("  mass: 41.0", "  <<: *b\n  mass: 41.0"), "3:7: body.<<: is the alias *b"),
    (edited("duration: 2.0", "duration: *d"), "18:13: integration.duration: is the alias"),
    (edited(MASS, "mass: &m 41.0"), "3:9: body.mass: has the anchor &m (expected no anchors)"),
    (edited("body:", "body: &b"), "2:7: body: has the anchor &b"),
    ("&a title: Case\n" + VISCO_ELASTIC[12:], f"1:1: {NO_KEY}"),
    (edited(MASS, "mass: !!float 41.0"), "3:9: body.mass: has the tag tag:yaml.org,2002:float ("),
    (
        edited(MASS, "mass: !!python/object/apply:os.system [ls]"),
        "3:9: body.mass: has the tag tag:yaml.org,2002:python/object/apply:os.system (expected no",
    ),
    ("!!map\n" + VISCO_ELASTIC, "1:1: has the tag tag:yaml.org,2002:map"),
    (VISCO_ELASTIC + "*a : 1\n", f"20:1: {NO_KEY} (expected text"),
    (VISCO_ELASTIC + "---\ntitle: b\n", "20:1: starts a second document (expected one document)"),
    ("[a]: 1\n" + VISCO_ELASTIC, f"1:1: {NO_KEY} (expected text as a key)"),
    ("? {a: 1}\n: 1\n", f"1:3: {NO_KEY}"),
    ("- 1\n", "1:1: is a list of 1 (expected a mapping)"),
    ("hello\n", "1:1: is the text 'hello' (expected a mapping)"),
    (edited(MASS, f"mass: {'[' * 14}1{']' * 14}"), "3:9: body.mass: is a list of 1 (expected a"),
    (
        edited(MASS, f"mass: {'[' * 15}1{']' * 15}"),
        f"3:23: body.mass{'[0]' * 14}: is nested too deeply (expected at most 16 levels)",
    ),
]


@EITHER_READER
@pytest.mark.parametrize(("text", "begin"), REFUSED)
def test_what_is_no_part_of_a_config_is_refused(complaints, text, begin):
    messages = complaints(text)
    assert messages[-1].startswith(begin)
    assert len(messages) == 1 + ("<<" in text)  # which is no key of the body either


@EITHER_READER
@pytest.mark.parametrize(
    ("old", "new", "line"),
    [(MASS, "mass: a: b", "3"), ("Case", '"\\q"', "1"), ("Case", "@x", "1")],
)
def test_what_is_no_yaml_is_refused_in_its_line(complaints, old, new, line):
    """Words are PyYAML's, and libyaml counts columns differently."""
    (message,) = complaints(edited(old, new))
    assert message.split(":")[0] == line
    assert message.endswith("(expected YAML)")


@EITHER_READER
@pytest.mark.parametrize("text", ["", "# a comment\n", "\n\n", "   "])
def test_an_empty_file_lacks_its_keys(complaints, text):
    messages = complaints(text)
    assert all(message.startswith("1:1: ") for message in messages)
    assert all("is missing" in message or "is empty" in message for message in messages)


@EITHER_READER
def test_an_alias_bomb_is_refused_before_it_grows(complaints):
    """Nine levels of nine aliases each would expand to a billion entries."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 10)]
    messages = complaints("\n".join(lines))
    assert len(messages) <= 110
    assert any("is the alias *a8" in message for message in messages)


@EITHER_READER
def test_directives_comments_and_ends_are_allowed(load):
    text = "%YAML 1.2\n---\n# comment\n"
    config = load(text + VISCO_ELASTIC.replace("41.0", "41.0  # kg") + "...\n")
    assert config.body.mass == 41.0
