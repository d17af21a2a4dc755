"""Protects how often disturbances tilt members too far: the worst, the interval, the sentences."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.gusts import plan_of

from rbstab.experiment.disturbed.bound import Bound
from rbstab.experiment.disturbed.prove_bound import stated_in
from rbstab.sweep.folder.disturbed import DisturbedAnswers, clopper_pearson
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.proofs.disturbed import ELSEWHERE, LARGER, NOT_DECIDED, PROVED, MemberBounds
from rbstab.sweep.proofs.loads import Disturbances
from rbstab.sweep.sweep import sweep_to_folder


def at_most(count, total, p):
    """Return the probability of at most so many of them."""
    return math.fsum(math.comb(total, k) * p**k * (1 - p) ** (total - k) for k in range(count + 1))


@pytest.mark.parametrize(("count", "total"), [(0, 12), (1, 12), (6, 12), (12, 12), (37, 600)])
def test_the_interval_has_the_tails_of_the_binomial_distribution(count, total):
    low, high = clopper_pearson(count, total)
    assert 0 <= low <= count / total <= high <= 1
    if count > 0:
        assert 1 - at_most(count - 1, total, low) == pytest.approx(0.025, rel=1e-6)
    if count < total:
        assert at_most(count, total, high) == pytest.approx(0.025, rel=1e-6)
    assert (low == 0) == (count == 0)
    assert (high == 1) == (count == total)


PEAKS = [0.1, 0.2, 0.499, 0.501, 0.9, np.nan, 0.3]
CODES = [PROVED, PROVED, LARGER, LARGER, LARGER, LARGER, ELSEWHERE]
ENDED = [True, True, True, True, False, False, False]


def answers(independent=True, proved=True, codes=CODES):
    plan: Any = plan_of({"elements.gust0.amplitude": {"linspace": [5, 35, 7]}})
    stated = stated_in(plan.base_of("permanent"))
    assert stated is not None
    claim: Any = SimpleNamespace() if proved else None
    loads, sizes = tuple(stated.given), tuple(stated.given.values())
    bound = Bound(loads, sizes, stated.tilt, "of some reason", claim=claim)
    size = np.linspace(5, 35, 7)
    disturbed = Disturbances({"couple": size}, size <= 20, np.zeros(7, bool))
    found = MemberBounds(stated, [(bound, np.arange(7))], disturbed, np.array(codes))
    ended, peaks = np.array(ENDED), np.array(PEAKS)
    return DisturbedAnswers(found, peaks, ended, "3 s", independent, "not made")


def test_who_ended_early_may_have_left_and_may_not():
    """One that was seen to leave has left, whatever became of it then."""
    found = answers()
    assert found.left.tolist() == [False] * 3 + [True] * 2 + [False] * 2
    assert (found.unknown, found.worst) == (2, 4)
    assert found.interval == (clopper_pearson(2, 7)[0], clopper_pearson(4, 7)[1])
    assert "not known of 2 that ended early" in found.leaving
    assert "Probability" not in answers(independent=False).leaving
    assert answers(independent=False).interval is None


def test_shards_of_earlier_versions_without_peaks_are_not_counted_as_members_that_stay():
    peaks = np.where(np.arange(7) < 6, np.nan, answers().peaks)
    unknown = replace(answers(), peaks=peaks, completed=np.ones(7, bool))
    assert (int(unknown.left.sum()), unknown.unknown) == (0, 6)
    assert unknown.interval == (0.0, clopper_pearson(6, 7)[1])
    assert "not known of 6 that ended early or have no peak" in unknown.leaving


def test_the_sentences_have_the_numbers():
    found = answers().statements
    assert found["Worst tilt"] == "0.9 rad (51.6°), member 4, couple up to 25 N m"
    assert found["Leaves"].startswith("tilt above 0.5 rad: 2 of 7 members (28.6 %) by 3 s;")
    expected = "couple up to 20 N m keeps the tilt below 0.5 rad for ever: proved"
    assert found["Bound"] == f"from rest at Θ = 0, any disturbance {expected}"
    first, *others = found["For ever"].split("; ")
    assert first == "2 of 7 members stay below 0.5 rad: proved"
    assert [text[:16] for text in others] == ["not proved for 4", "not proved for 1"]
    data = answers().data
    assert (data["proved"], data["left"], data["worst_member"]) == (2, 2, 4)


def test_what_is_not_proved_is_never_said_to_be():
    found = answers(proved=False, codes=[NOT_DECIDED] * 7)
    assert found.proved == 0
    sentences = found.statements
    assert sentences["Bound"].endswith("for ever: not proved")
    expected = "not proved for 7: it is not decided, as of some reason"
    assert sentences["For ever"] == expected


@pytest.mark.slow
def test_a_sweep_keeps_its_peaks_and_says_what_is_not_tried(tmp_path):
    from rbstab.sweep.folder.member_answers import member_answers

    plan = plan_of({"elements.gust0.amplitude": {"values": [5, 60]}})
    sweep = sweep_to_folder(plan, tmp_path / "results" / "gusts", SweepOptions(compare=1))
    found = member_answers(sweep.folder.sweep_file).disturbed
    assert found is not None
    assert found.left.tolist() == [False, True]
    (reason,) = found.why
    assert reason.startswith("the proof of their own body was not made")
    assert reason.endswith("--prove")
    bare = plan_of({"elements.gust0.amplitude": {"values": [5, 60]}}, sections={"bound": None})
    sweep = sweep_to_folder(bare, tmp_path / "results" / "bare", SweepOptions(compare=1))
    assert member_answers(sweep.folder.sweep_file).disturbed is None
