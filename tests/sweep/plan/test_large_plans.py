"""Long lists of wrong values in a plan: the search for problems ends early, and says so."""

import pytest
from support.configs import VISCO_ELASTIC, plain

from rbstab.config.errors import ENOUGH_PROBLEMS, ConfigError
from rbstab.sweep.plan.load import load_plan

ENTRIES = 20 * ENOUGH_PROBLEMS
MASS = {"body.mass": {"values": [40]}}


def refused(vary, **changes):
    with pytest.raises(ConfigError) as caught:
        load_plan({"base": plain(VISCO_ELASTIC), "vary": vary, **changes})
    return list(map(str, caught.value.problems))


@pytest.mark.parametrize(
    ("vary", "keep"),
    [
        ({"body.mass": {"values": ["a"] * ENTRIES}}, "summary"),
        ({"controller.variant": {"values": ["free", *["fre"] * ENTRIES]}}, "summary"),
        (MASS, {"traces": ["a"] * ENTRIES}),
    ],
    ids=["numbers", "variants", "traces"],
)
def test_wrong_entries(vary, keep):
    problems = refused(vary, keep=keep)
    assert len(problems) == 100
    assert problems[-1].endswith("at least 901 more problems are not listed")


def test_fewer_problems_are_counted_exactly():
    problems = refused({"body.mass": {"values": ["a"] * (ENOUGH_PROBLEMS - 1)}})
    assert problems[-1].endswith(f": {ENOUGH_PROBLEMS - 100} more problems are not listed")


def test_a_long_list_of_right_values_is_a_plan():
    mass = [40.0 + number / ENTRIES for number in range(ENTRIES)]
    plan = load_plan({"base": plain(VISCO_ELASTIC), "vary": {"body.mass": {"values": mass}}})
    assert plan.members == ENTRIES
    assert plan.values(ENTRIES - 1, ENTRIES)["body.mass"].tolist() == [mass[-1]]
