"""Protects what is proved with a barrier on θ2: where every start converges, and where it does not.

The table of claims has searches that find no others; `verification` has the checker's answers.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment.convergence.decisions import convergence_at_start
from rbstab.experiment.proof import prove
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import reached_state, start_state
from rbstab.experiment.verification.verify import verify

CASE = Path(__file__).parents[2] / "configs/paper/case1_guarded.yaml"
FAR = np.array([40.0, 1.5, -300.0])


def guarded(stiffness=100.0, soft=1.0, **barrier):
    """Return the config of case 1, with a barrier and with K_r times `soft`."""
    data = yaml.safe_load(CASE.read_text(encoding="utf-8"))
    data["controller"]["K_r"] = [soft * gain for gain in data["controller"]["K_r"]]
    data["elements"]["range"] |= {"stiffness": stiffness, **barrier}
    return load_config(data)


@cache
def proof_of(stiffness=100.0, soft=1.0, outer=0.0):
    return prove(guarded(stiffness, soft, **({"outer_stiffness": outer} if outer else {})))


def said(config, proof, *convergence):
    return " ".join(stability_of(problem_of(config), proof, *convergence).statements)


def test_every_start_converges():
    config, proof = guarded(), proof_of()
    assert proof.every_start
    assert proof.globally_stable
    np.testing.assert_allclose(proof.states[0].orientation, 0.0, atol=1e-12)
    convergence = convergence_at_start(problem_of(config), proof)
    assert (convergence.proved, convergence.bound) == (True, np.inf)
    assert convergence.as_data()["bound"] is None
    text = said(config, proof, convergence)
    assert "Every start in the range converges: proved." in text
    assert "keeps a distance" not in text
    assert "every start in the range converges" in convergence.sentence
    assert reached_state(proof, 1e9, FAR, FAR) == 1
    beyond = np.array([0.0, np.nextafter(np.pi / 2, 2), 0.0])
    for low, high in ((beyond,) * 2, (-beyond,) * 2, (np.full(3, np.nan),) * 2, (-beyond, beyond)):
        assert reached_state(proof, 1.0, low, high) is None


def test_a_stiff_barrier_may_bring_rest_states_beyond_the_range_of_eq_5():
    """Another program found them: for K_r x 0.3, none for 1 N m and two for 100 N m."""
    assert proof_of(1.0, 0.3).every_start
    config, proof = guarded(100.0, 0.3), proof_of(100.0, 0.3)
    assert (len(proof.states), len(proof.unwrapped.states)) == (1, 3)
    orientations = np.array([state.orientation for state in proof.unwrapped.states])
    assert np.all(np.abs(orientations[1:, 0]) > np.pi)
    assert not proof.every_start
    assert proof.unwrapped.globally_stable is False
    assert start_state(problem_of(config), proof) is None
    assert "very start" not in said(config, proof)
    # It still has a region, which ends at the other rest states, or at the end of the search.
    bound = proof.unwrapped.region.energy_bound
    assert 0 < bound <= proof.unwrapped.states[1].energy
    near = np.array([0.1, 1.0, 0.1])
    assert reached_state(proof, 0.99 * bound, near, near) == 1
    assert reached_state(proof, 1.01 * bound, near, near) is None


def test_a_claim_needs_the_barrier():
    """Without it no start is proved by uniqueness alone; nor is a file with the claim believed."""
    data = yaml.safe_load(CASE.read_text(encoding="utf-8"))
    del data["elements"]
    proof = prove(data)
    assert proof.unwrapped is not None
    assert proof.unwrapped.globally_stable
    assert not proof.every_start
    assert reached_state(proof, 1e9, FAR, FAR) is None
    stored = proof.model_dump(mode="json")
    assert "every_start" not in stored["unwrapped"]
    stored["unwrapped"]["every_start"] = True
    opened = [proof_of(outer=2.0).model_dump(mode="json") for _ in range(2)]
    opened[0]["reduced_energy"]["closed"], opened[1]["reduced_energy"]["closed"] = [1], [0, 2]
    for forged in map(Proof.model_validate, (stored, *opened)):
        assert not forged.every_start
        assert not verify(forged).verified


@pytest.mark.parametrize("barrier", [{"stiffness": 1e-60}, {"outer_stiffness": 1e-60}])
def test_a_barrier_of_any_stiffness_keeps_the_range(barrier):
    """U rises at the ends without it."""
    assert prove(guarded(**barrier)).every_start


def test_states_that_doubles_do_not_tell_from_the_end_are_not_decided():
    """Where U falls, a weak barrier holds the body some 1e-20 rad before θ2 = ±π/2."""
    proof = proof_of(1e-60, 0.3)
    assert not proof.proved
    assert not proof.every_start
    assert proof.undecided
    assert all(max(np.abs([low[1], high[1]])) > np.pi / 2 - 1e-6 for low, high in proof.undecided)


def test_barriers_on_all_angles_close_the_range_of_eq_5():
    """Then every start in the range of eq. 5 converges, as the paper claims; beyond it, nothing."""
    config, proof = guarded(outer_stiffness=2.0), proof_of(outer=2.0)
    assert proof.closed
    assert proof.every_start
    assert (proof.unwrapped, proof.region) == (None, None)
    assert Proof.model_validate_json(proof.model_dump_json()) == proof
    far = np.array([3.1, 1.5, -3.1])
    assert reached_state(proof, 1e12, far, far) == 1
    assert reached_state(proof, 1.0, FAR, FAR) is None
    text = said(config, proof)
    assert "Every start in the range converges: proved. Barriers keep every motion in" in text
    assert "not decided" not in text
    assert convergence_at_start(problem_of(config), proof).bound == np.inf
    other = guarded(outer_stiffness=2.0 * (1 + 1e-9))
    wrong = {finding.claim for finding in verify(proof, other).findings if not finding.verified}
    assert wrong == {"id", "energy"}
