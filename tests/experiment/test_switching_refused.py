"""What needs smooth equations refuses a config whose elements switch, and names the reason."""

import numpy as np
import pytest
from support.sliding_ties import tie
from support.switching import data, guard, problem

from rbstab.config.load import load_config
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.proof import prove
from rbstab.experiment.stability import stability_of
from rbstab.experiment.tuning.sensitivities import sensitivities
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy, reject

CONTROLLER = {"variant": "free", "K_t": [40, 50, 60], "L_t": [4, 5, 6]}
CONTROLLER |= {"K_r": [30, 40, 50], "L_r": [3, 4, 5]}


@pytest.fixture
def unproved():
    """Return a config of which nothing is proved: not so of one with a ligament or a guard."""
    return load_config(data({"it": tie()}, controller=CONTROLLER))


def test_reduced_energy(unproved):
    from rbstab.config.build import problem_of

    with pytest.raises(NoReducedEnergy) as caught:
        reject(problem_of(unproved).system)
    assert caught.value.reason is NoEnergyReason.SWITCHES


def test_proof_of_rest_states(unproved):
    from rbstab.config.build import problem_of

    proof = prove(unproved)
    assert not proof.states
    assert proof.outcome.startswith("an element switches")
    stability = stability_of(problem_of(unproved), proof)
    assert stability.statements[0].startswith("Rest states: not decided (an element switches")


@pytest.mark.parametrize("enclose", [Enclose.UNTIL_PROVED, Enclose.TO_END])
def test_enclosure_of_the_exact_motion(unproved, enclose):
    from rbstab.config.build import problem_of

    found = prove_convergence(unproved, problem_of(unproved), prove(unproved), enclose)
    assert found.convergence.proved is None
    assert "an element switches" in found.convergence.why
    assert found.samples is None


@pytest.mark.parametrize("kind", [guard("stiff", 40.0), guard("repelling", 40.0), {"kind": "tie"}])
def test_other_switches_are_followed(kind):
    """Without `--prove` only where the start is counts; nothing refuses to follow it."""
    from rbstab.config.build import problem_of
    from rbstab.experiment.convergence.decisions import not_enclosed

    elements = {"it": tie() if kind == {"kind": "tie"} else kind}
    refused = not_enclosed(problem_of(load_config(data(elements, controller=CONTROLLER))))
    assert (refused is not None) == (kind == {"kind": "tie"})
    if refused is not None:
        assert "it may slide on a surface" in refused.why


def test_smooth_elements_are_not_refused():
    """The refusals are for switches, not for elements."""
    smooth = data(
        {"x": {"kind": "attitude", "K": [9, 9, 9], "L": [1, 1, 1]}}, controller=CONTROLLER
    )
    reject(problem(smooth).system)
    smooth["integration"] |= {"duration": 8.0}
    smooth["initial"] = {"velocity": [1, 0, 0], "angular_velocity": [0.1, 0.2, 0.3]}
    assert np.isfinite(sensitivities(smooth).derivatives).any()
