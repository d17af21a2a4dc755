"""Tolerances of numbers: `--within KEY=±SIZE`."""

from fractions import Fraction

import pytest
from support.configs import PERMANENT, plain

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.config.tolerances import tolerances_of

CONFIG = load_config(
    plain(PERMANENT),
    ["body.inertia=[[10, 0.5, 0], [0.5, 8, 0], [0, 0, 0.4]]", "body.contact_point[1]=0"],
)


def bounds(*texts):
    return {
        tolerance.entry.key: (tolerance.low, tolerance.high)
        for tolerance in tolerances_of(CONFIG, texts)
    }


def problems(*texts):
    with pytest.raises(ConfigError) as error:
        tolerances_of(CONFIG, texts)
    return [str(problem) for problem in error.value.problems]


SPIN = {
    "initial.angular_velocity[0]": (Fraction(31, 2), Fraction(33, 2)),
    "initial.angular_velocity[1]": (Fraction(63, 2), Fraction(65, 2)),
    "initial.angular_velocity[2]": (Fraction(-33, 2), Fraction(-31, 2)),
}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # A size holds for each number of a key; keyboards lack the sign.
        *((f"initial.angular_velocity={sign}0.5", SPIN) for sign in ("±", "+-", "+/-")),
        # Numbers and sizes are exact decimals.
        (
            "body.contact_point[0]=±0.1",
            {"body.contact_point[0]": (Fraction(1, 20), Fraction(1, 4))},
        ),
        # A percentage is of each number, and leaves zeros alone.
        (
            "body.contact_point=±10%",
            {
                "body.contact_point[0]": (Fraction("0.135"), Fraction("0.165")),
                "body.contact_point[2]": (Fraction("-0.462"), Fraction("-0.378")),
            },
        ),
        ("gravity[2]=±1", {"gravity[2]": (Fraction(-1), Fraction(1))}),
    ],
)
def test_a_tolerance_gives_bounds(text, expected):
    assert bounds(text) == expected


def test_a_section_stands_for_all_its_numbers():
    names = {key.partition("[")[0] for key in bounds("controller=±20%")}
    assert names == {f"controller.{name}" for name in ("K_t", "L_t", "K_r", "L_r")}


def test_a_matrix_stays_symmetric():
    (tolerance,) = tolerances_of(CONFIG, ["body.inertia[1][0]=±0.1"])
    assert tolerance.entry.paths == (("body", "inertia", 0, 1), ("body", "inertia", 1, 0))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("body.mass=3", "; +- may stand for ±)"),
        ("body.mass", "is not a tolerance"),
        ("body.mass=±", "is not a tolerance"),
        ("body.mass=±1.2.3", "is not a tolerance"),
        ("body.mass=±1e400", "is too large"),
        ("body.mass=±-1", "is not a tolerance"),
        ("body.mass=±0", "is a tolerance of 0"),
        ("gravity=±20%", "is a tolerance of 0, because gravity is 0"),
        ("integration.duration=±1", "integration.duration has no numbers"),
        ("controller.variant=±1", "controller.variant has no numbers"),
        ("initial.position=±1", "initial.position has no numbers"),
        ("=±1", "has no numbers"),
        ("body.mass=±41", "body.mass: at the low end of the tolerance: is 0"),
        ("initial.orientation=±4", "at the high end of the tolerance: θ1 = 4 rad"),
        ("body.inertia[0][1]=±20", "is not positive definite"),
    ],
)
def test_a_wrong_text_says_what_is_wrong(text, expected):
    messages = problems(text)
    assert messages[0].startswith(f"--within {text}:1:1: ")
    assert any(expected in line for line in messages)


def test_all_wrong_texts_are_named_at_once():
    messages = problems("body.mass=±1", "body.mass=3", "body=±1%", "foo=±1")
    assert len(messages) == 3
    assert any("gives a second tolerance of body.mass" in line for line in messages)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("body.contact_point[0]=±10%", ("0.135", "0.165")),
        ("body.contact_point[2]=±1e-3", ("-0.421", "-0.419")),
        ("body.mass=±1", ("40", "42")),
        ("gravity[1]=±0.05", ("-0.05", "0.05")),
    ],
)
def test_bounds_are_written_as_exact_decimals(text, expected):
    (tolerance,) = tolerances_of(CONFIG, [text])
    assert tolerance.bounds == expected
