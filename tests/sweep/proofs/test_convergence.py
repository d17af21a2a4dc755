"""Protects the column `convergence`: members that share a proof agree with their single runs."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from support.paper_runs import paper_config
from support.valleys import TWO_VALLEYS

import rbstab
from rbstab.analysis.exact import in_balls
from rbstab.config.build import problem_of
from rbstab.experiment.proof_cache import proof_for
from rbstab.experiment.stored_proof.proof import Proof, no_proof
from rbstab.experiment.stored_proof.starts import enclosed_start, reached_states, start_state
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.proofs.columns import CONVERGENCE, NO_PROOF, NOT_PROVED
from rbstab.sweep.proofs.convergence import ProvedConvergence
from rbstab.sweep.proofs.starts import ProvedStarts
from rbstab.systems.modes import modes_of

SHORT: dict[str, Any] = {"duration": 0.01, "samples": 3, "rtol": 1e-8}
SPIN = "initial.angular_velocity[0]"


def plan_of(vary, with_gravity=True):
    base = paper_config("free", with_gravity, initial={"angular_velocity": [0, 0, 0]}, **SHORT)
    return load_plan({"base": base, "vary": vary})


def words(plan, folder):
    return [CONVERGENCE[code] for code in ProvedConvergence(plan, folder).of(0, plan.members).codes]


@pytest.mark.parametrize("with_gravity", [False, True])
def test_inside_and_outside_are_those_of_single_runs(tmp_path, with_gravity):
    plan = plan_of({SPIN: {"values": [1.0, 8.0, 9.92, 9.94, 12.0]}}, with_gravity)
    proof = proof_for(tmp_path, plan.base_of("free"))
    answers = [
        rbstab.simulate(plan.config_of(k), proof=proof).attributes["convergence"] for k in range(5)
    ]
    expected = ["proved" if word == "proved" else "not proved" for word in answers]
    assert words(plan, tmp_path) == expected
    assert set(expected) == {"proved", "not proved"}


def test_members_that_do_not_share_the_proof_are_not_judged_by_it(tmp_path):
    plan = plan_of({"body.mass": {"values": [41.0, 42.0]}})
    proof_for(tmp_path, plan.base_of("free"))
    assert words(plan, tmp_path) == ["unknown", "unknown"]


@pytest.fixture(scope="module")
def valleys(tmp_path_factory):
    """A plan with starts in both valleys and between them, and what is proved of its members."""
    vary = {
        "initial.orientation[0]": {"linspace": [-3, 3, 13]},
        "initial.orientation[2]": {"values": [0.0, 0.3]},
        SPIN: {"values": [0.0, 2.5, 4.0]},
    }
    plan = load_plan({"base": TWO_VALLEYS, "vary": vary})
    folder = tmp_path_factory.mktemp("valleys")
    proof = proof_for(folder, plan.base_of("permanent"))
    return plan, proof, ProvedConvergence(plan, folder)


def test_each_start_is_proved_to_reach_the_state_of_its_single_run(valleys):
    plan, proof, convergence = valleys
    of_members = convergence.of(0, plan.members)
    expected = [start_state(problem_of(plan.config_of(k)), proof) or 0 for k in range(plan.members)]
    assert of_members.rest_states.tolist() == expected
    assert set(expected) == {0, 1, 2}
    proved = of_members.codes == CONVERGENCE.index("proved")
    assert proved.tolist() == [number > 0 for number in expected]


@pytest.mark.parametrize(("goes_on", "code"), [(True, NO_PROOF), (False, NOT_PROVED)])
def test_a_proof_that_may_go_on_excludes_no_start(valleys, monkeypatch, goes_on, code):
    """After more boxes the start may be in a region."""
    plan, _, convergence = valleys
    monkeypatch.setattr(Proof, "goes_on", goes_on)
    of_members = convergence.of(0, plan.members)
    assert set(of_members.codes[of_members.rest_states == 0].tolist()) == {code}


def test_a_small_energy_outside_of_the_range_proves_nothing(valleys):
    _, proof, _ = valleys
    energy = np.full(2, proof.states[0].energy)
    alone = proof.model_copy(update={"unwrapped": None})
    for end in (-3.2, 3.2):
        angles = np.array([[0.1, 0.0, 0.0], [end, 0.0, 0.0]])
        assert reached_states(alone, energy, angles, angles)[0].tolist() == [1, 0]


POINT = [0.1, 0.1, -0.3]
BAND = {"kind": "ligament", "point": POINT, "anchor": POINT, "stiffness": 200.0}
LAW = {"slack_length": 0.125, "toe_strain": 0.4}


def with_band():
    """Return a config with a ligament whose length is |X| at Θ = 0; the body is at rest there."""
    still = {"angular_velocity": [0, 0, 0], "velocity": [0, 0, 0], "position": [0, 0, 0]}
    base = paper_config("visco-elastic", True, initial=still, **SHORT)
    return base | {"schema_version": 2, "elements": {"band": BAND | LAW}}


def test_each_member_has_its_own_modes_of_a_ligament(tmp_path):
    """Slack, in its toe and beyond: the energy at each start is that of its single run."""
    base = with_band()
    axes = {f"initial.position[{k}]": {"linspace": [-0.2, 0.23, 4]} for k in range(3)}
    plan = load_plan({"base": base, "vary": axes})
    proof = proof_for(tmp_path, plan.base_of("visco-elastic"))
    starts = ProvedStarts(plan.base_of("visco-elastic"), plan.varied_keys, proof)
    enclosed = starts.starts(plan.values(0, plan.members), plan.members)
    builds: list[Any] = [problem_of(plan.config_of(k)).exact for k in range(plan.members)]
    energies = np.array([in_balls(partial(enclosed_start, build)).energy for build in builds])
    assert np.all(enclosed.energy >= energies)
    assert enclosed.energy == pytest.approx(energies, rel=1e-9)
    modes = {modes_of(problem_of(plan.config_of(k)).system) for k in range(plan.members)}
    assert modes == {(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)}
    expected = [start_state(problem_of(plan.config_of(k)), proof) for k in range(plan.members)]
    codes = ProvedConvergence(plan, tmp_path).of(0, plan.members).codes
    assert [code == CONVERGENCE.index("proved") for code in codes] == [
        state is not None for state in expected
    ]
    assert len(set(expected)) == 2


def test_at_a_switch_nothing_is_said_of_a_member():
    """Bounds on numbers do not tell in which mode it is."""
    base = with_band()
    plan = load_plan({"base": base, "vary": {"initial.position[0]": {"values": [0.1, 0.125, 0.2]}}})
    starts = ProvedStarts(plan.base_of("visco-elastic"), plan.varied_keys, no_proof("", ""))
    enclosed = starts.starts(plan.values(0, plan.members), plan.members)
    assert np.isfinite(enclosed.energy).tolist() == [True, False, True]
