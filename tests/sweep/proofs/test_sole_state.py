"""Each distinct body of a sweep counts once, by a proof of its own or by one for many bodies."""

import numpy as np
import pytest
from support.paper_runs import paper_config
from support.sweeping import run_sweep
from support.valleys import TWO_VALLEYS
from sweep.proofs.plans import K_R, SPIN, plan_of

import rbstab
from rbstab.experiment.proof import prove
from rbstab.experiment.proof_cache import proof_for
from rbstab.report.sweeps.members import read_members
from rbstab.sweep.folder.member_answers import member_answers
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.proofs.bodies import _distinct_rows
from rbstab.sweep.proofs.columns import NOT_SOLE_STATE, SOLE_STATE, STATES_UNDECIDED
from rbstab.sweep.proofs.convergence import MemberConvergence, ProvedConvergence, sole_state_code
from rbstab.sweep.proofs.sole_state import SoleState, sole_state_of
from rbstab.sweep.sweep import prove_members


def swept(folder, plan, **options):
    """Return what is found when the bodies of a sweep are proved, in the folder `sweep`."""
    sweep = run_sweep(folder / "sweep", plan, threads=1, factory=factory_for("scipy"))
    return prove_members(plan, sweep, **options).sole_state


def stored(folder):
    """Return the same as the report and `show` read it later, which agree."""
    file = folder / "sweep" / "members.h5"
    answer = member_answers(file).sole_state
    assert answer == read_members(file).sole_state
    return answer


def test_bodies_count_once_by_either_proof(tmp_path, monkeypatch):
    """The first four bodies lie in a box; then each of them has a proof of its own too."""
    monkeypatch.setattr("rbstab.sweep.sweep.FEW", 3)
    plan = plan_of({K_R: {"scale": {"linspace": [0.9, 1.1, 5]}}, SPIN: {"values": [1.0, 11.0]}})
    boxes = swept(tmp_path, plan, budget=0.0)
    assert (boxes.bodies, boxes.proved, boxes.not_decided) == (5, 5, 0)
    assert len(boxes.levels) == 5
    assert boxes.word == "proved"
    assert boxes.counts == "proved for 5 of 5 distinct bodies"
    assert stored(tmp_path) == boxes
    assert not rbstab.open_sweep(tmp_path / "sweep")["one_rest_state"].any()
    both = swept(tmp_path, plan, budget=None)
    assert (both.bodies, both.proved) == (5, 5)
    assert stored(tmp_path) == both
    words = rbstab.open_sweep(tmp_path / "sweep").words("one_rest_state")
    assert set(words) == {"proved"}


def test_a_body_may_be_false_by_its_own_proof(tmp_path):
    vary = {K_R: {"scale": {"values": [1.0, 30.0]}}, SPIN: {"values": [0.1, 0.2]}}
    plan = load_plan({"base": TWO_VALLEYS, "vary": vary}, ["integration.duration=0.05"])
    answer = swept(tmp_path, plan, budget=None)
    assert (answer.bodies, answer.proved, list(answer.false)) == (2, 1, [0])
    assert answer.counts == "proved for 1 of 2 distinct bodies, false for 1 (members 0)"
    assert answer.word == "false"
    assert answer.counterexamples == {}
    assert stored(tmp_path) == answer
    words = rbstab.open_sweep(tmp_path / "sweep").words("one_rest_state")
    assert words.tolist() == ["false"] * 2 + ["proved"] * 2


def test_a_body_between_the_bounds_may_refute_what_holds_for_those_of_the_sweep(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("rbstab.sweep.sweep.FEW", 3)
    weak = {K_R: {"scale": {"linspace": [0.1, 0.3, 4]}}}
    answer = swept(tmp_path, plan_of(weak, gravity=[0.0, 0.0, -9.81]), budget=0.0)
    record = answer.counterexamples["permanent"]
    assert record.proved is False
    assert len(record.rest_states) > 1
    (sentence,) = answer.refutations
    assert sentence.startswith("For every body between the least and the greatest value")
    assert " one rest state, a minimum: false, proved. The body with controller.K_r = [" in sentence
    assert answer.sentences[1:] == [sentence]
    assert stored(tmp_path) == answer
    assert answer.data["counterexamples"][0]["body"] == record.body


def test_the_body_of_a_counterexample_may_be_one_of_the_sweep(tmp_path, monkeypatch):
    monkeypatch.setattr("rbstab.sweep.sweep.FEW", 3)
    weak = {K_R: {"scale": {"linspace": [0.1, 0.3, 5]}}, SPIN: {"values": [0.1, 0.2]}}
    answer = swept(tmp_path, plan_of(weak, gravity=[0.0, 0.0, -9.81]), budget=0.0)
    assert (answer.counterexamples["permanent"].body or {})[f"{K_R}[0]"] == "80"
    assert list(answer.false) == [4]  # the third of five bodies, each with two members


def test_without_an_answer_for_any_body_nothing_is_said(tmp_path):
    plan = plan_of({K_R: {"scale": {"values": [0.9, 1.1]}}})
    answer = swept(tmp_path, plan, budget=0.0)
    assert answer == SoleState()
    assert answer.sentences == []
    # All members of a sweep share one body: the report shows its rest states.
    shared = plan_of({SPIN: {"values": [1.0, 2.0]}})
    proof_for(tmp_path, shared.config_of(0))
    proofs = ProvedConvergence(shared, tmp_path)
    of_members = proofs.of(0, 2)
    assert of_members.sole_state.tolist() == [SOLE_STATE] * 2
    assert sole_state_of(proofs, of_members) == SoleState()


@pytest.mark.parametrize(
    ("base", "expected"), [(paper_config("free"), SOLE_STATE), (TWO_VALLEYS, NOT_SOLE_STATE)]
)
def test_codes_of_proofs(base, expected):
    proof = prove(base)
    assert sole_state_code(proof) == expected

    def changed(**changes):
        return proof.model_copy(update=changes)

    unknown = changed(proved=False, unique=None, states=proof.states[:1])
    assert sole_state_code(unknown) == STATES_UNDECIDED
    # With a certain second one, the search need not have ended.
    several = changed(proved=False, unique=None, states=proof.states[:1] * 2)
    assert sole_state_code(several) == NOT_SOLE_STATE
    none = {"unique": False, "states": (), "region": None}
    assert sole_state_code(changed(proved=True, **none)) == NOT_SOLE_STATE
    assert sole_state_code(changed(proved=False, **none)) == STATES_UNDECIDED
    saddle = proof.states[0].model_copy(update={"index": 1})
    assert sole_state_code(changed(unique=True, states=(saddle,))) == NOT_SOLE_STATE


def test_what_a_later_proof_says_replaces_nothing_that_is_known():
    count = 3
    codes, states, _ = MemberConvergence.nothing(count)
    new = MemberConvergence(codes, states, np.array([STATES_UNDECIDED, SOLE_STATE, NOT_SOLE_STATE]))
    earlier = MemberConvergence(
        codes, states, np.array([SOLE_STATE, STATES_UNDECIDED, NOT_SOLE_STATE])
    )
    assert new.beside(earlier).sole_state.tolist() == [SOLE_STATE, SOLE_STATE, NOT_SOLE_STATE]


@pytest.mark.parametrize(
    ("shape", "kinds"),
    [((1000, 3), 4), ((1000, 2), 1000), ((500, 4), 2), ((7, 1), 1), ((0, 3), 2), ((1, 2), 1)],
)
def test_distinct_rows_are_those_of_numpy(shape, kinds):
    table = np.random.default_rng(0).integers(0, kinds, shape).astype(float)
    first, same = _distinct_rows(table)
    expected = np.unique(table, axis=0, return_index=True, return_inverse=True)
    assert first.tolist() == expected[1].tolist()
    assert same.tolist() == expected[2].ravel().tolist()
