"""Protects the value at which an answer changes: it is named only where one number decides."""

import numpy as np
import pytest
from support.leg import leg

from rbstab.config.load import load_config
from rbstab.experiment.answers.threshold import alike, by_chance, named_number, threshold_of

KINDS = {"g": (True, False), "b": (False, True), "-": (False, False)}


@pytest.mark.parametrize(
    ("members", "expected"),
    [
        # Members in the order of their values 0, 1, 2, ...: good, bad, or open.
        ("bbgg", (2, 1, True)),
        ("ggbb", (1, 2, False)),
        ("bb--gg", (4, 1, True)),
        # An open member is neither: it lies among the bad ones, or between both.
        ("b-b-g-g", (6, 2, True)),
        ("--gg", (2, None, True)),
        ("gg--", (1, None, False)),
        # Nothing separates these, or there is nothing to separate.
        ("bgb", None),
        ("gbg", None),
        ("-g-", None),
        ("b-g-", None),
        ("bbb", None),
        ("ggg", None),
        ("---", None),
    ],
)
def test_a_threshold_separates_good_members_from_bad_ones(members, expected):
    good, bad = np.array([KINDS[letter] for letter in members]).T
    threshold = threshold_of(np.arange(float(len(members))), good, bad)
    assert (threshold and (threshold.good, threshold.bad, threshold.upward)) == expected


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ([7.000000000000001, 6.5, 6.0], ["7.0", "6.5", "6.0"]),
        ([1e-9, 2e-9], ["1e-09", "2e-09"]),
        ([1.000001, 1.000002], ["1.000001", "1.000002"]),
        ([40.0, 50.0], ["40", "50"]),
    ],
)
def test_values_in_a_sentence_are_written_alike(values, texts):
    assert list(alike(values).values()) == texts


def test_chance_separates_few_sampled_members():
    # One number, one good and one bad member: every order separates them.
    assert by_chance(1, 1, 1) == 1.0
    assert by_chance(5, 5, 2) == pytest.approx(4 / 252)


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        (("controller", "K_r"), ("K_r[0]", "N m/rad", 10.0)),
        (("controller", "K_r", 2), ("K_r[2]", "N m/rad", 5.0)),
        (("body", "contact_point"), ("contact_point[2]", "m", -0.186)),
        (("initial", "angular_velocity", 1), ("initial angular_velocity[1]", "rad/s", 2.0)),
        (("gravity", 2), ("gravity[2]", "m/s^2", -9.81)),
    ],
)
def test_a_number_has_its_name_and_unit(path, expected):
    assert named_number(load_config(leg()), path) == expected
