"""Protects the proofs of a plan with many bodies: which members share one, and what is proved of
each member, which is what a plan of its body alone says.
"""

from pathlib import Path
from threading import Event

import numpy as np
import pytest
from support.paper_runs import paper_config

from rbstab.experiment.proof_cache import cached_proof
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.proofs import prove_bodies as module
from rbstab.sweep.proofs.bodies import bodies_of, named_members, ranges_of
from rbstab.sweep.proofs.columns import NO_PROOF, NOT_PROVED, PROVED
from rbstab.sweep.proofs.convergence import MemberConvergence, ProvedConvergence, keep_proofs
from rbstab.sweep.proofs.prove_bodies import prove_bodies

SPIN = {"initial.angular_velocity[0]": {"linspace": [-30, 30, 7]}}
MASSES = [30.0, 41.0, 50.0]


def base_of():
    base = paper_config("free", with_gravity=True, duration=0.1, samples=5)
    return base | {"initial": {"angular_velocity": [0, 0, 0]}}


def plan_of(vary, **more):
    return load_plan({"base": base_of(), "vary": vary, **more})


def nothing(plan):
    return MemberConvergence.nothing(plan.members)


def proved(plan, results, **options):
    return prove_bodies(plan, results, nothing(plan), **options)


def test_members_that_differ_in_their_start_share_a_body():
    bodies = bodies_of(plan_of({"body.mass": {"values": MASSES}, **SPIN}))
    assert bodies.of_member.tolist() == [0] * 7 + [1] * 7 + [2] * 7
    assert bodies.first.tolist() == [0, 7, 14]
    bodies = bodies_of(plan_of({**SPIN, "body.mass": {"values": MASSES}}))
    assert bodies.of_member.tolist() == [0, 1, 2] * 7
    assert bodies.members(1).tolist() == list(range(1, 21, 3))


def test_bodies_are_numbered_by_their_first_members():
    """Not by their values: the heaviest comes first here. Equal values are one body."""
    bodies = bodies_of(plan_of({"body.mass": {"values": [50, 30, 50, 41]}}))
    assert bodies.of_member.tolist() == [0, 1, 0, 2]
    assert bodies.first.tolist() == [0, 1, 3]


def test_variants_are_bodies_of_their_own_and_sliding_ones_are_left_out():
    path = Path(__file__).parents[3] / "configs/sweeps/variants.yaml"
    bodies = bodies_of(load_plan(path))
    assert len(bodies) == 4
    assert np.bincount(bodies.of_member + 1).tolist() == [1000] * 5
    assert (bodies.of_member[4000:] == -1).all()


def test_the_answers_are_those_of_plans_with_one_body(tmp_path):
    plan = plan_of({"body.mass": {"values": MASSES}, **SPIN})
    proofs = proved(plan, tmp_path / "all", budget=None)
    assert (proofs.bodies, proofs.reached_bodies) == (3, 3)
    assert proofs.reached.all()
    for k, mass in enumerate(MASSES):
        base = base_of()
        base["body"] = base["body"] | {"mass": mass}
        alone = load_plan({"base": base, "vary": SPIN})
        keep_proofs(alone, tmp_path / "alone")
        expected = ProvedConvergence(alone, tmp_path / "alone").of(0, 7)
        members = slice(7 * k, 7 * k + 7)
        assert proofs.convergence.codes[members].tolist() == expected.codes.tolist()
        assert proofs.convergence.rest_states[members].tolist() == expected.rest_states.tolist()
    codes = proofs.convergence.codes
    assert {PROVED, NOT_PROVED} == set(codes.tolist())
    assert cached_proof(tmp_path / "all", plan.config_of(20)) is not None


def test_the_budget_ends_the_proofs_and_a_second_call_goes_on(tmp_path, monkeypatch):
    now = [0.0]

    def slow(*given, prove=module._prove):
        now[0] += 10.0
        prove(*given)

    monkeypatch.setattr(module, "monotonic", lambda: now[0])
    monkeypatch.setattr(module, "_prove", slow)
    plan = plan_of({**SPIN, "body.mass": {"values": MASSES}})
    first = proved(plan, tmp_path, budget=15.0)
    assert (first.reached_bodies, first.seconds) == (2, 20.0)
    # The lightest and the heaviest body come first.
    assert np.flatnonzero(~first.reached).tolist() == list(range(1, 21, 3))
    assert (first.convergence.codes[~first.reached] == NO_PROOF).all()
    assert (first.convergence.codes[first.reached] != NO_PROOF).all()
    second = prove_bodies(plan, tmp_path, first.convergence, budget=5.0)
    assert (second.reached_bodies, second.seconds) == (3, 10.0)
    assert (second.convergence.codes != NO_PROOF).all()
    assert (second.convergence.codes[first.reached] == first.convergence.codes[first.reached]).all()


@pytest.mark.parametrize("processes", [1, 2])
def test_an_interrupt_keeps_what_is_proved(tmp_path, processes):
    """What is found of reached members is what a whole call finds; a second call goes on."""
    plan = plan_of({"body.mass": {"linspace": [30, 50, 6]}, **SPIN})
    whole = proved(plan, tmp_path / "whole", budget=None).convergence
    stop = Event()

    def progress(reached, _all):
        if reached == 2:
            stop.set()

    options = {"processes": processes, "progress": progress, "budget": None}
    first = proved(plan, tmp_path / "a", stop=stop, **options)
    assert 2 <= first.reached_bodies < 6
    assert first.reached_bodies == 2 or processes == 2
    assert first.reached.sum() == 7 * first.reached_bodies
    assert (first.convergence.codes[first.reached] == whole.codes[first.reached]).all()
    assert (first.convergence.codes[~first.reached] == NO_PROOF).all()
    assert not proved(plan, tmp_path / "b", stop=stop, **options).reached.any()
    second = prove_bodies(plan, tmp_path / "a", first.convergence, processes=processes, budget=None)
    assert second.reached.all()
    assert second.convergence.codes.tolist() == whole.codes.tolist()
    assert second.convergence.rest_states.tolist() == whole.rest_states.tolist()


def test_what_is_stored_is_kept_where_it_says_more(tmp_path):
    """A member may be proved by a proof for all bodies within tolerances."""
    plan = plan_of({"body.mass": {"values": [41.0]}, **SPIN})
    alone = proved(plan, tmp_path, budget=None).convergence.codes
    outside = int(np.flatnonzero(alone == NOT_PROVED)[0])
    stored = nothing(plan)
    stored.codes[outside], stored.rest_states[outside] = PROVED, 1
    convergence = prove_bodies(plan, tmp_path, stored, budget=None).convergence
    assert (convergence.codes[outside], convergence.rest_states[outside]) == (PROVED, 1)
    assert np.delete(convergence.codes, outside).tolist() == np.delete(alone, outside).tolist()


def test_ranges():
    assert ranges_of([]) == []
    assert ranges_of([3]) == [(3, 3)]
    assert ranges_of([0, 1, 2, 5, 7, 8]) == [(0, 2), (5, 5), (7, 8)]
    assert named_members([(0, 2), (5, 5)]) == "members 0 to 2, 5"
    many = [(10 * k, 10 * k + 1) for k in range(8)]
    assert named_members(many).endswith("50 to 51 and 4 more")
