"""Almost every start (theorem 14): what is proved, and what must not be."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from support.leg import BODY
from support.leg import held_leg as leg

import rbstab
from rbstab.experiment.answers.state_words import almost_sentence
from rbstab.experiment.proof import prove
from rbstab.experiment.stored_proof.almost_every_start import almost_every_start
from rbstab.experiment.stored_proof.data import SUPPLIES
from rbstab.experiment.stored_proof.proof import Proof


def ligament(**of):
    return {"kind": "ligament", "toe_strain": 0.03, "damping": 20, **of}


FALLING = leg([5, 5, 2.5])
"""K_r < m g l = 6.386 N m/rad: it leans in one of four directions, with 5 θ = 6.386 sin θ."""


def guard(**of):
    return {"limit": {"kind": "guard", **of}}


def rope(slack_length, damping=20):
    """A line from above the leg, which is 0.5 m long where the leg is upright, else longer."""
    line = {"point": [0, 0, 0.3], "anchor": [0, 0, 0.8], "stiffness": 30}
    return {"rope": ligament(**line, slack_length=slack_length) | {"damping": damping}}


@pytest.fixture(scope="module")
def falling():
    return prove(FALLING)


@pytest.mark.slow
def test_a_leg_that_falls_rests_elsewhere(falling):
    """θ = 67.7° solves 5 θ = 6.386 sin θ."""
    almost = falling.almost_every_start
    assert (almost.proved, almost.returns, almost.states) == (True, False, (1, 2, 3, 4))
    lean = brentq(lambda angle: 5 * angle - 3.5 * 9.81 * 0.186 * np.sin(angle), 0.1, 3.0)
    largest = [np.abs(state.orientation).max() for state in falling.states[:4]]
    assert largest == pytest.approx([lean] * 4, abs=1e-6)
    assert [state.stable for state in falling.states] == [True] * 4 + [False] * 5
    assert almost_sentence(falling, almost) == (
        "rests elsewhere: almost every start (all but a set of measure zero) whose motion stays in "
        "the range and away from θ2 = ±90° converges to one of the 4 stable rest states, 67.7° "
        "from the desired attitude"
    )
    leaning = list(falling.states[0].orientation)
    for change, returns in (
        (f"desired.orientation={leaning}", False),
        ("desired.within=1.2", True),
    ):
        wanted = rbstab.load_config(FALLING, [change])  # leaning: one of four
        assert falling.of(wanted).almost_every_start.returns is returns


@pytest.mark.parametrize(
    ("config", "states"),
    [
        (leg([10, 10, 5]), 1),
        (leg([5, 5, 2.5], guard(method="stiff", stiffness=1, soft_angle=0.3)), 9),
        (leg([5, 5, 2.5], rope(0.51)), 9),
        (leg([5, 5, 2.5], rope(0.5, damping=0)), 9),
        (leg([5, 5, 2.5], guard(method="barrier", stiffness=0.01)), 9),
    ],
    ids=["one state", "stiff guard", "taut", "just taut, no damper", "barrier"],
)
@pytest.mark.heavy
def test_what_is_proved(config, states):
    proof = prove(config)
    almost = proof.almost_every_start
    assert (almost.proved, almost.why, len(proof.states)) == (True, "", states)
    assert almost.states == tuple(range(1, 1 + proof.stable_count))


@pytest.mark.parametrize(
    ("elements", "words"),
    [
        (rope(0.5), "rope may begin to act just at an unstable rest state"),
        (
            {"push": {"kind": "input", "quantity": "couple", "direction": [0, 1, 0]}
            | {"amplitude": 1, "signal": {"kind": "sine", "frequency": 1}}},
            SUPPLIES,
        ),
    ],
    ids=["just taut", "input"],
)  # fmt: skip
@pytest.mark.heavy
def test_what_is_not_proved(elements, words):
    almost = prove(leg([5, 5, 2.5], elements)).almost_every_start
    assert (almost.proved, almost.returns, almost.states) == (False, None, ())
    assert words in almost.why


def without_damper():
    """A tie at the centre of gravity damps no rotation."""
    tie = {"kind": "visco-elastic", "point": [0, 0, 0], "anchor": [0, 0, 0]}
    elements = {"tie": tie | {"K_c": [9, 9, 9], "L_c": [1, 1, 1]}}
    data = {"schema_version": 2, "body": BODY, "elements": elements}
    return rbstab.load_config(data | {"integration": {"duration": 1}})


def latch():
    """An element of a user with a switch."""
    path = Path(__file__).parents[2] / "configs/examples/latch.yaml"
    return rbstab.load_config(path, allow_python=True)


def changed(proof, number, **entries):
    """Return a proof with another entry of one of its rest states."""
    states = list(proof.states)
    states[number - 1] = states[number - 1].model_copy(update=entries)
    return proof.model_copy(update={"states": tuple(states)})


@pytest.mark.slow
def test_each_hypothesis_is_needed(falling):
    """Each is taken from a proof that has all of them."""
    config = rbstab.load_config(FALLING)
    stop = guard(method="stop", angle=1.0, restitution=0.5)
    stopped, switching = rbstab.load_config(leg([5, 5, 2.5], stop)), latch()
    line = {"kind": "spring", "point": [0, 0, 0.3], "anchor": [0, 0, 0.8], "rest_length": 0}
    damped = {"line": line | {"stiffness": 1, "damping": 1}}
    sliding = {"variant": "sliding", "K_s": [9, 9, 9], "surface": "position", "L_t": [1, 1, 1]}
    slider = rbstab.load_config(FALLING | {"controller": FALLING["controller"] | sliding})
    at_zero = ((-1e-9, -1e-9, -1e-9), (1e-9, 1e-9, 1e-9))
    stiff = rbstab.load_config(leg([5, 5, 2.5], guard(method="stiff", stiffness=1, soft_angle=0.3)))
    at_guard = ((-1e-9, 0.3 - 1e-9, -1e-9), (1e-9, 0.3 + 1e-9, 1e-9))
    saddles = falling.model_copy(update={"states": falling.states[4:]})
    cases = [
        (falling.model_copy(update={"proved": False}), config, "not proved to be complete"),
        (changed(falling, 3, index_proved=False), config, "whether rest state 3 is stable"),
        (changed(falling, 9, degenerate=True, index_proved=False), config, "rest state 9"),
        (saddles, config, "no rest state in the range is proved to be stable"),
        (falling, without_damper(), "without elements of your own, no damper acts"),
        (falling, None, "config of the proof is needed"),
        (changed(falling, 9, enclosure=at_guard), stiff, "may begin to act just at"),
        (falling, stopped, "the force of limit jumps"),
        (falling, switching, "is an element of your own with switches"),
        (falling, rbstab.load_config(leg([5, 5, 2.5], damped)), "the force of line jumps, or is"),
        (falling, slider, "jumps, or is not shown to be smooth"),
    ]
    for proof, given, words in cases:
        proof_of_given = proof.of(given) if given else Proof.model_validate(proof.model_dump())
        almost = almost_every_start(proof_of_given)
        assert not almost.proved
        assert words in almost.why
    assert almost_every_start(changed(falling, 9, enclosure=at_zero).of(stiff)).proved


@pytest.mark.heavy
def test_barriers_confine_every_start():
    def sentence(**of):
        proof = prove(leg([5, 5, 2.5], guard(method="barrier", stiffness=0.01, **of)))
        return almost_sentence(proof, proof.almost_every_start)

    assert "with |θ2| < 90°, to which a barrier confines every motion, converges" in sentence()
    of_range = sentence(outer_stiffness=0.01)
    assert "in the range, to which barriers confine every motion, converges" in of_range


@pytest.mark.slow
def test_a_stored_proof_knows_its_config_again(falling):
    again = Proof.model_validate_json(falling.model_dump_json())
    assert not again.almost_every_start.proved
    assert again.of(rbstab.load_config(FALLING)).almost_every_start.proved
