"""A large file is refused after little work: the reader stops at the first limit exceeded."""

import pytest
from support.configs import VISCO_ELASTIC, edited

from rbstab.config import source
from rbstab.config.source import MAX_CONTAINERS, MAX_DEPTH, MAX_KEYS, parse_source

UNKNOWN = "".join(f"k{number:05d}: 1\n" for number in range(90_000))


@pytest.fixture
def added(monkeypatch):
    """Count the values that the reader begins."""
    counted = []
    read = source._Reader.value

    def count_and_read(self, event, path):
        counted.append(path)
        return read(self, event, path)

    monkeypatch.setattr(source._Reader, "value", count_and_read)
    return counted


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (UNKNOWN, "1:1: "),
        (VISCO_ELASTIC + UNKNOWN, "1:1: "),
        (f"a: 1\nbody: {{{UNKNOWN.replace(chr(10), ', ')}}}\n", "2:7: body: "),
    ],
    ids=["alone", "beside a config", "in a section"],
)
def test_many_unknown_keys(complaints, added, text, place):
    assert complaints(text) == [
        f"{place}has more than {MAX_KEYS} keys (expected at most {MAX_KEYS})"
    ]
    assert len(added) <= MAX_KEYS + len(VISCO_ELASTIC)


def test_the_limits():
    """Files that were valid stay valid: the limits may grow, and never shrink."""
    assert (MAX_KEYS, MAX_CONTAINERS, MAX_DEPTH) == (1000, 10_000, 16)


def test_the_largest_number_of_keys_is_read():
    text = "".join(f"k{number}: 1\n" for number in range(MAX_KEYS))
    assert len(parse_source(text, "text").data) == MAX_KEYS


def test_one_key_too_many(complaints):
    text = "".join(f"k{number}: 1\n" for number in range(MAX_KEYS + 1))
    assert complaints(text) == [f"1:1: has more than {MAX_KEYS} keys (expected at most {MAX_KEYS})"]


def test_many_unknown_keys_are_counted(complaints):
    """The problems beyond the limit are counted, and only the listed ones get a suggestion each."""
    text = VISCO_ELASTIC + "".join(f"k{number:03d}: 1\n" for number in range(900))
    found = complaints(text)
    assert len(found) == 100
    assert found[0].startswith("20:1: k000: is unknown")
    assert found[-1] == "119:1: 801 more problems are not listed"


def test_many_nested_lists(complaints, added):
    found = complaints("a: [" + "[]," * 100_000 + "]\n")
    # The mapping and the outer list count too.
    number = MAX_CONTAINERS - 2
    assert found == [
        f"1:{5 + 3 * number}: a[{number}]: is mapping or list number {MAX_CONTAINERS + 1} "
        f"(expected at most {MAX_CONTAINERS})"
    ]
    assert len(added) == MAX_CONTAINERS + 1


def test_the_largest_number_of_lists_is_read():
    text = "[" + "[]," * (MAX_CONTAINERS - 1) + "]"
    assert len(parse_source(text, "text").data) == MAX_CONTAINERS - 1


@pytest.mark.parametrize("opening", ["[", "{a: "])
def test_deep_nesting(complaints, added, opening):
    [found] = complaints(opening * 100_000)
    assert found.endswith("is nested too deeply (expected at most 16 levels)")
    # libyaml 0.2.6 reads brackets up to a bound of its own before it reports the first one.
    assert len(added) <= MAX_DEPTH + 1


@pytest.mark.parametrize("entry", ["1", "a"])
def test_a_long_list_is_one_problem(complaints, entry):
    found = complaints(edited("[10.0, 8.0, 0.4]", f"[{f'{entry},' * 1000}]"))
    assert found == ["4:12: body.inertia: has 1000 entries (expected 3)"]


def test_a_long_list_of_the_reference_is_one_problem(complaints):
    names = f"[{'a,' * 101}]"
    reference = f"reference: {{source: a, final: {{orientation: {names}}}}}\n"
    found = complaints(VISCO_ELASTIC + reference)
    assert found == ["20:45: reference.final.orientation: has 101 entries (expected 3)"]


def test_long_texts(complaints):
    long = "x" * 1_000_000
    assert complaints(edited("Case", long)) == [
        "1:8: title: has 1000000 characters (expected at most 200)"
    ]
    found = complaints(edited("visco-elastic", long))
    assert [len(message) < 200 for message in found] == [True]


@pytest.mark.parametrize(
    "line", ["? {}\n: 1\n", "a: !{} 1\n", "a: &{} 1\n", "a: *{}\n", "a: '{}\n", "a: {}]\n: ["]
)
def test_no_message_is_long(complaints, line):
    """A message is one line of a terminal, whatever the file has: a key, a tag, an alias."""
    found = complaints(VISCO_ELASTIC + line.format("x" * 100_000))
    assert found
    assert all(len(message) < 700 for message in found)
    assert any("..." in message or message.startswith("2") for message in found)
