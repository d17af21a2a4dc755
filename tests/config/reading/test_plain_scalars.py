"""Plain scalars follow the core schema of YAML 1.2, where PyYAML follows YAML 1.1."""

import math

import pytest

from rbstab.config.source import parse_source

NUMBERS = [
    ("1e-9", 1e-9),
    ("1E5", 1e5),
    ("1e+5", 1e5),
    (".5", 0.5),
    ("-.5e1", -5.0),
    ("+3", 3),
    ("5.", 5.0),
    ("-5.", -5.0),
    ("5.e2", 500.0),
    ("0", 0),
    ("-0", 0),
    ("-0.0", -0.0),
    ("41", 41),
    ("41.0", 41.0),
    ("012", 12),
    ("685.230_15e+03", "685.230_15e+03"),
    ("1_000", "1_000"),
    ("0x1F", "0x1F"),
    ("0o14", "0o14"),
    ("0b11", "0b11"),
    ("190:20:30", "190:20:30"),
    ("1e", "1e"),
    ("e5", "e5"),
    (".", "."),
    ("+", "+"),
    ("1.2.3", "1.2.3"),
    ("--1", "--1"),
    ("1e5.0", "1e5.0"),
    ("1 2", "1 2"),
    ("١٢", "١٢"),  # digits of another script
    ("inf", "inf"),
    ("nan", "nan"),
    ("NaN", "NaN"),
    ("Infinity", "Infinity"),
    (".inf", math.inf),
    ("+.INF", math.inf),
    ("-.Inf", -math.inf),
    ("1e999", math.inf),
    ("999999999999999999", 999999999999999999),
    ("9999999999999999999", 1e19),
]


@pytest.mark.parametrize(("text", "value"), NUMBERS)
def test_number(text, value):
    read = parse_source(f"x: {text}\n", "a").data["x"]
    assert type(read) is type(value)
    assert read == value
    if isinstance(value, float):
        assert math.copysign(1, read) == math.copysign(1, value)


@pytest.mark.parametrize("text", [".nan", ".NaN", ".NAN"])
def test_not_a_number(text):
    assert math.isnan(parse_source(f"x: {text}\n", "a").data["x"])


WORDS = [
    ("true", True),
    ("True", True),
    ("FALSE", False),
    ("false", False),
    ("null", None),
    ("NULL", None),
    ("~", None),
    ("", None),
    ("yes", "yes"),
    ("no", "no"),
    ("on", "on"),
    ("Off", "Off"),
    ("y", "y"),
    ("tRue", "tRue"),
    ("nULL", "nULL"),
    ("2020-01-01", "2020-01-01"),
    ("2020-01-01 12:00:00", "2020-01-01 12:00:00"),
    ("=", "="),
    ("<<", "<<"),
    ("'1'", "1"),
    ('"true"', "true"),
    ("''", ""),
    ('"~"', "~"),
    ("|\n  1", "1\n"),
    (">-\n  1\n  2", "1 2"),
]


@pytest.mark.parametrize(("text", "value"), WORDS)
def test_word(text, value):
    read = parse_source(f"x: {text}\n", "a").data["x"]
    assert type(read) is type(value)
    assert read == value


@pytest.mark.parametrize(
    ("text", "key"), [("1e5: x", "1e5"), ("true: x", "true"), ("~: x", "~"), ('"1": x', "1")]
)
def test_keys_are_texts(text, key):
    assert parse_source(text, "a").data == {key: "x"}


def test_nested_data():
    text = "a:\n  - {b: [1, 2.5, x], c: }\n  - - true\n    - ~\nd: []\ne: {}\n"
    assert parse_source(text, "a").data == {
        "a": [{"b": [1, 2.5, "x"], "c": None}, [True, None]],
        "d": [],
        "e": {},
    }


def test_places_of_all_values_and_keys():
    source = parse_source("a:\n  - {b: 1, c: 2}\n  -   3\n", "name")

    def place(*path, of_key=False):
        return str(source.location(path, of_key=of_key)).removeprefix("name:")

    assert place() == "1:1"
    assert place("a") == "2:3"
    assert place("a", of_key=True) == "1:1"
    assert place("a", 0) == "2:5"
    assert place("a", 0, "b") == "2:9"
    assert place("a", 0, "b", of_key=True) == "2:6"
    assert place("a", 0, "c") == "2:15"
    assert place("a", 0, "c", of_key=True) == "2:12"
    assert place("a", 1) == "3:7"
    # A missing value has the place of its nearest parent.
    assert place("a", 0, "x", "y", of_key=True) == "2:5"
    assert place("z") == "1:1"
