"""Rest states that the Euler angles show twice, or where there are none, and families of them.

An attitude spring K without a weight: U at a half turn about an axis is the sum of the two other
entries of K. Where two entries are equal, half turns about all axes between are at rest. Of such a
body nothing is said of a range.
"""

import numpy as np
import pytest
from support.leg import BODY
from support.rotations import attitude, config_of, held, tie

import rbstab
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.experiment.convergence.with_proof import with_later_proof
from rbstab.experiment.proof import prove
from rbstab.experiment.stability import stability_of, statements_of
from rbstab.experiment.stored_proof.starts import number_of, start_state
from rbstab.experiment.verification.verify import verify

HALF_TURNS = config_of({"tie": tie([0, 0, 0]), "up": attitude([1, 1.2, 1.5])})

EQUAL = config_of({"tie": tie([0, 0, 0]), "up": attitude([1, 1, 1])})

SLANTED = attitude([1, 1, 1]) | {"K": [[3, 0, 1], [0, 1.5, 0], [1, 0, 3]]}

AT_POLES = config_of({"tie": tie([0, 0, 0]), "up": SLANTED})
"""Half turns about (1, 0, ±1) rest, where θ2 = ±90°."""


def from_angle(config, angle):
    return rbstab.load_config({**config, "initial": {"orientation": [0, 0, angle]}})


def test_the_sentences_have_no_words_about_a_range():
    proof = prove(HALF_TURNS)
    first, almost, *others = statements_of(proof)
    assert first.startswith("Rest states: 4 rest states on SO(3): 1 stable, 3 unstable; proved")
    assert almost.startswith("Almost every start: proved. Returns: almost every start (all but a")
    assert not any("range" in text or "θ1" in text for text in (first, almost, *others))
    assert " 2.19" in " ".join(others)


@pytest.mark.parametrize("config", [HALF_TURNS, EQUAL], ids=["four", "family"])
def test_a_run_says_that_almost_every_start_returns(config):
    config = from_angle(config, 0.5)
    result, proof = rbstab.simulate(config), prove(config)
    answer = answer_of(with_later_proof(result, config, proof), config, proof)
    assert answer.whole_range.word == "almost every start returns: proved"
    assert "range" not in answer.whole_range.sentence
    assert "the exceptions are" in answer.whole_range.sentence
    assert answer.this_start.sureness == "proved"
    assert answer.pushes is not None


def test_starts_below_the_least_energy_of_another_state_are_proved():
    # U = (1 + 1.2)(1 - cos θ3)/2, so half of 2.2 J at 90°, and 2.19 J at 170°.
    for angle, reached in ((1.5, 1), (2.97, 1), (3.14159, 1)):
        config = from_angle(HALF_TURNS, angle)
        proof = prove(config)
        assert start_state(rbstab.config.build.problem_of(config), proof) == reached
    fast = {"orientation": [0, 0, 3.0], "angular_velocity": [0, 0, 5]}
    config = rbstab.load_config({**HALF_TURNS, "initial": fast})
    assert start_state(rbstab.config.build.problem_of(config), prove(config)) is None


def test_states_at_the_poles_of_the_angles_are_listed_once():
    proof = prove(AT_POLES)
    # K has the eigenvalues 4, 2 and 1.5: half turns have the sums of two of them.
    assert [state.energy for state in proof.states] == pytest.approx([0, 3.5, 5.5, 6])
    pitches = [abs(state.orientation[1]) for state in proof.states]
    assert pitches == pytest.approx([0, np.pi / 2, np.pi / 2, 0], abs=1e-9)
    assert proof.almost_every_start.proved
    stability = stability_of(rbstab.config.build.problem_of(rbstab.load_config(AT_POLES)), proof)
    assert [linear is None for linear in stability.linearisations] == [False, True, True, False]
    for linear, state in zip(stability.linearisations, proof.states, strict=True):
        if linear is not None:
            assert sum(linear.eigenvalues.real > 1e-9) == state.index
    # The half turn about (1, 0, 1), with the eigenvalue 4, has U = 2 + 1.5 = 3.5 J.
    assert number_of(proof, np.array([np.pi / 2, np.pi / 2, np.pi / 2])) == 2


def test_no_separate_program_checks_it_yet():
    verification = verify(prove(HALF_TURNS))
    assert not verification.verified
    assert verification.outcome.startswith("not decided: there is no checker")


@pytest.mark.parametrize(
    ("K", "energies", "indices", "families"),
    [
        ([1, 1.2, 1.5], [0, 2.2, 2.5, 2.7], [0, 1, 2, 3], []),
        ([1, 1, 1.5], [0, 2], [0, 1], [(2.5, 2, 1)]),
        ([1, 1, 1], [0], [0], [(2, 1, 2)]),
    ],
)
def test_each_half_turn_is_one_rest_state_and_a_family_is_none(K, energies, indices, families):
    proof = prove(config_of({"tie": tie([0, 0, 0]), "up": attitude(K)}))
    assert [state.index for state in proof.states] == indices
    assert [state.energy for state in proof.states] == pytest.approx(energies, abs=1e-9)
    listed = [
        (continuum.energy, continuum.index, continuum.dimension) for continuum in proof.families
    ]
    assert listed == [pytest.approx(family) for family in families]
    # At θ2 = ±π/2 is no rest state, though ∂U/∂Θ is zero at (±π/2, ±π/2, ±π/2).
    assert max(abs(state.orientation[1]) for state in proof.states) < 1e-6
    assert ("a continuum (a family)" in proof.outcome) == bool(families)
    assert ("a family" in " ".join(statements_of(proof))) == bool(families)
    assert proof.proved == (not families)
    assert proof.examined == 0
    almost = proof.almost_every_start
    assert (almost.proved, almost.returns, almost.states) == (True, True, (1,))
    # Below the next energy every motion returns.
    assert proof.region is not None
    least = min([*energies[1:], *(energy for energy, _, _ in families)])
    assert proof.region.lower_bound == pytest.approx(least, abs=1e-9)
    assert proof.region.lower_bound < least + 1e-15


def test_an_unstable_family_is_called_unstable():
    """Half turns of a spring (1, 1, 1) are its highest poses."""
    sentences = " ".join(statements_of(prove(EQUAL)))
    assert "the body can also rest at an unstable surface of rest states at 2 J" in sentences


def test_a_family_is_no_other_rest_state_where_no_state_is_isolated():
    """A pendulum without a spring hangs at any θ3."""
    weight = {"gravity": [0, 0, -9.81], "body": BODY | {"contact_point": [0, 0, 0.186]}}
    sentences = " ".join(statements_of(prove(held({}, {"L_r": [1, 1, 1]}) | weight)))
    assert "the body can rest at a curve of rest states at 0 J (index 0)" in sentences


@pytest.mark.heavy
def test_a_degenerate_rest_state_is_neither_stable_nor_unstable():
    """K_r + K_t l² = m g l about the first axis: there the leg is about to fall over."""
    m, g, h, K_t = 3.5, 9.81, 0.186, 1e-6
    config = {
        "schema_version": 2,
        "body": BODY,
        "gravity": [0, 0, -g],
        "controller": {
            "variant": "permanent",
            "K_t": [K_t] * 3,
            "L_t": [1e-6] * 3,
            "K_r": [6.386309965404, 7, 5],
            "L_r": [0.8, 0.8, 0.3],
        },
        "integration": {"duration": 1},
    }
    assert m * g * h - K_t * h**2 == pytest.approx(6.386309965404, abs=1e-12)
    proof = prove(rbstab.load_config(config))
    (upright,) = proof.states
    assert np.abs(upright.orientation).max() < 1e-4
    assert (upright.stable, proof.stable_count, proof.proved) == (None, 0, False)
    assert "1 rest state found: 1 not known to be stable" in statements_of(proof)[0]
    assert not proof.almost_every_start.proved
