"""Protects what is said of driven motions: nothing is proved, and derivatives are exact."""

import numpy as np
import pytest
from support.inputs import LEGS, SINE, couple, driven, force

import rbstab
from rbstab.analysis.linearisation import linearise
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.robust.bodies import prove_within
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stored_proof.identity import proof_id

CONTROLLER = {
    "variant": "visco-elastic",
    **{name: [30.0, 40.0, 50.0] for name in ("K_t", "K_r", "K_c")},
    **{name: [3.0, 4.0, 5.0] for name in ("L_t", "L_r", "L_c")},
}
SMOOTH = {"push": force(SINE, point=[0.1, 0, 0.2]), "turn": couple({"kind": "constant"})}


def config_of(elements, engine="scipy", **sections):
    return load_config(driven(elements, engine, controller=CONTROLLER, **sections))


@pytest.mark.parametrize("push", [couple({"kind": "constant"}), force(SINE), force(LEGS["noise"])])
def test_nothing_is_proved(push):
    """The same body without the input is proved globally stable; with it nothing is said."""
    config = config_of({"push": push})
    proof = rbstab.prove(config)
    assert not proof.states
    assert proof.globally_stable is None
    assert "an element supplies power" in proof.outcome
    assert rbstab.prove(config_of({})).globally_stable
    run = simulate(config, proof=proof)
    assert run.attributes["convergence"] == "not decided"
    why = [str(value) for name, value in run.attributes.items() if "convergence" in name]
    assert "an element supplies power, so v may rise" in " ".join(why)
    verdicts = dict(zip(run["certificate/check"], run["certificate/verdict"], strict=True))
    assert verdicts["global stability"] == verdicts["certified region"] == "unknown"


def test_nothing_is_proved_of_bodies_within_tolerances():
    config = config_of(SMOOTH)
    proof = prove_within(config, tolerances_of(config, ["body.mass=±1%"]))
    assert (proof.proved, proof.why) == (None, "an element supplies power")


def test_inputs_have_no_effect_on_the_linearised_body():
    """The eigenvalues are those of the body at its rest state, at which inputs do not act."""
    spectra = []
    for elements in ({}, SMOOTH | {"follow": force(SINE, quantity="body_force")}):
        system = problem_of(config_of(elements)).system
        rest = nearest_rest_state(system)
        spectra.append(linearise(system, rest.motion, rest.element_states).eigenvalues)
    np.testing.assert_allclose(spectra[0], spectra[1], rtol=1e-12)
    assert proof_id(config_of({})) != proof_id(config_of(SMOOTH))


def test_a_driven_motion_may_end_below_another_rest_state():
    """v counts from a rest state without inputs, and the text says so."""
    run = simulate(config_of({"push": force(LEGS["ramp"])}))
    assert str(run.attributes["lyapunov_zero"]).startswith("the rest state without inputs")
    assert run["lyapunov"][0] == pytest.approx(0, abs=1e-15)
    assert run["lyapunov"][-1] > 1e-3
