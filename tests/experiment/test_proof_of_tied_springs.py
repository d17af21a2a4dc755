"""Protects proofs with springs of tied bodies from the config to the answer."""

import json
from functools import partial
from typing import Any

import pytest
from support.config_elements import CONTROLLER, TIE, config_data

from rbstab.analysis.proof.tied.rest_states import tied_rest_states
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.proof import Proof, has_no_rest_state, proof_id, prove, start_state
from rbstab.experiment.stability import stability_of
from rbstab.experiment.verification.verify import verify

TIED = CONTROLLER | {
    "variant": "visco-elastic",
    "K_c": [9000.0, 9000.0, 9000.0],
    "L_c": [90.0, 90.0, 90.0],
}
SPRING: dict[str, Any] = {"kind": "spring", "point": [0.02, 0.0, 0.3], "anchor": [0.6, 0.01, 0.9]}
SPRING |= {"stiffness": 300.0, "rest_length": 0.5}
BARRIER = {"kind": "guard", "method": "barrier", "stiffness": 30.0}


def config_of(spring=SPRING, **changes):
    return load_config(config_data({"strut": spring, **changes.pop("others", {})}, TIED, **changes))


@pytest.fixture(scope="module")
def proof():
    return prove(config_of())


@pytest.mark.heavy
def test_the_only_rest_state_and_its_region_are_proved(proof):
    config = config_of()
    assert proof.proved
    assert proof.unique
    assert proof.globally_stable
    assert proof.reduced_energy is None
    assert proof.region.proved
    problem = problem_of(config)
    assert start_state(problem, proof) == 1
    text = " ".join(stability_of(problem, proof).statements)
    assert "at which each spring has a length, proved to be all" in text
    assert "and each spring from a length of 0, converges" in text
    assert "convergence is proved" in text
    # It is stored, and read as it was.
    assert Proof(**json.loads(proof.model_dump_json())) == proof
    wide = proof.unwrapped
    assert wide is not None
    assert wide.proved
    assert len(wide.states) == 1


@pytest.mark.heavy
def test_a_start_outside_is_followed_into_the_region(proof):
    fast = config_of(initial={"angular_velocity": [14.0, 12.0, -9.0]})
    problem = problem_of(fast)
    assert start_state(problem, proof) is None
    assert prove_convergence(fast, problem, proof).convergence.proved


@pytest.mark.heavy
def test_the_proof_is_verified_as_that_of_its_config(proof):
    # The range of all real θ1 and θ3 takes long to check.
    short = proof.model_copy(update={"unwrapped": None})
    found = verify(short, config_of())
    assert found.verified
    assert {"id", "energy", "no other rest state", "certified region"} <= {
        one.claim for one in found.findings
    }
    other = verify(short, config_of(SPRING | {"stiffness": 300.1}))
    assert {one.claim for one in other.findings if not one.verified} == {"id", "energy"}


def test_beside_a_barrier_it_is_not_decided():
    found = prove(config_of(others={"range": BARRIER}))
    assert not found.proved
    assert "no proof takes a barrier into account beside springs" in found.outcome


def test_a_limit_of_boxes_is_named(monkeypatch):
    limited = partial(tied_rest_states, box_limit=600)
    monkeypatch.setattr("rbstab.analysis.proof.tied.rest_states.tied_rest_states", limited)
    found = prove(config_of())
    assert (found.proved, found.region, found.unwrapped) == (False, None, None)
    assert found.outcome == "the limit on the number of boxes was reached"
    assert found.undecided
    assert not has_no_rest_state(found)


def test_only_ids_of_tied_bodies_with_a_spring_have_its_version(monkeypatch):
    """Records that nothing was decided of them are not found again."""
    held = {key: TIED[key] for key in CONTROLLER} | {"variant": "permanent"}
    configs = [
        config_of(),
        load_config(config_data({"x": TIE}, TIED)),
        load_config(config_data({"x": SPRING}, held)),
    ]
    before = [proof_id(config) for config in configs]
    monkeypatch.setattr("rbstab.experiment.proof.TIED_VERSION", 0)
    after = [proof_id(config) for config in configs]
    assert [one == other for one, other in zip(before, after, strict=True)] == [False, True, True]
