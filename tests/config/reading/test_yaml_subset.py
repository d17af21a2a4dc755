"""A config may use a part of YAML only: one document of mappings, lists and plain values."""

import pytest
import yaml
from support.configs import VISCO_ELASTIC, edited

from rbstab.config import source

MASS = "mass: 41.0"


@pytest.fixture(params=["compiled", "pure Python"], autouse=True)
def _reader(request, monkeypatch):
    """Run each test with and without libyaml: messages must not depend on it."""
    if request.param == "pure Python":
        monkeypatch.setattr(source, "_Loader", yaml.SafeLoader)
    else:
        assert source._Loader is yaml.CSafeLoader


REFUSED = [
    (edited(MASS, "mass: *m"), ["3:9: body.mass: is the alias *m (expected values written out)"]),
    (edited(MASS, "mass: &m 41.0"), ["3:9: body.mass: has the anchor &m (expected no anchors)"]),
    (edited("body:", "body: &b"), ["2:7: body: has the anchor &b (expected no anchors)"]),
    ("&a title: Case\n" + VISCO_ELASTIC[12:], ["1:1: is a key that is no plain text"]),
    (
        edited(MASS, "mass: !!float 41.0"),
        ["3:9: body.mass: has the tag tag:yaml.org,2002:float (expected no tags)"],
    ),
    (
        edited(MASS, "mass: !!python/object/apply:os.system [ls]"),
        [
            "3:9: body.mass: has the tag tag:yaml.org,2002:python/object/apply:os.system "
            "(expected no tags)"
        ],
    ),
    ("!!map\n" + VISCO_ELASTIC, ["1:1: has the tag tag:yaml.org,2002:map (expected no tags)"]),
    (
        VISCO_ELASTIC + "*a : 1\n",
        ["20:1: is a key that is no plain text (expected text"],
    ),
    (VISCO_ELASTIC + "---\ntitle: b\n", ["20:1: starts a second document (expected one document)"]),
    (
        "[a]: 1\n" + VISCO_ELASTIC,
        ["1:1: is a key that is no plain text (expected text as a key)"],
    ),
    (
        "? {a: 1}\n: 1\n",
        ["1:3: is a key that is no plain text (expected text as a key)"],
    ),
]


@pytest.mark.parametrize(("text", "expected"), REFUSED)
def test_refused(complaints, text, expected):
    found = complaints(text)
    assert len(found) == len(expected)
    assert all(message.startswith(e) for message, e in zip(found, expected, strict=True))


def test_an_alias_bomb_is_refused_before_it_grows(complaints):
    """Nine levels of nine aliases each would expand to a billion entries."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 10)]
    found = complaints("\n".join(lines))
    assert len(found) <= 110
    assert any("is the alias *a8" in message for message in found)


def test_a_merge_key_is_no_way_around(complaints):
    found = complaints(edited("  mass: 41.0", "  <<: *b\n  mass: 41.0"))
    assert "3:7: body.<<: is the alias *b (expected values written out)" in found


def test_nesting_has_a_bound(complaints):
    deepest = edited(MASS, f"mass: {'[' * 14}1{']' * 14}")
    assert complaints(deepest) == ["3:9: body.mass: is a list of 1 (expected a number)"]
    found = complaints(edited(MASS, f"mass: {'[' * 15}1{']' * 15}"))
    key = f"body.mass{'[0]' * 14}"
    assert found == [f"3:23: {key}: is nested too deeply (expected at most 16 levels)"]


BROKEN = [
    (edited("mass: 41.0", "mass: a: b"), "3:10:"),
    (edited("title: Case", 'title: "\\q"'), "1:9:"),
    (edited("title: Case", "title: @x"), "1:8:"),
]


@pytest.mark.parametrize(("text", "place"), BROKEN)
def test_no_yaml(complaints, text, place):
    """The line must be right; words are PyYAML's, and libyaml counts columns differently."""
    (message,) = complaints(text)
    assert message.split(":")[0] == place.split(":")[0]
    assert message.endswith("(expected YAML)")


NO_MAPPING = [
    ("- 1\n", "1:1: is a list of 1 (expected a mapping)"),
    ("hello\n", "1:1: is the text 'hello' (expected a mapping)"),
    ("5\n", "1:1: is 5 (expected a mapping)"),
]


@pytest.mark.parametrize(("text", "expected"), NO_MAPPING)
def test_no_mapping(complaints, text, expected):
    assert complaints(text) == [expected]


@pytest.mark.parametrize("text", ["", "# a comment\n", "\n\n", "   "])
def test_empty_file(complaints, text):
    """The messages name the missing keys, and nothing else."""
    found = complaints(text)
    assert all(message.startswith("1:1: ") for message in found)
    assert all("is missing" in m or "is empty" in m for m in found)


def test_what_is_allowed(load):
    text = "%YAML 1.2\n---\n# comment\n"
    config = load(text + VISCO_ELASTIC.replace("41.0", "41.0  # kg") + "...\n")
    assert config.body.mass == 41.0


def test_an_alias_gets_no_second_complaint(complaints):
    """The value behind an alias is unknown, so its type is not checked."""
    assert len(complaints(edited("duration: 2.0", "duration: *d"))) == 1
    assert len(complaints(edited("samples: 11", "samples: &s 11"))) == 1


def test_the_first_of_repeated_keys_is_kept_and_the_others_are_read():
    read = source.parse_source("b: {c: [1, 2]}\nb: {c: {d: 3}, e: *x}\nb: 4\na: 5\n", "x")
    assert read.data == {"b": {"c": [1, 2]}, "a": 5}
    assert [str(problem.location) for problem in read.problems] == ["x:2:1", "x:2:19", "x:3:1"]
    assert str(read.location(("b", "c", 1))) == "x:1:12"
    assert ("b", "c", "d") not in read.values
    assert ("b", "e") not in read.keys
