"""A value of the wrong type or out of bounds is reported with place, key and expectation."""

import pytest
from support.configs import VISCO_ELASTIC, edited

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config

MASS = "mass: 41.0"
POINT = "contact_point: [0.15, 0.10, -0.42]"
DURATION = "duration: 2.0"
SAMPLES = "samples: 11"
TITLE = "title: Case"

NUMBERS = [
    ("-1", "3:9: body.mass: is -1 (expected a number greater than 0)"),
    ("0", "3:9: body.mass: is 0 (expected a number greater than 0)"),
    ("   -2.5", "3:12: body.mass: is -2.5 (expected a number greater than 0)"),
    (".inf", "3:9: body.mass: is inf (expected a finite number)"),
    ("-.Inf", "3:9: body.mass: is -inf (expected a finite number)"),
    (".nan", "3:9: body.mass: is nan (expected a finite number)"),
    ("1e999", "3:9: body.mass: is inf (expected a finite number)"),
    ("true", "3:9: body.mass: is true (expected a number)"),
    ("False", "3:9: body.mass: is false (expected a number)"),
    ('"41"', "3:9: body.mass: is the text '41' (expected a number)"),
    ("'4.1e1'", "3:9: body.mass: is the text '4.1e1' (expected a number)"),
    ("yes", "3:9: body.mass: is the text 'yes' (expected a number)"),
    ("2020-01-01", "3:9: body.mass: is the text '2020-01-01' (expected a number)"),
    ("41 kg", "3:9: body.mass: is the text '41 kg' (expected a number)"),
    ("4,1", "3:9: body.mass: is the text '4,1' (expected a number; with a decimal point: 4.1)"),
    ("[41.0]", "3:9: body.mass: is a list of 1 (expected a number)"),
    ("{}", "3:9: body.mass: is a mapping (expected a number)"),
    ("~", "3:9: body.mass: is empty (expected a number)"),
    ("", "3:8: body.mass: is empty (expected a number)"),
    ("x" * 41, f"3:9: body.mass: is the text '{'x' * 37}...' (expected a number)"),
    ("y" * 40, f"3:9: body.mass: is the text '{'y' * 40}' (expected a number)"),
]


@pytest.mark.parametrize(("value", "expected"), NUMBERS)
def test_number(complaints, value, expected):
    assert complaints(edited(MASS, f"mass: {value}")) == [expected]


VECTORS = [
    ("[1, 2]", ["5:18: body.contact_point: has 2 entries (expected 3)"]),
    ("[1]", ["5:18: body.contact_point: has 1 entry (expected 3)"]),
    ("[]", ["5:18: body.contact_point: has 0 entries (expected 3)"]),
    ("[1, 2, 3, 4]", ["5:18: body.contact_point: has 4 entries (expected 3)"]),
    ("[1, a, 3]", ["5:22: body.contact_point[1]: is the text 'a' (expected a number)"]),
    ("[1, 2, .nan]", ["5:25: body.contact_point[2]: is nan (expected a finite number)"]),
    ("[true, 2, 3]", ["5:19: body.contact_point[0]: is true (expected a number)"]),
    ('["1", 2, 3]', ["5:19: body.contact_point[0]: is the text '1' (expected a number)"]),
    ("[1, [2], 3]", ["5:22: body.contact_point[1]: is a list of 1 (expected a number)"]),
    (
        "[.inf, 2, x]",
        [
            "5:19: body.contact_point[0]: is inf (expected a finite number)",
            "5:28: body.contact_point[2]: is the text 'x' (expected a number)",
        ],
    ),
    ("0.15", ["5:18: body.contact_point: is 0.15 (expected a list of 3)"]),
    ("0.15 0.1 -0.42", "the text"),
    ("{x: 1}", ["5:18: body.contact_point: is a mapping (expected a list of 3)"]),
    ("\n    - 1\n    - 2\n    - z", ["8:7: body.contact_point[2]: is the text 'z'"]),
]


@pytest.mark.parametrize(("value", "expected"), VECTORS)
def test_vector(complaints, value, expected):
    found = complaints(edited(POINT, f"contact_point: {value}"))
    if isinstance(expected, str):
        assert expected in found[0]
    else:
        assert [message[: len(start)] for message, start in zip(found, expected, strict=True)] == (
            expected
        )


INTEGRATION = [
    (DURATION, "duration: 0", "18:13: integration.duration: is 0 (expected a number greater"),
    (DURATION, "duration: -1", "18:13: integration.duration: is -1 (expected a number greater"),
    (DURATION, "duration: .inf", "18:13: integration.duration: is inf (expected a finite number)"),
    (DURATION, "duration: 2 s", "18:13: integration.duration: is the text '2 s'"),
    (SAMPLES, "samples: 1", "19:12: integration.samples: is 1 (expected a number at least 2)"),
    (SAMPLES, "samples: 0", "19:12: integration.samples: is 0 (expected a number at least 2)"),
    (SAMPLES, "samples: -3", "19:12: integration.samples: is -3 (expected a number at least 2)"),
    (SAMPLES, "samples: 11.5", "19:12: integration.samples: is 11.5 (expected a whole number)"),
    (SAMPLES, "samples: true", "19:12: integration.samples: is true (expected a whole number)"),
    (SAMPLES, 'samples: "11"', "19:12: integration.samples: is the text '11' (expected a whole"),
    (SAMPLES, "samples: 11.5", "19:12: integration.samples: is 11.5 (expected a whole number)"),
    (SAMPLES, "samples: 2000000", "19:12: integration.samples: is 2"),
]


@pytest.mark.parametrize(("old", "new", "expected"), INTEGRATION)
def test_duration_and_samples(complaints, old, new, expected):
    (message,) = complaints(edited(old, new))
    assert message.startswith(expected)


ADDED = [
    ("rtol: 0", "20:9: integration.rtol: is 0 (expected a number at least 1e-16)"),
    ("rtol: 1e-17", "20:9: integration.rtol: is 1e-17 (expected a number at least 1e-16)"),
    ("rtol: 0.2", "20:9: integration.rtol: is 0.2 (expected a number at most 0.1)"),
    ("atol: 0", "20:9: integration.atol: is 0 (expected a number greater than 0)"),
    ("atol: 2", "20:9: integration.atol: is 2 (expected a number at most 1)"),
    ("range_bound: 1", "20:16: integration.range_bound: is 1 (expected a number less than 1)"),
    ("range_bound: 0", "20:16: integration.range_bound: is 0 (expected a number greater than 0)"),
    ("step_limit: 0", "20:15: integration.step_limit: is 0 (expected a number at least 1)"),
    ("step_limit: 1.5", "20:15: integration.step_limit: is 1.5 (expected a whole number)"),
    ("time_limit: 0", "20:15: integration.time_limit: is 0 (expected a number greater than 0)"),
    ("time_limit: .inf", "20:15: integration.time_limit: is inf (expected a finite number)"),
    ("engine: 5", "20:11: integration.engine: is 5 (expected scipy or heyoka)"),
    (
        "engine: Scipy",
        "20:11: integration.engine: is the text 'Scipy' "
        "(expected scipy or heyoka; did you mean scipy?)",
    ),
    (
        "method: RK23",
        "20:11: integration.method: is the text 'RK23' (expected DOP853, RK45, LSODA or Radau)",
    ),
    (
        "method: DOP835",
        "20:11: integration.method: is the text 'DOP835' "
        "(expected DOP853, RK45, LSODA or Radau; did you mean DOP853?)",
    ),
    ("coordinates: manifold", "20:16: integration.coordinates: is the text 'manifold' (expected"),
    ("coordinates: true", "20:16: integration.coordinates: is true (expected Z, W or quaternion)"),
    # SciPy would only warn, and use a larger tolerance.
    ("rtol: 1e-14", "20:9: integration.rtol: 1e-14 is too small for the engine scipy"),
]


@pytest.mark.parametrize(("line", "expected"), ADDED)
def test_integration(complaints, line, expected):
    (message,) = complaints(f"{VISCO_ELASTIC}  {line}\n")
    assert message.startswith(expected)


def test_samples_that_are_too_close(load, complaints):
    """Eleven samples have ten intervals, so they are just far enough apart."""
    text = edited("duration: 2.0", "duration: 1.05e-99")
    assert load(text).integration.samples == 11
    assert complaints(edited("samples: 11", "samples: 12", text)) == [
        "19:12: integration.samples: 12 samples in 1.05e-99 s are too close "
        "(expected at least 1e-100 s between samples)"
    ]


def test_the_compiled_engine_takes_a_tolerance_that_scipy_cannot(load):
    config = load(f"{VISCO_ELASTIC}  rtol: 1e-15\n  engine: heyoka\n")
    assert config.integration.rtol == 1e-15


TEXTS = [
    ("title: 5", "1:8: title: is 5 (expected a text)"),
    ("title: true", "1:8: title: is true (expected a text)"),
    ("title:", "1:7: title: is empty (expected a text)"),
    ('title: ""', "1:8: title: is empty (expected a text)"),
    (f"title: {'x' * 201}", "1:8: title: has 201 characters (expected at most 200)"),
]


def test_text_with_a_null_character(complaints):
    (message,) = complaints(edited(TITLE, 'title: "a\\0b"'))
    assert message.startswith("1:8: title: ")


@pytest.mark.parametrize(("line", "expected"), TEXTS)
def test_text(complaints, line, expected):
    assert complaints(edited(TITLE, line)) == [expected]


def test_the_message_names_the_file(write):
    path = write(edited(MASS, "mass: -1"))
    with pytest.raises(ConfigError) as caught:
        load_config(path)
    assert str(caught.value) == f"{path}:3:9: body.mass: is -1 (expected a number greater than 0)"


@pytest.mark.parametrize("text", ["2000001", "1000001", "11.5"])
def test_what_is_shown_is_not_what_was_expected(complaints, text):
    (message,) = complaints(edited(SAMPLES, f"samples: {text}"))
    assert f"is {text} " in message


def test_gravity_is_a_vector(complaints):
    for number in ("-9.81", "9.81"):
        (found,) = complaints(VISCO_ELASTIC + f"gravity: {number}\n")
        expected = "(expected a list of 3; down is [0, 0, -9.81])"
        assert found == f"20:10: gravity: is {number} {expected}"


@pytest.mark.parametrize("sign", ["", "-"])
def test_the_digits_of_a_very_long_whole_number_are_not_shown(complaints, sign):
    long = "a whole number of more than 15 digits"
    for text, found in (("999000000000000", "9.99e+14"), ("1" + "0" * 15, None)):
        (message,) = complaints(edited(SAMPLES, f"samples: {sign}{text}"))
        shown = long if found is None else f"{sign}{found}"
        assert message.startswith(f"19:12: integration.samples: is {shown} (expected a number ")
