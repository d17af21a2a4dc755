"""Protects the key `keep` of a plan: it selects the members whose traces are stored."""

import pytest

VARIED = "base: free.yaml\nvary:\n  body.mass: {linspace: [1, 2, 20]}\n"

FORMS = [
    ("summary", []),
    ("traces", range(20)),
    ("{traces: []}", []),
    ("{traces: [19, 0, 3, 3]}", [0, 3, 19]),
    ("{traces: {every: 7}}", [0, 7, 14]),
    ("{traces: {every: 1}}", range(20)),
    ("{traces: {every: 99}}", [0]),
]


@pytest.mark.parametrize(("keep", "members"), FORMS)
def test_members_with_traces(load, keep, members):
    plan = load(f"{VARIED}keep: {keep}\n")
    expected = [number in members for number in range(20)]
    assert plan.keep.selected(0, 20).tolist() == expected
    for start in range(20):
        for stop in range(start, 21):
            assert plan.keep.selected(start, stop).tolist() == expected[start:stop]
    assert plan.keep.count(plan.members) == sum(expected)


def test_members_are_in_their_order(load):
    assert load(f"{VARIED}keep: {{traces: [16, 8, 1, 16]}}\n").keep.members == (1, 8, 16)


def test_summaries_alone_are_the_default(load):
    assert load(VARIED).keep.count(20) == 0
