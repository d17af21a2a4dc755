"""The answers of runs say what was proved or seen, and no more than that."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from support.leg import leg
from support.results import with_data

import rbstab
from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.experiment.answers.check_words import comparison, word_of_check
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.experiment.answers.words import MEANINGS, Sureness, run_words, word_of
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.convergence.with_proof import with_later_proof
from rbstab.experiment.proof import prove
from rbstab.experiment.run_certificate import LEAST_REST_STATES
from rbstab.experiment.summary import settling_time_of
from rbstab.store.result import WORDS_OF_VERDICTS

PERMANENT = {
    "schema_version": 1,
    "body": {"mass": 41, "inertia": [10.0, 9.0, 2.0], "contact_point": [0.15, 0.10, -0.42]},
    "controller": {
        "variant": "permanent",
        "K_t": [4100, 4100, 3280],
        "L_t": [200, 200, 140],
        "K_r": [400, 400, 320],
        "L_r": [60, 60, 42],
    },
    "initial": {"angular_velocity": [1, 2, -1]},
    "integration": {"duration": 2.0, "samples": 101},
}


def config_of(*changes):
    """Return the config of a held body with some changes."""
    return rbstab.load_config(PERMANENT, changes)


SOFT = "controller.K_r=[40, 40, 32]"
"""With a tenth of the stiffness of the paper the body has several rest states."""

FAST = "initial.angular_velocity=[16, 32, -16]"

FREE_TO_TURN: dict[str, Any] = {
    "schema_version": 2,
    "body": {"mass": 10.0, "inertia": [1.0, 1.0, 1.0], "contact_point": [0, 0, 0.5]},
    "gravity": [0, 0, 0],
    "elements": {
        "foot": {
            "kind": "visco-elastic",
            "point": [0, 0, 0],
            "anchor": [0, 0, 0],
            "K_c": [1000, 1000, 1000],
            "L_c": [150, 150, 150],
        }
    },
    "initial": {"position": [0.3, 0.1, 0]},
    "integration": {"duration": 5.0, "samples": 101},
}
"""A body that a damped spring holds at its centre of gravity: nothing damps a rotation."""


PROVED, SEEN, OPEN = Sureness.PROVED, Sureness.SEEN, Sureness.NOT_DECIDED
ONLY = "the exact motion converges to the only rest state in the range"


@pytest.mark.parametrize(
    ("data", "changes", "enclose", "sureness", "words"),
    [
        (PERMANENT, [], "proof", PROVED, f"{ONLY}: it starts inside the certified region"),
        # C is beside the centre of gravity and holds some weight, so the body rests turned.
        (PERMANENT, ["gravity=[0, 0, -9.81]"], "proof", PROVED, f"{ONLY}, Θ = (0."),
        (PERMANENT, [FAST], "proof", SEEN, "above the lowest rest state, not below c* = 1020"),
        (PERMANENT, [FAST], "enclosed", PROVED, "certified region from t = 0."),
        (PERMANENT, [], "", SEEN, "the computed motion is at rest from t = "),
        (PERMANENT, ["integration.duration=0.1"], "", OPEN, "it is not at rest by t = 0.1 s"),
        (PERMANENT, ["integration.step_limit=3"], "", OPEN, "step limit"),
        (
            PERMANENT,
            ["controller.variant=free", "initial.angular_velocity=[0, 32, 0]"],
            "",
            OPEN,
            "left the range of θ2 at t = ",
        ),
        # ½ 1 kg m² (0.2 rad/s)² = 0.02 J of the 50 J at the start stay for ever.
        (
            FREE_TO_TURN,
            ["initial.angular_velocity=[0, 0, 0.2]"],
            "",
            OPEN,
            "moves on without damping at t = 5 s",
        ),
        (FREE_TO_TURN, [], "", SEEN, "at rest from t"),
        (FREE_TO_TURN, ["initial.position=[0, 0, 0]"], "", SEEN, "starts at rest"),
    ],
)
def test_what_is_said_of_a_start(data, changes, enclose, sureness, words):
    config = rbstab.load_config(data, changes)
    proof = prove(config) if enclose else None
    how = Enclose.BRIEFLY if enclose == "enclosed" else Enclose.NOTHING
    result = rbstab.simulate(config, proof=proof, enclose=how)
    _, this_start, whole_range, *_ = answer_of(result, proof=proof)
    assert this_start.sureness is sureness
    assert words in this_start.sentence
    assert math.isnan(settling_time_of(result)) == (sureness is OPEN)
    if proof is not None:
        assert whole_range.sureness is PROVED
        assert "that stays in the range" in whole_range.sentence
    elif data is PERMANENT:
        assert "Not proved: " in this_start.sentence
        assert "rbstab run CONFIG --prove" in whole_range.sentence
        assert whole_range.sureness is OPEN


def test_what_more_steps_can_do_where_a_body_stands_upright_on_a_soft_spring():
    config = rbstab.load_config(leg(5.0, initial={}))
    result = rbstab.simulate(config, proof=prove(config), enclose=Enclose.BRIEFLY)
    sentence = answer_of(result, config).this_start.sentence
    assert sentence.endswith("so more steps help only if the motion leaves it")


def test_a_proof_that_came_after_the_run_is_used():
    config = config_of()
    result, proof = rbstab.simulate(config), prove(config)
    later = answer_of(with_later_proof(result, config, proof), config, proof)
    assert {answer.sureness for answer in later.answers.values()} == {Sureness.PROVED}
    assert later == answer_of(rbstab.simulate(config, proof=proof), config, proof)
    without = answer_of(with_later_proof(result, None, proof), None, proof)
    assert without.answers == answer_of(result, proof=proof).answers


def test_several_rest_states_leave_almost_every_start():
    config = config_of(SOFT)
    proof = prove(config)
    result = rbstab.simulate(config, proof=proof)
    whole_range = answer_of(result, proof=proof).whole_range
    assert (whole_range.sureness, whole_range.word) == (
        Sureness.PROVED,
        "almost every start returns: proved",
    )
    assert whole_range.sentence == (
        "returns: almost every start (all but a set of measure zero) whose motion stays in the "
        "range and away from θ2 = ±90° converges to rest state 1, the only stable one in the "
        "range, at the desired attitude; the exceptions are the 2 unstable rest states (2, 3) "
        "and starts that lead to them"
    )
    # Without the proof only their number and their kinds are known.
    assert str(answer_of(result).whole_range) == (
        "false: it has 3 rest states in the range: 1 stable, 2 unstable; almost every start "
        "converges"
    )
    # Without what acts on the body nothing is known of its unstable rest states.
    alone = type(proof).model_validate(proof.model_dump())
    whole_range = answer_of(result, proof=alone).whole_range
    assert whole_range.sureness is Sureness.FALSE
    assert whole_range.sentence.startswith(
        "the body can also rest at the unstable rest state 2, Θ = ("
    )


@pytest.mark.parametrize(("end", "says_so"), [(-0.02, True), (2.0, False)])
def test_a_v_that_ends_below_zero_is_explained(end, says_so):
    """The body of a sliding connector may rest beside the rest state from which v counts."""
    result = rbstab.simulate(config_of("integration.duration=0.1"))
    v = np.append(result["lyapunov"][:-1], end)
    sentence = answer_of(with_data(result, "lyapunov", v)).this_start.sentence
    assert f" to {end:.4g} J along the computed run" in sentence
    assert ("below that of the rest state from which v counts" in sentence) == says_so


def test_a_failed_check_of_the_computed_run_comes_first():
    result = rbstab.simulate(config_of())
    verdicts = result["certificate/verdict"].copy()
    verdicts[0] = str(Verdict.VIOLATED)
    variable = result.variables["certificate/verdict"]._replace(data=verdicts)
    broken = dataclasses.replace(
        result, variables=result.variables | {"certificate/verdict": variable}
    )
    _, this_start, *_ = answer_of(broken)
    assert this_start.sureness is Sureness.NOT_DECIDED
    assert "the check audit of the computed run failed" in this_start.sentence


def test_a_short_enclosure_says_that_it_was_short(monkeypatch):
    monkeypatch.setattr("rbstab.experiment.convergence.exact_motion.BRIEF_STEPS", 3)
    config = config_of(FAST)
    proof = prove(config)
    result = rbstab.simulate(config, proof=proof, enclose=Enclose.BRIEFLY)
    this_start = answer_of(result, proof=proof).this_start
    assert this_start.sureness is Sureness.SEEN
    assert "after 3 steps of the enclosure" in this_start.sentence
    assert "rbstab run CONFIG --prove takes up to 2000 steps" in this_start.sentence
    assert Enclose(int(result.attributes["convergence_enclosed"])) is Enclose.BRIEFLY
    assert not Enclose.BRIEFLY.covers(Enclose.UNTIL_PROVED)


def line(check, verdict, value, bound):
    return Check(check, verdict, value, bound, math.nan, "a number")


@pytest.mark.parametrize(
    ("given", "word", "text"),
    [
        (line("audit", "consistent", 1e-14, 1e-8), "seen", "1e-14 ≤ 1e-08"),
        (line("decrease", "driven", 0.03, math.inf), "-", "0.03"),
        (line("positive", "consistent", 0.18, -math.inf), "-", "0.18; v - ε has no lower bound"),
        (
            line("global stability", "violated", 9, 1)._replace(quantity=LEAST_REST_STATES),
            "false",
            "9 > 1",
        ),
        (line("audit", "violated", 1e-3, 1e-8), "false", "0.001 > 1e-08"),
        (line("global stability", "violated", 3, 1), "false", "3 ≠ 1"),
        (line("global stability", "unknown", np.nan, 1), "not decided", "nothing is proved"),
        # There may be others.
        (line("global stability", "unknown", 1, 1), "not decided", "1 found"),
        (
            line("certified region", "certified", 12.3, math.inf),
            "proved",
            "12.3; every start converges",
        ),
        (line("certified region", "unknown", 12.36, 4.935), "not decided", "12.36 ≥ 4.935"),
    ],
)
def test_checks_in_words(given, word, text):
    assert word_of_check(given) == word
    assert comparison(given) == text


def test_each_word_has_a_meaning_and_each_verdict_a_word():
    assert set(MEANINGS) == set(Sureness)
    words = {word_of(str(verdict)) for verdict in Verdict}
    assert words == {*map(str, Sureness)}
    # The words for verdicts are listed where files are read, which knows neither.
    assert set(WORDS_OF_VERDICTS) == {*map(str, Verdict)}
    assert run_words("driven").startswith("seen: elements supply power")
    assert run_words("consistent") == "seen"
    assert word_of("-") == "-"
