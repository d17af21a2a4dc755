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
    ("&a title: Case\n" + VISCO_ELASTIC[12:], ["1:1: has the anchor &a (expected no anchors)"]),
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
    (VISCO_ELASTIC + "*a : 1\n", ["20:1: is the alias *a (expected values written out)"]),
    (VISCO_ELASTIC + "---\ntitle: b\n", ["20:1: starts a second document (expected one document)"]),
    ("[a]: 1\n" + VISCO_ELASTIC, ["1:1: has a mapping or a list as a key (expected text as a key"]),
    ("? {a: 1}\n: 1\n", ["1:3: has a mapping or a list as a key (expected text as a key)"]),
]


@pytest.mark.parametrize(("text", "expected"), REFUSED)
def test_refused(complaints, text, expected):
    found = complaints(text)
    assert len(found) == len(expected)
    assert all(message.startswith(e) for message, e in zip(found, expected, strict=True))


def test_an_anchor_and_its_aliases_are_each_reported(complaints):
    text = edited("K_t: [4100, 4100, 3280]", "K_t: &k [4100, 4100, 3280]")
    text = edited("K_c: [12300, 12300, 9840]", "K_c: *k", text)
    assert complaints(text) == [
        "8:8: controller.K_t: has the anchor &k (expected no anchors)",
        "12:8: controller.K_c: is the alias *k (expected values written out)",
    ]


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
    assert found == ["3:23: is nested too deeply (expected at most 16 levels)"]


@pytest.mark.parametrize("text", ["[" * 100_000, "- " * 100_000, "a:\n" + "? " * 50_000])
def test_very_deep_nesting_ends_early(complaints, text):
    (message,) = complaints(text)
    assert message.endswith(("levels)", "text as a key)"))


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


@pytest.mark.parametrize("indent", ["\t", "  \t"])
def test_a_tab_at_the_begin_of_a_line_is_named(complaints, indent):
    (message,) = complaints(edited("  mass", f"{indent}mass"))
    assert message.startswith("3:")
    assert message.endswith("begins with a tab (expected spaces: YAML is not indented with tabs)")


def test_lists_of_problems_are_bounded(complaints):
    found = complaints("a: [" + "*x, " * 500 + "]")
    assert len(found) == 100
    assert found[-1] == "1:401: a[99]: is the alias *x (expected values written out)"


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


def test_an_alias_as_a_key_ends_the_reading(complaints):
    """What follows such an alias cannot be read as keys and values any more."""
    assert complaints("*a : 1\nb: 2\n") == ["1:1: is the alias *a (expected values written out)"]
