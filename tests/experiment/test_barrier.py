"""Protects what is proved with a barrier on θ2: where every start converges, and where it does not.

Rest states are looked for by scipy from many starts, with the stored energy of the system itself,
which no module of the proofs computes.
"""

from pathlib import Path

import numpy as np
import pytest
import yaml
from pydantic import ValidationError
from scipy.optimize import minimize, root

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment.convergence.exact_motion import convergence_at_start
from rbstab.experiment.proof import prove
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import reached_state, starts_inside
from rbstab.experiment.verification.verify import verify

PAPER = Path(__file__).parents[2] / "configs" / "paper"
CASES = ["case1", "case2", "case3"]
FAR = np.array([40.0, 1.5, -300.0])


def guarded(case="case1", stiffness=100.0, soft=1.0, **barrier):
    """Return the config of a case, with a barrier and with K_r times `soft`."""
    data = yaml.safe_load((PAPER / f"{case}_guarded.yaml").read_text(encoding="utf-8"))
    data["controller"]["K_r"] = [soft * gain for gain in data["controller"]["K_r"]]
    data["elements"]["range"] |= {"stiffness": stiffness, **barrier}
    return load_config(data)


@pytest.fixture(scope="module")
def proofs():
    """Proofs by the arguments of `guarded`, each made once."""
    found = {}

    def proof_of(*arguments):
        if arguments not in found:
            found[arguments] = prove(guarded(*arguments))
        return found[arguments]

    return proof_of


@pytest.mark.parametrize("case", CASES)
def test_every_start_of_the_guarded_cases_converges(case, proofs):
    config = load_config(PAPER / f"{case}_guarded.yaml")
    proof = prove(config)
    assert proof.every_start
    assert proof.globally_stable
    np.testing.assert_allclose(proof.states[0].orientation, 0.0, atol=1e-12)
    problem = problem_of(config)
    assert starts_inside(problem, proof)
    convergence = convergence_at_start(config, problem, proof)
    assert convergence.proved
    assert convergence.bound == np.inf
    assert convergence.as_data()["bound"] is None
    said = " ".join(stability_of(problem, proof, convergence).statements)
    assert "Every start in the range converges: proved." in said
    assert "keeps a distance" not in said
    assert "every start in the range converges" in convergence.sentence


def roots(config, starts, seed):
    """Return the Θ at which the gradient of the stored energy is zero, that scipy finds.

    Half of the starts are within 0.2 rad of θ2 = ±π/2. From half of the starts the way goes down
    first, so that it ends near a minimum.
    """
    at_rest: Configurations = configurations(problem_of(config).system)
    rng = np.random.default_rng(seed)
    found = []
    for start in range(starts):
        q = np.zeros(at_rest.size)
        q[[0, 2]] = rng.uniform(-9, 9, 2)
        q[1] = rng.uniform(-1.5, 1.5)
        if start % 2:
            q[1] = rng.choice([-1, 1]) * (np.pi / 2 - 10 ** rng.uniform(-2, -0.7))
        scale = np.abs(at_rest.gradient(q)).max()
        if start % 4 < 2:
            limits = [(-1.5707, 1.5707) if k == 1 else (None, None) for k in range(at_rest.size)]
            q = minimize(at_rest.energy, q, jac=at_rest.gradient, bounds=limits).x
        result = root(at_rest.gradient, q, method="hybr")
        if result.success and abs(result.x[1]) < np.pi / 2:
            residual = np.abs(at_rest.gradient(result.x)).max()
            if residual < 1e-7 * scale:
                found.append(result.x[:3])
    return np.array(found)


SEARCHED = [
    ("case1", 100.0, 1.0),
    ("case2", 100.0, 1.0),
    ("case3", 100.0, 1.0),
    ("case1", 1.0, 1.0),
    ("case1", 1.0, 0.3),
    ("case1", 100.0, 0.3),
    ("case2", 0.01, 0.3),
]


@pytest.mark.parametrize("arguments", SEARCHED)
def test_scipy_finds_no_rest_state_that_the_proof_misses(arguments, proofs):
    wide = proofs(*arguments).unwrapped
    assert wide is not None
    assert wide.proved
    found = roots(guarded(*arguments), 60, seed=3)
    assert len(found) > 15
    known = np.array([state.orientation for state in wide.states])
    distance = np.abs(found[:, np.newaxis] - known).max(axis=2).min(axis=1)
    assert np.all(distance < 1e-5)


@pytest.mark.parametrize("arguments", [("case1", 100.0, 1.0), ("case1", 1.0, 0.3)])
def test_beyond_the_searched_boxes_the_energy_rises_to_the_border(arguments, proofs):
    end = proofs(*arguments).unwrapped.end
    assert 1.0 < end[1] < np.pi / 2
    at_rest = configurations(problem_of(guarded(*arguments)).system)
    rng = np.random.default_rng(4)
    for _ in range(300):
        Theta = rng.uniform(-1, 1, 3) * end
        Theta[1] = rng.choice([-1, 1]) * rng.uniform(end[1], np.pi / 2)
        assert at_rest.gradient(Theta)[1] * np.sign(Theta[1]) > 0


def test_a_stiff_barrier_may_bring_rest_states_beyond_the_range_of_eq_5(proofs):
    """Another program found them: for K_r x 0.3, none for 1 N m and two for 100 N m."""
    assert proofs("case1", 1.0, 0.3).every_start
    proof = proofs("case1", 100.0, 0.3)
    assert len(proof.states) == 1
    assert len(proof.unwrapped.states) == 3
    assert all(abs(state.orientation[0]) > np.pi for state in proof.unwrapped.states[1:])
    assert not proof.every_start
    assert proof.unwrapped.globally_stable is False
    problem = problem_of(guarded("case1", 100.0, 0.3))
    assert not starts_inside(problem, proof)
    said = " ".join(stability_of(problem, proof).statements)
    assert "very start" not in said
    # It still has regions, which end at the other rest states.
    bound = proof.unwrapped.region.energy_bound
    assert bound == pytest.approx(proof.unwrapped.states[1].energy, rel=1e-9)
    near = np.array([0.1, 1.0, 0.1])
    assert reached_state(proof, 0.99 * bound, near, near) == 1
    assert reached_state(proof, 1.01 * bound, near, near) is None


def test_a_start_may_be_anywhere_with_a_theta2_below_a_quarter_turn(proofs):
    proof = proofs("case1", 100.0, 1.0)
    assert reached_state(proof, 1e9, FAR, FAR) == 1
    beyond = np.array([0.0, np.nextafter(np.pi / 2, 2), 0.0])
    for outside in (beyond, -beyond, np.full(3, np.nan)):
        assert reached_state(proof, 1.0, outside, outside) is None
    assert reached_state(proof, 1.0, -beyond, beyond) is None


def test_without_a_barrier_no_start_is_proved_by_uniqueness_alone():
    data = yaml.safe_load((PAPER / "case1_guarded.yaml").read_text(encoding="utf-8"))
    del data["elements"]
    config = load_config(data)
    proof = prove(config)
    assert proof.unwrapped is not None
    assert proof.unwrapped.globally_stable
    assert not proof.every_start
    assert reached_state(proof, 1e9, FAR, FAR) is None
    # A claim in a file needs the barrier too.
    stored = proof.model_dump(mode="json")
    assert "every_start" not in stored["unwrapped"]
    assert "barrier" not in stored["reduced_energy"]
    stored["unwrapped"]["every_start"] = True
    forged = Proof.model_validate(stored)
    assert not forged.every_start
    assert not verify(forged).verified


@pytest.mark.parametrize("barrier", [{"stiffness": 1e-60}, {"outer_stiffness": 1e-60}])
def test_a_barrier_of_any_stiffness_keeps_the_range(barrier):
    """U rises at the ends without it."""
    config = guarded(**barrier)
    proof = prove(config)
    assert proof.every_start
    assert starts_inside(problem_of(config), proof)


def test_states_that_doubles_do_not_tell_from_the_end_are_not_decided():
    """Where U falls, a weak barrier holds the body some 1e-20 rad before θ2 = ±π/2."""
    proof = prove(guarded(soft=0.3, stiffness=1e-60))
    assert not proof.proved
    assert not proof.every_start
    assert proof.undecided
    assert all(max(np.abs([low[1], high[1]])) > np.pi / 2 - 1e-6 for low, high in proof.undecided)


def test_barriers_add_up():
    data = yaml.safe_load((PAPER / "case1_guarded.yaml").read_text(encoding="utf-8"))
    data["elements"] = {
        name: {"kind": "guard", "method": "barrier", "stiffness": stiffness}
        for name, stiffness in (("one", 0.1), ("two", 0.2))
    }
    proof = prove(load_config(data))
    assert proof.reduced_energy is not None
    # As decimals, not as doubles.
    assert "3/20" in str(proof.reduced_energy.operations)
    assert proof.every_start


def test_the_id_depends_on_the_barrier():
    assert len({proof_id(guarded(stiffness=k)) for k in (1.0, 2.0)}) == 2


def test_the_record_survives_a_file(proofs):
    proof = proofs("case1", 100.0, 1.0)
    stored = proof.model_dump(mode="json")
    assert stored["unwrapped"]["every_start"] is True
    assert 1 in stored["reduced_energy"]["closed"]
    assert Proof.model_validate_json(proof.model_dump_json()) == proof
    stored["unwrapped"]["unique"] = None
    with pytest.raises(ValidationError):
        Proof.model_validate(stored)


def test_the_checker_confirms_proofs_with_a_barrier(proofs):
    for arguments in (("case1", 100.0, 1.0), ("case1", 1.0, 0.3)):
        found = verify(proofs(*arguments), guarded(*arguments))
        assert found.verified
        assert {"barrier", "every start"} <= {finding.claim for finding in found.findings}


def refused(proof, **changes):
    """Return the claims that are refused after changes of the unwrapped part of a proof."""
    wide = proof.unwrapped.model_copy(update=changes)
    found = verify(proof.model_copy(update={"unwrapped": wide}))
    return {finding.claim for finding in found.findings if not finding.verified}


def test_the_checker_refuses_wrong_claims(proofs):
    several, single = proofs("case1", 100.0, 0.3), proofs("case1", 100.0, 1.0)
    left_out = {"states": several.unwrapped.states[:1], "unique": True, "every_start": True}
    assert {"no other rest state", "every start"} <= refused(
        several, **left_out, region=None, regions=()
    )
    assert "every start" in refused(several, every_start=True, region=None, regions=())
    # The unwrapped rest states of a body with K_r x 0.3 are those for a barrier of 100 N m.
    data = several.model_dump(mode="json")
    last = data["reduced_energy"]["operations"][-1]
    places = [k for k, factor in enumerate(last) if k % 2 and factor == "50"]
    (place,) = places
    last[place] = "1/2"
    assert not verify(Proof.model_validate(data)).verified
    # The barrier of another config.
    assert not verify(single, guarded("case1", 101.0)).verified
    narrow = (1.0, *single.unwrapped.end[1:])
    assert {"ends", "every start"} <= refused(single, end=narrow)


def test_the_stiffness_is_compared_with_the_config_to_the_last_digit(proofs):
    proof = proofs("case1", 100.0, 1.0)
    other = guarded("case1", np.nextafter(100.0, 101.0))
    relabelled = proof.model_copy(update={"id": proof_id(other)})
    found = verify(relabelled, other)
    assert [finding.claim for finding in found.findings if not finding.verified] == ["energy"]


def test_the_checker_confirms_regions_beside_a_barrier():
    """Each region is checked by a flood that ends at the faces of θ1 and θ3 alone."""
    proof = prove(guarded("case1", 10.0, 0.15))
    assert len(proof.states) == 3
    assert proof.region is not None
    assert proof.region.face is not None
    assert proof.region.face.startswith("θ3")
    assert verify(proof).verified
    assert proof.region.energy_bound is not None
    higher = proof.region.energy_bound + 1.0
    raised = proof.region.model_copy(update={"energy_bound": higher})
    assert not verify(proof.model_copy(update={"region": raised})).verified


def test_barriers_on_all_angles_close_the_range_of_eq_5():
    """Then every start in the range of eq. 5 converges, as the paper claims; beyond it, nothing."""
    config = guarded(outer_stiffness=2.0)
    proof = prove(config)
    assert proof.closed
    assert proof.every_start
    assert proof.unwrapped is None
    assert proof.region is None
    assert Proof.model_validate_json(proof.model_dump_json()) == proof
    far = np.array([3.1, 1.5, -3.1])
    assert reached_state(proof, 1e12, far, far) == 1
    assert reached_state(proof, 1.0, FAR, FAR) is None
    problem = problem_of(config)
    sentences = " ".join(stability_of(problem, proof).statements)
    assert "Every start in the range converges: proved. Barriers keep every motion in" in sentences
    assert "not decided" not in sentences
    assert convergence_at_start(config, problem, proof).bound == np.inf
    assert verify(proof, config).verified


def test_a_proof_that_claims_a_closed_range_falsely_is_refused():
    proof = prove(guarded(outer_stiffness=2.0)).model_dump(mode="json")
    opened = proof | {"reduced_energy": proof["reduced_energy"] | {"closed": [1]}}
    forged = Proof.model_validate(opened)
    assert not forged.every_start
    assert not verify(forged).verified
    weaker = proof | {"reduced_energy": proof["reduced_energy"] | {"closed": [0, 2]}}
    forged = Proof.model_validate(weaker)
    assert not forged.every_start
    assert not verify(forged).verified


def test_the_outer_stiffness_is_compared_with_the_config():
    proof = prove(guarded(outer_stiffness=2.0))
    other = guarded(outer_stiffness=2.0 * (1 + 1e-9))
    wrong = {finding.claim for finding in verify(proof, other).findings if not finding.verified}
    assert wrong == {"id", "energy"}


def test_rest_states_with_barriers_on_all_angles_are_those_of_descents():
    """With a soft spring the body can rest in several places, so not every start converges."""
    config = guarded(soft=0.05, stiffness=0.5, outer_stiffness=0.2)
    proof = prove(config)
    assert proof.proved
    assert not proof.closed
    at_rest = configurations(problem_of(config).system)
    minima = [np.array(one.orientation) for one in proof.states if one.index == 0]
    assert len(proof.states) > 1
    rng = np.random.default_rng(0)
    for _ in range(30):
        start = rng.uniform(-1, 1, 3) * [3.0, 1.4, 3.0]
        limits = [(-3.14, 3.14), (-1.57, 1.57), (-3.14, 3.14)]
        end = minimize(
            at_rest.energy, start, jac=at_rest.gradient, method="L-BFGS-B", bounds=limits
        )
        assert min(np.abs(end.x - one).max() for one in minima) < 1e-3
    assert all(region.lower_bound > 0 for region in proof.regions)
    assert verify(proof).verified
