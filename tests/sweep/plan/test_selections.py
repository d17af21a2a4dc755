"""Protects `keep` and `prove` of a plan: which members they select, and what they refuse."""

import numpy as np
import pytest

from rbstab.sweep.plan.load import load_plan, plan_yaml
from rbstab.sweep.plan.plan import plan_id
from rbstab.sweep.plan.proof_selection import DEFAULT_STEPS, ProofSelection

PLAN = "title: Plan\nbase: free.yaml\nvary:\n  body.mass: {linspace: [1, 2, 20]}\ndesign: grid\n"

KEPT = [
    ("summary", []),
    ("traces", range(20)),
    ("{traces: []}", []),
    ("{traces: [19, 0, 3, 3]}", [0, 3, 19]),
    ("{traces: {every: 7}}", [0, 7, 14]),
    ("{traces: {every: 1}}", range(20)),
    ("{traces: {every: 99}}", [0]),
]


@pytest.mark.parametrize(("keep", "members"), KEPT)
def test_members_with_traces(load, tmp_path, keep, members):
    plan = load(f"{PLAN}keep: {keep}\n")
    expected = [number in members for number in range(20)]
    for start in range(20):
        for stop in range(start, 21):
            assert plan.keep.selected(start, stop).tolist() == expected[start:stop]
    assert plan.keep.count(plan.members) == sum(expected)
    assert list(plan.keep.members) == sorted(plan.keep.members)
    assert (plan.keep == load(PLAN).keep) == (not members)
    (tmp_path / "again.yaml").write_text(plan_yaml(plan))
    assert load_plan(tmp_path / "again.yaml").keep == plan.keep


PROVED = [
    ("motion", ProofSelection(steps=DEFAULT_STEPS)),
    ("{motion: {}}", ProofSelection(steps=DEFAULT_STEPS)),
    ("{motion: {steps: 2000}}", ProofSelection(steps=2000)),
    ("{motion: {members: 7}}", ProofSelection(members=7)),
    ("{motion: {steps: 1, members: 1}}", ProofSelection(steps=1, members=1)),
]


@pytest.mark.parametrize(("value", "expected"), PROVED)
def test_members_with_proofs(load, tmp_path, value, expected):
    plan = load(f"{PLAN}prove: {value}\n")
    assert plan.prove == expected
    (tmp_path / "again.yaml").write_text(plan_yaml(plan))
    again = load_plan(tmp_path / "again.yaml")
    assert again.prove == expected
    assert plan_id(again) == plan_id(plan) != plan_id(load(PLAN))
    assert load(PLAN).prove is None
    assert "prove" not in plan_yaml(load(PLAN))


FORMS = "expected motion or {motion: {steps: n, members: n}}"

WRONG = [
    ("all", f"6:8: prove: 'all' is unknown ({FORMS})"),
    ("{}", "6:8: prove.motion: is missing (it is required)"),
    ("true", f"6:8: prove: is neither a word nor a mapping ({FORMS})"),
    ("{motion: 5}", "6:17: prove.motion: is 5 (expected a mapping of steps, members)"),
    ("{motion: {stesp: 5}}", "6:18: prove.motion.stesp: is unknown (did you mean steps?)"),
    ("{motion: {steps: 0}}", "6:25: prove.motion.steps: is 0 (expected a number at least 1)"),
    (
        "{motion: {steps: 2001}}",
        "6:25: prove.motion.steps: is 2001 (expected a number at most 2000)",
    ),
    ("{motion: {steps: 1.5}}", "6:25: prove.motion.steps: is 1.5 (expected a whole number)"),
    ("{motion: {members: 0}}", "6:27: prove.motion.members: is 0 (expected a number at least 1)"),
    (
        "{motion: {members: false}}",
        "6:27: prove.motion.members: is false (expected a whole number)",
    ),
]


@pytest.mark.parametrize(("value", "expected"), WRONG)
def test_wrong(complaints, value, expected):
    assert complaints(f"{PLAN}prove: {value}\n") == [expected]


@pytest.mark.parametrize("total", [1, 2, 3, 10, 201, 1000, 40401, 65536])
@pytest.mark.parametrize("members", [1, 2, 7, 200])
def test_as_many_members_are_selected_in_any_division(total, members):
    selection = ProofSelection(members=members)
    whole = selection.selected(0, total, total)
    assert whole.sum() == selection.count(total) == min(members, total)
    parts = [selection.selected(k, min(k + 97, total), total) for k in range(0, total, 97)]
    assert np.concatenate(parts).tolist() == whole.tolist()
    assert sorted(selection.first(members, total)) == np.flatnonzero(whole).tolist()
    more = ProofSelection(members=members + 1).selected(0, total, total)
    assert not (whole & ~more).any()


@pytest.mark.parametrize("members", [50, 201, 400])
def test_members_are_spread_over_both_axes_of_a_grid(members):
    """Every n-th member of a grid could be in a few of its columns only."""
    rows, columns = np.divmod(
        np.flatnonzero(ProofSelection(members=members).selected(0, 201 * 201, 201 * 201)), 201
    )
    assert np.diff(np.sort(rows)).max() <= 2 * 201 / members + 1
    for index in (rows, columns):
        counts = np.histogram(index, bins=5, range=(0, 201))[0]
        assert counts.min() > 0.5 * members / 5


def test_very_large_plans():
    total = 100_000_000
    selected = ProofSelection(members=total // 2).selected(total - 1000, total, total)
    assert 300 < selected.sum() < 700
