"""Long lists of wrong values in a plan: the search for problems ends early, and says so."""

import pytest
from support.configs import VISCO_ELASTIC, plain

from rbstab.config.errors import ConfigError
from rbstab.config.messages import describe
from rbstab.sweep.plan import problems
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.problems import ENOUGH_PROBLEMS

ENTRIES = 20 * ENOUGH_PROBLEMS


@pytest.fixture
def described(monkeypatch):
    """Count the values that a message describes."""
    counted = []

    def count_and_describe(value):
        counted.append(value)
        return describe(value)

    monkeypatch.setattr(problems, "describe", count_and_describe)
    return counted


def refused(vary, **changes):
    with pytest.raises(ConfigError) as caught:
        load_plan({"base": plain(VISCO_ELASTIC), "vary": vary, **changes})
    return list(map(str, caught.value.problems))


@pytest.mark.parametrize(
    ("vary", "keep"),
    [
        ({"body.mass": {"values": ["a"] * ENTRIES}}, "summary"),
        ({"controller.variant": {"values": ["fre"] * ENTRIES}}, "summary"),
        ({"controller.variant": {"values": ["free", *["fre"] * ENTRIES]}}, "summary"),
        ({"body.mass": {"values": [40]}}, {"traces": ["a"] * ENTRIES}),
    ],
    ids=["numbers", "variants", "variants, one right", "traces"],
)
def test_wrong_entries(vary, keep, described):
    found = refused(vary, keep=keep)
    assert len(found) == 100
    assert found[-1].endswith("at least 901 more problems are not listed")
    assert ENOUGH_PROBLEMS <= len(described) <= ENOUGH_PROBLEMS + 100


def test_members_with_traces_that_the_plan_does_not_have():
    found = refused({"body.mass": {"values": [40]}}, keep={"traces": [7] * ENTRIES})
    assert "keep.traces[0]: is 7 (expected a member below 1)" in found[0]
    assert found[-1].endswith("at least 901 more problems are not listed")


def test_fewer_problems_are_counted_exactly():
    found = refused({"body.mass": {"values": ["a"] * (ENOUGH_PROBLEMS - 1)}})
    assert found[-1].endswith(f": {ENOUGH_PROBLEMS - 100} more problems are not listed")


def test_right_and_wrong_variants_keep_their_order():
    found = refused({"controller.variant": {"values": ["fre", "free", 3]}})
    assert [message.split(": ", 1)[1].split(" (")[0] for message in found] == [
        "vary.controller.variant.values[0]: is the text 'fre'",
        "vary.controller.variant.values[2]: is 3",
    ]


def test_a_long_list_of_right_values_is_a_plan():
    mass = [40.0 + number / ENTRIES for number in range(ENTRIES)]
    plan = load_plan({"base": plain(VISCO_ELASTIC), "vary": {"body.mass": {"values": mass}}})
    assert plan.members == ENTRIES
    assert plan.values(ENTRIES - 1, ENTRIES)["body.mass"].tolist() == [mass[-1]]
