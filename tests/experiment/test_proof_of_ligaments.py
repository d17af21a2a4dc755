"""Protects proofs of configs with ligaments: rest states, regions, starts, and what is refused."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from support.config_elements import CONTROLLER, STRUT, TIE, UPRIGHT, config_data
from support.sliding_ties import tie

import rbstab
from rbstab.analysis.configuration import configurations
from rbstab.analysis.exact import decimal_balls, in_balls
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.answers.reasons import NOT_DAMPED
from rbstab.experiment.convergence.convergence import Enclose, Undecided
from rbstab.experiment.convergence.exact_motion import convergence_at_start, prove_convergence
from rbstab.experiment.proof import prove
from rbstab.experiment.robust.bodies import prove_within
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import _in_modes, enclosed_start, start_state
from rbstab.experiment.tuning.kept_range import NotDecidedError, unguarded
from rbstab.experiment.verification.verify import verify
from rbstab.proof import limits

EXAMPLE = Path(__file__).parents[2] / "configs" / "examples" / "ligament_proved.yaml"

BAND: dict[str, Any] = {
    "kind": "ligament",
    "point": [0.1, 0.2, 0.3],
    "anchor": [0.5, 0.1, 0.5],
    "stiffness": 100.0,
    "slack_length": 0.3,
    "toe_strain": 0.2,
    "damping": 8.0,
}
PERMANENT = CONTROLLER | {"variant": "permanent"}
JOINED = {"tie": TIE, "upright": UPRIGHT}
HELD = config_data({"band": BAND}, PERMANENT)
FREE = config_data({"band": BAND})


@pytest.fixture(scope="module", params=["held", "free"])
def proved(request):
    """Return a config with a ligament, and its proof."""
    config = load_config({"held": HELD, "free": FREE}[request.param])
    return config, prove(config)


def test_the_rest_state_is_proved_and_is_where_motions_end(proved):
    config, proof = proved
    assert proof.proved
    assert proof.unique
    assert proof.globally_stable
    data = HELD if config.controller.variant == "permanent" else FREE
    result = rbstab.simulate(data | {"integration": {"duration": 12.0, "samples": 13}})
    assert result["orientation"][-1] == pytest.approx(proof.states[0].orientation, abs=1e-5)
    assert result["position"][-1] == pytest.approx(proof.states[0].position, abs=1e-5)


def test_a_start_in_the_region_is_proved_to_converge(proved):
    config, proof = proved
    problem = problem_of(config)
    assert start_state(problem, proof) == 1
    found = convergence_at_start(config, problem, proof)
    assert (found.proved, found.rest_state, found.time) == (True, 1, 0.0)
    for enclose in (Enclose.BRIEFLY, Enclose.TO_END):
        found = prove_convergence(config, problem, proof, enclose).convergence
        assert (found.proved, found.rest_state) == (True, 1)
    assert any(", inside;" in one for one in stability_of(problem, proof).statements)


def test_a_start_outside_is_not_decided_because_the_ligament_switches(proved):
    config, proof = proved
    fast = config.initial.model_copy(update={"angular_velocity": (90.0, 90.0, 90.0)})
    config = config.model_copy(update={"initial": fast})
    problem = problem_of(config)
    assert start_state(problem, proof) is None
    found = prove_convergence(config, problem, proof, Enclose.UNTIL_PROVED).convergence
    assert (found.proved, found.reason) == (None, Undecided.SWITCHES)


def _assert_modes(build, count):
    assert len(_in_modes(*build(decimal_balls))) == count


@pytest.mark.parametrize("place", [0.5, 1.0, 1.2, 1.4, 3.0])
def test_the_energy_at_a_start_has_that_of_the_ligament(place):
    """The ligament is slack, at its slack length, in its toe, at the end of it, and beyond.

    At a switch the balls do not tell in which mode it is; both have nearly the same energy.
    """
    along = np.array([0.6, 0.0, 0.8])
    end = {"point": [0.0, 0.0, 0.0], "anchor": (-0.5 * place * along).tolist()}
    band = BAND | end | {"slack_length": 0.5, "damping": 0.0}
    data = config_data({"band": band}, gravity=[0.0, 0.0, 0.0])
    data["initial"] = {"velocity": [1.0, 0.0, 0.0]}
    build = problem_of(load_config(data)).exact
    assert build is not None
    start = in_balls(partial(enclosed_start, build))
    strain = place - 1
    toe = strain**3 / (12 * 0.2)
    beyond = (strain - 0.2) ** 2 / 2 + 0.2**2 / 6
    stored = 0.5 * 100 * (0 if strain <= 0 else toe if strain <= 0.4 else beyond)
    exact = 0.5 * 41 + stored
    assert start.least <= exact * (1 + 1e-12)
    assert start.energy >= exact * (1 - 1e-12)
    assert start.energy - start.least < 1e-9
    in_balls(partial(_assert_modes, build, 2 if place == 1.0 else 1))


@pytest.mark.heavy
def test_a_stored_proof_is_the_same_and_is_verified(proved):
    config, proof = proved
    again = Proof.model_validate_json(proof.model_dump_json())
    assert again == proof
    other = load_config(HELD if config.controller.variant == "permanent" else FREE)
    stiffer = other.model_copy(
        update={"elements": {"band": other.elements["band"].model_copy(update={"stiffness": 101})}}
    )
    wrong = {finding.claim for finding in verify(proof, stiffer).findings if not finding.verified}
    assert wrong == {"id", "energy"}
    assert verify(proof, config).verified


def test_ids_depend_on_ligaments_and_on_who_damps():
    texts = [FREE, HELD, config_data({}), config_data({"band": BAND | {"damping": 9.0}})]
    undamped = [
        config_data({"tie": TIE, "upright": UPRIGHT}, None),
        config_data({"tie": TIE}, None),
    ]
    ids = [proof_id(load_config(data)) for data in (*texts, *undamped)]
    assert len(set(ids)) == len(ids)


def test_with_a_barrier_every_start_converges():
    proof = prove(EXAMPLE)
    assert proof.every_start
    config = load_config(EXAMPLE)
    rng = np.random.default_rng(0)
    for _ in range(3):
        start = {
            "orientation": rng.uniform(-1, 1, size=3) * [3.0, 1.4, 3.0],
            "angular_velocity": rng.uniform(-20, 20, size=3),
        }
        data = config.model_dump(mode="json", exclude_none=True)
        data["initial"] = {key: value.tolist() for key, value in start.items()}
        data["integration"] = {"duration": 6.0, "samples": 7}
        result = rbstab.simulate(data)
        assert result.status == "completed"
        assert result["orientation"][-1] == pytest.approx(proof.states[0].orientation, abs=1e-4)


def test_a_brief_search_says_so_and_has_no_region(monkeypatch):
    monkeypatch.setattr(limits, "BRIEF_WITH_LIGAMENTS", 100)
    config = load_config(FREE)
    short = prove(config, brief=True)
    assert (short.brief, short.proved, short.region) == (True, False, None)
    found = prove_convergence(config, problem_of(config), short, Enclose.BRIEFLY).convergence
    assert (found.proved, found.reason) == (None, Undecided.NO_REGION)
    assert "--prove tries more). Only a region could decide: an element" in found.why
    assert prove(config).proved


def test_a_brief_search_for_all_real_angles_says_so(monkeypatch):
    """The range of eq. 5 is proved, and no box is left for the wider one."""
    config = load_config(config_data({"band": BAND}, CONTROLLER | {"K_r": [100.0] * 3}))
    examined = prove(config).examined
    monkeypatch.setattr(limits, "BRIEF_WITH_LIGAMENTS", examined + 1)
    short = prove(config, brief=True)
    assert (short.brief, short.proved) == (True, True)
    assert short.unwrapped is not None
    assert not short.unwrapped.proved


@pytest.mark.heavy
def test_springs_beside_ligaments_of_a_free_body_are_proved():
    config = load_config(config_data({"band": BAND, "strut": STRUT}))
    proof = prove(config)
    assert proof.proved
    assert proof.needs_lengths
    at_rest = configurations(problem_of(config).system)
    q = np.concatenate([proof.states[0].orientation, proof.states[0].position])
    found = minimize(
        lambda q: float(at_rest.energy(q)),
        q + 0.02,
        method="Nelder-Mead",
        options={"xatol": 1e-8, "fatol": 1e-12, "maxiter": 20000},
    ).x
    np.testing.assert_allclose(found, q, atol=1e-4)
    assert verify(proof.model_copy(update={"unwrapped": None}), config).verified


def test_of_a_held_body_springs_and_ligaments_are_proved_together():
    proof = prove(config_data({"band": BAND, "strut": STRUT}, PERMANENT))
    assert proof.proved
    assert proof.reduced_energy is not None
    kinds = [kind for kind, *_ in proof.reduced_energy.operations]
    # The root of the length of each, and the step of the ligament alone.
    assert (kinds.count("sqrt"), kinds.count("step")) == (2, 1)


def test_beside_a_sliding_tie_nothing_is_proved():
    proof = prove(config_data({"band": BAND, "tie": tie()}))
    assert proof.outcome.startswith("an element switches")


@pytest.mark.heavy
@pytest.mark.parametrize("controller", [PERMANENT, CONTROLLER], ids=["held", "free"])
def test_a_soft_guard_beside_a_ligament_is_proved(controller):
    """It acts where the ligament alone would have the body rest."""
    alone = prove(config_data({"band": BAND}, controller)).states[0].orientation[1]
    soft = {"kind": "guard", "method": "repelling", "couple": 50.0, "soft_angle": 0.5 * abs(alone)}
    config = load_config(config_data({"band": BAND, "range": soft}, controller))
    proof = prove(config)
    assert proof.unique
    assert proof.states[0].held
    assert abs(proof.states[0].orientation[1]) == soft["soft_angle"]
    assert verify(proof, config).verified


def test_tolerances_of_bodies_but_no_soft_guards_beside_ligaments():
    config = load_config(HELD)
    within = prove_within(config, tolerances_of(config, ["elements.band.stiffness=±1%"]))
    assert within.proved
    with pytest.raises(NotDecidedError, match="ligaments"):
        unguarded(config)


@pytest.mark.heavy
def test_elements_that_damp_every_motion_need_no_controller():
    """The spring of the attitude has further rest states; some are at the ends of the range."""
    config = load_config(config_data(JOINED | {"band": BAND}, None))
    proof = prove(config)
    assert proof.unique is False
    assert proof.region is not None
    assert proof.region.lower_bound > 100
    assert start_state(problem_of(config), proof) == 1


@pytest.mark.parametrize("names", [["tie"], ["upright"], []])
def test_one_of_them_is_not_enough(names):
    proof = prove(config_data({name: JOINED[name] for name in names} | {"band": BAND}, None))
    assert NOT_DAMPED in proof.outcome
