"""Problems are reported all at once, in order, one line each, without control characters."""

import pytest
from support.configs import VISCO_ELASTIC, plain

from rbstab.config.errors import ConfigError, ConfigProblem, Location
from rbstab.config.load import load_config


def test_order_is_by_place_not_by_text():
    """Line 10 comes after line 9, and column 20 after column 3."""
    places = [(10, 1), (9, 20), (9, 3), (2, 100)]
    problems = [ConfigProblem(Location("a", *place), "k", "is wrong", "") for place in places]
    shown = [str(problem) for problem in ConfigError(problems).problems]
    assert shown == [f"a:{line}:{column}: k: is wrong" for line, column in sorted(places)]


def test_a_very_long_list_ends_with_how_many_are_left_out():
    problems = [ConfigProblem(Location("a", line), "k", "is wrong", "") for line in range(1, 151)]
    shown = [str(problem) for problem in ConfigError(problems).problems]
    assert shown[:99] == [f"a:{line}:1: k: is wrong" for line in range(1, 100)]
    assert shown[99:] == ["a:100:1: 51 more problems are not listed"]
    assert len(ConfigError(problems[:100]).problems) == 100
    assert str(ConfigError(problems[:100]).problems[-1]) == "a:100:1: k: is wrong"


def test_parts_of_a_message():
    where = Location("f.yaml", 2, 3)
    assert str(ConfigProblem(where, "a.b[0]", "is bad", "expected good")) == (
        "f.yaml:2:3: a.b[0]: is bad (expected good)"
    )
    assert str(ConfigProblem(where, "", "is bad", "")) == "f.yaml:2:3: is bad"


def test_an_error_of_the_config_is_an_error_of_the_value():
    """A caller that does not import ConfigError can catch ValueError."""
    assert issubclass(ConfigError, ValueError)


STEERING = [
    '"a\\e[31mb": 1\n',
    '"a\\u009b31m": 1\n',
    '"a\\nb: 2": 1\n',
    '"a\\rb": 1\n',
    '"a\\bb": 1\n',
    '"\\u202eevil": 1\n',
    '"a\\0b": 1\n',
    '"a\\u2028b": 1\n',
]


@pytest.mark.parametrize("line", STEERING)
def test_a_key_cannot_steer_the_terminal(write, line):
    with pytest.raises(ConfigError) as caught:
        load_config(write(VISCO_ELASTIC + line))
    assert str(caught.value).isprintable()
    assert ":20:1: " in str(caught.value)


def test_a_file_name_cannot_steer_the_terminal(tmp_path):
    with pytest.raises(ConfigError) as caught:
        load_config(tmp_path / "\x1b[31mred\n.yaml")
    assert str(caught.value).isprintable()
    assert "\\x1b[31mred\\n.yaml:1:1: " in str(caught.value)


@pytest.mark.parametrize("change", ["body.m\x1b[31m=1", 'body.mass="\\e[31m"', "body.mass=\x1b[3"])
def test_a_change_cannot_steer_the_terminal(change):
    with pytest.raises(ConfigError) as caught:
        load_config(plain(), [change])
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("name", ["key", "problem"])
def test_long_texts_are_cut_in_a_message(name):
    texts = {"key": "k", "problem": "p"}
    place = Location("a.yaml")
    whole = str(ConfigProblem(place, **(texts | {name: "x" * 200}), expected=""))
    assert "x" * 200 in whole
    cut = str(ConfigProblem(place, **(texts | {name: "x" * 201}), expected=""))
    assert "x" * 197 + "..." in cut
    assert "x" * 198 not in cut
