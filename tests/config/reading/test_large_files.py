"""A large file is refused after little work, and no message is long."""

import pytest
from support.configs import VISCO_ELASTIC, edited

from rbstab.config.source import MAX_DEPTH, parse_source

UNKNOWN = [f"k{number:05d}: 1" for number in range(90_000)]


def test_many_problems_are_counted(complaints):
    found = complaints(VISCO_ELASTIC + "\n".join(UNKNOWN[:900]))
    assert len(found) == 100
    assert found[0].startswith("20:1: k00000: is unknown")
    assert found[-1] == "119:1: 801 more problems are not listed"


@pytest.mark.parametrize(
    "text",
    [
        "\n".join(UNKNOWN),
        f"a: 1\nbody: {{{', '.join(UNKNOWN)}}}\n",
        edited("[10.0, 8.0, 0.4]", f"[{'a,' * 100_000}]"),
    ],
    ids=["keys", "keys of a section", "entries of a vector"],
)
def test_most_problems_are_not_described(complaints, text):
    assert complaints(text)[-1].endswith("at least 901 more problems are not listed")


def test_many_nested_lists_are_one_problem(complaints):
    (message,) = complaints(VISCO_ELASTIC + "a: [" + "[]," * 100_000 + "]\n")
    assert message.startswith("20:1: a: is unknown")


def test_the_largest_depth():
    """Files that were valid stay valid: the limit may grow, and never shrink."""
    assert MAX_DEPTH == 16
    text = "[" * MAX_DEPTH + "]" * MAX_DEPTH
    assert repr(parse_source(text, "text").data) == text


@pytest.mark.parametrize("opening", ["[", "{a: ", "- "])
def test_deep_nesting(complaints, opening):
    (found,) = complaints(opening * 100_000)
    assert "is nested too deeply (expected" in found or "nesting depth" in found


def test_long_texts(complaints):
    long = "x" * 1_000_000
    expected = "1:8: title: has 1000000 characters (expected at most 200 characters)"
    assert complaints(edited("Case", long)) == [expected]
    (found,) = complaints(edited("visco-elastic", long))
    assert len(found) < 200


@pytest.mark.parametrize(
    "line", ["? {}\n: 1\n", "a: !{} 1\n", "a: &{} 1\n", "a: *{}\n", "a: '{}\n", "a: {}]\n: ["]
)
def test_no_message_is_long(complaints, line):
    """A message is one line of a terminal, whatever the file has: a key, a tag, an alias."""
    found = complaints(VISCO_ELASTIC + line.format("x" * 100_000))
    assert found
    assert all(len(message) < 700 for message in found)
