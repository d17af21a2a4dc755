"""Protects proofs with springs of tied bodies from the config to the answer."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.config_elements import CONTROLLER, config_data

from rbstab.analysis.linearisation import NoDerivativesError, linearise
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.proof import prove
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import has_no_rest_state, start_state
from rbstab.experiment.tuning.guard import guard
from rbstab.experiment.verification.verify import verify
from rbstab.mechanics.motion import motion_from_centre
from rbstab.proof.check.checker import check
from rbstab.proof.exact.expr import variable
from rbstab.proof.record import energy_record, read_energy

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
    assert proof.needs_lengths
    assert proof.region.proved
    problem = problem_of(config)
    assert start_state(problem, proof) == 1
    text = " ".join(stability_of(problem, proof).statements)
    assert "at which each spring has a length: 1 stable; proved to be all" in text
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


@pytest.fixture(scope="module")
def guarded():
    """Return a config with a barrier beside the spring, and its proof."""
    config = config_of(others={"range": BARRIER})
    return config, prove(config)


@pytest.mark.heavy
def test_beside_a_barrier_it_is_proved(guarded):
    config, found = guarded
    assert found.unique
    assert found.globally_stable
    assert found.kept_by == "a barrier"
    # A spring may lose its length, so not every start is proved to converge.
    assert not found.every_start
    assert found.unwrapped.globally_stable
    assert found.region.proved
    assert start_state(problem_of(config), found) == 1
    text = " ".join(stability_of(problem_of(config), found).statements)
    assert (
        "and keeps each spring from a length of 0, converges to the rest state; a barrier" in text
    )
    assert Proof(**json.loads(found.model_dump_json())) == found


@pytest.mark.heavy
def test_the_proof_with_a_barrier_is_verified(guarded):
    config, found = guarded
    short = found.model_copy(update={"unwrapped": None})
    assert verify(short, config).verified
    other = verify(short, config_of(others={"range": BARRIER | {"stiffness": 30.1}}))
    assert {one.claim for one in other.findings if not one.verified} == {"id", "energy"}


@pytest.mark.heavy
@pytest.mark.parametrize("change", ["weaker", "higher", "every start"])
def test_a_wrong_claim_with_a_barrier_is_refused(guarded, change):
    _, found = guarded
    data = found.model_copy(update={"unwrapped": None}).record
    (claims,) = data["ranges"]
    if change == "weaker":
        # The only rest state is at an angle θ2 that the barrier moves.
        pitch = variable(1)
        weaker = read_energy(data["energy"])
        weaker = replace(weaker, U=weaker.U - 5 * pitch.cos() ** -2)
        data["energy"] = energy_record(weaker)
    elif change == "higher":
        claims["level"] += 0.01 * abs(claims["level"])
    else:
        claims["every_start"] = True
    assert not all(one.verified for one in check(data))


def test_no_barrier_is_enough_for_every_start(monkeypatch):
    """A spring may lose its length with any barrier, so one stiffness is tried, briefly."""
    monkeypatch.setattr("rbstab.proof.limits.BRIEF_WITH_SPRINGS", 100)
    found = guard(config_of(integration={"duration": 0.02, "samples": 3}))
    assert found.config is None
    ((_, why),) = found.tried
    assert "may lose its length" in why


def test_a_limit_of_boxes_is_named(monkeypatch):
    monkeypatch.setattr("rbstab.proof.limits.MOST_WITH_SPRINGS", 100)
    found = prove(config_of())
    assert (found.proved, found.region, found.unwrapped) == (False, None, None)
    assert found.outcome == "the limit on the number of boxes was reached"
    assert found.undecided
    assert not has_no_rest_state(found)


def test_a_damped_spring_without_a_rest_length_is_not_decided():
    """It balances where it has no length, and there the force of its damper has no direction."""
    damped = SPRING | {"rest_length": 0.0, "damping": 30.0}
    proof = prove(config_of(damped))
    assert not proof.proved
    assert "may have no length" in proof.outcome
    # Without a damper its force is -k e, which is smooth.
    assert prove(config_of(SPRING | {"rest_length": 0.0})).proved


def test_where_a_spring_has_no_length_there_is_no_linearisation():
    ends = {"point": [0.0, 0.0, 0.1], "anchor": [0.0, 0.0, 0.1]}
    body = {"mass": 12.0, "inertia": [0.29, 0.34, 0.13], "contact_point": [0, 0, 0]}
    spring = SPRING | ends | {"rest_length": 0.0, "damping": 30.0}
    start = {"position": [0.1, 0, 0]}
    problem = problem_of(config_of(spring, body=body, gravity=[0, 0, 0], initial=start))
    rest = motion_from_centre(problem.system.body, problem.system.anchor, np.zeros(12))
    with np.errstate(all="ignore"), pytest.raises(NoDerivativesError):
        linearise(problem.system, rest, np.zeros(0))


GUARDS: dict[str, tuple[dict[str, Any], float]] = {
    "stiff": ({"stiffness": 300.0, "soft_angle": 0.9}, 0.5 * 300.0 * (np.pi / 2 - 0.9) ** 2),
    "repelling": ({"couple": 40.0, "soft_angle": 0.9}, 40.0 * (np.pi / 2 - 0.9)),
}
"""Guards, and their energies at θ2 = ±π/2, where c* is attained without them, J."""


@pytest.mark.heavy
@pytest.mark.parametrize("method", GUARDS)
def test_beside_a_soft_guard(method, proof):
    section, raised = GUARDS[method]
    config = config_of(others={"range": {"kind": "guard", "method": method} | section})
    guarded = prove(config)
    assert guarded.proved
    (plain,), (state,) = proof.states, guarded.states
    np.testing.assert_allclose(state.orientation, plain.orientation, atol=1e-12)
    assert state.energy == pytest.approx(plain.energy, abs=1e-9)
    assert proof.region.face.startswith("θ2")
    assert guarded.region is not None
    assert guarded.region.energy == pytest.approx(proof.region.energy + raised, rel=1e-6)
    assert guarded.region.energy_bound is not None
    assert guarded.region.energy_bound <= guarded.region.energy
    assert guarded.region.lower_bound > 0.995 * guarded.region.level
    assert verify(guarded.model_copy(update={"unwrapped": None}), config).verified
    # The bound of the region is too high without the guard.
    data = guarded.model_copy(update={"unwrapped": None}).record
    data["energy"] = proof.record["energy"]
    assert "certified region" in {one.claim for one in check(data) if not one.verified}


@pytest.mark.heavy
def test_barriers_on_all_angles():
    outer = BARRIER | {"outer_stiffness": 10.0}
    config = config_of(others={"range": outer})
    guarded = prove(config)
    assert guarded.proved
    assert guarded.within_barriers
    assert guarded.unwrapped is None
    # A spring may lose its length, so that no theorem is about every start.
    assert not guarded.every_start
    assert guarded.region is not None
    assert guarded.region.proved
    assert verify(guarded, config).verified


@pytest.mark.heavy
def test_a_guard_that_holds_the_body_is_not_decided():
    """The rest state is at the angle of a repelling guard, where the force jumps."""
    held = {"kind": "guard", "method": "repelling", "couple": 500.0, "soft_angle": 0.01}
    pushed = SPRING | {"anchor": [0.9, 0.01, 0.0], "stiffness": 900.0}
    config = config_of(pushed, others={"range": held})
    guarded = prove(config)
    assert not guarded.proved
    assert guarded.undecided
    assert any(
        low[1] <= 0.01 <= high[1] or low[1] <= -0.01 <= high[1] for low, high in guarded.undecided
    )
