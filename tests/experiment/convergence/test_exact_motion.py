"""What is proved of the exact motions of configs, and how it is stored with their runs."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.paper_runs import paper_config

import rbstab
from rbstab.config.build import problem_of
from rbstab.experiment.convergence import exact_motion
from rbstab.experiment.convergence.convergence import (
    Convergence,
    Enclose,
    convergence_attributes,
    stored_convergence,
)
from rbstab.experiment.convergence.decisions import refusal
from rbstab.experiment.convergence.enclosed_samples import computed_motion_check
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.proof import prove

CONFIGS = Path(__file__).parents[3] / "configs"

PAPER = ("case1_permanent", "case2_visco_elastic", "case3_embedded")


@cache
def held_proof():
    """Return the proof of the paper's held body, for all its starts."""
    return prove(rbstab.load_config(paper_config("permanent")))


def proved(config, enclose=Enclose.UNTIL_PROVED, proof=None):
    return prove_convergence(config, problem_of(config), proof or prove(config), enclose)


@pytest.mark.parametrize("name", PAPER)
def test_the_motions_of_the_paper_converge(name):
    config = rbstab.load_config(CONFIGS / "paper" / f"{name}.yaml")
    convergence, samples = proved(config)
    assert convergence.proved is True
    assert convergence.rest_state == 1
    low, high = convergence.energy
    assert low < high < low + 1e-5
    assert high < convergence.bound
    # A computed motion has such an energy at that time, and enters the region a step before.
    system, rest = problem_of(config).system, prove(config).states[0].energy
    path = solve_ivp(
        lambda _, y: system.rates(y),
        (0, convergence.time),
        problem_of(config).start,
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
        t_eval=[0.9 * convergence.time, convergence.time],
    )
    before, after = (system.observe(y).energy.sum() - rest for y in path.y.T)
    assert after == pytest.approx((low + high) / 2, abs=1e-6)
    assert after < convergence.bound < before
    assert samples.times[-1] <= convergence.time
    widths = [(samples.high[key] - samples.low[key]).max() for key in samples.low]
    assert max(widths) < 1e-7


@pytest.mark.parametrize("coordinates", ["manifold", "reduced"])
def test_a_held_body_is_followed_in_its_six_states(coordinates):
    config = rbstab.load_config(
        paper_config("permanent", duration=0.5, samples=11, coordinates=coordinates)
    )
    result = rbstab.simulate(config, proof=held_proof(), enclose=Enclose.TO_END)
    assert result.attributes["convergence"] == "proved"
    assert result["enclosure/time"].tolist() == result["time"].tolist()
    low, high = result["enclosure/orientation_low"], result["enclosure/orientation_high"]
    assert np.all(low <= result["orientation"] + 1e-9)
    assert np.all(result["orientation"] - 1e-9 <= high)
    assert "enclosure/position_low" not in result


def test_a_wrong_computed_motion_is_found():
    config = rbstab.load_config(paper_config("permanent", duration=0.05, samples=6))
    motion = proved(config, Enclose.TO_END, held_proof())
    result = rbstab.simulate(config)
    check = compared(motion.samples, result)
    assert check.verdict == "consistent"
    assert check.value < 1e-11
    variables = dict(result.variables)
    wrong = variables["angular_velocity"].data.copy()
    wrong[3, 1] *= 1 + 1e-6
    variables["angular_velocity"] = variables["angular_velocity"]._replace(data=wrong)
    check = compared(motion.samples, replace(result, variables=variables))
    assert check.verdict == "violated"
    assert check.when == result["time"][3]
    size = np.abs(result["angular_velocity"]).max()
    expected = 1e-6 * abs(result["angular_velocity"][3, 1]) / size
    assert check.value == pytest.approx(expected, rel=1e-3)
    wrong = wrong.copy()
    wrong[2, 0] = np.nan
    variables["angular_velocity"] = variables["angular_velocity"]._replace(data=wrong)
    assert compared(motion.samples, replace(result, variables=variables)).verdict == "violated"


def compared(samples, result):
    return computed_motion_check(samples, result.variables, 1e-8)


def test_an_enclosure_that_ends_early_says_so(monkeypatch):
    """Convergence is proved; what was asked for beyond it is not."""
    monkeypatch.setattr(exact_motion, "MAX_STEPS", 40)
    config = rbstab.load_config(paper_config("permanent"))
    convergence, samples = proved(config, Enclose.TO_END, held_proof())
    assert (convergence.proved, convergence.steps) == (True, 40)
    assert convergence.why.startswith(
        "not enclosed to the end: 40 steps of the enclosure reach t = 0.8"
    )
    assert 0.3 < samples.times[-1] < 2.0


def test_a_motion_past_the_pole_is_not_decided_because_euler_angles_end():
    config = rbstab.load_config(
        Path(__file__).parents[2] / "data/cases/half_turns.yaml",
        [
            "integration.coordinates=quaternion",
            "initial.orientation=[0, 1.4, 0]",
            "initial.angular_velocity=[0, 60, 0]",
        ],
    )
    convergence, _ = proved(config)
    assert convergence.proved is None
    assert convergence.why.endswith(
        "where θ2 is near ±90° and the Euler angles of the enclosure end"
    )


def test_a_start_without_bounds_is_not_followed():
    near = rbstab.load_config(paper_config("permanent"))
    far = rbstab.load_config(paper_config("permanent"), ["initial.angular_velocity=[1e155, 0, 0]"])
    convergence, samples = prove_convergence(far, problem_of(far), prove(near))
    assert (convergence.proved, samples) == (None, None)
    assert convergence.why == "the numbers of the start are too large"


@pytest.mark.parametrize(("coordinates", "moves_on"), [("Z", True), ("quaternion", False)])
def test_that_no_rest_state_is_in_the_range_says_nothing_of_the_pole(coordinates, moves_on):
    config = rbstab.load_config(
        Path(__file__).parents[2] / "data/cases/half_turns.yaml",
        [f"integration.coordinates={coordinates}"],
    )
    proof: Any = SimpleNamespace(
        unwrapped=SimpleNamespace(proved=True, states=()),
        needs_lengths=False,
        proved=True,
        states=(),
    )
    refused = refusal(problem_of(config), proof)
    assert refused is not None
    assert (refused.proved is False) == moves_on
    assert ("no rest state with |θ2| < π/2" in refused.why) == moves_on


@pytest.mark.parametrize(
    "given",
    [
        Convergence(None, why="no proof"),
        Convergence(False, why="there is none"),
        Convergence(True, 2, 0.0, (1.0, 1.5), 2.0),
        Convergence(True, 1, 0.3, (1.0, 1.5), 2.0, "", 42, 1.25, Enclose.UNTIL_PROVED),
        Convergence(True, 1, 0.0, (1.0, 1.5), 2.0, why="not enclosed to the end: too slow"),
        Convergence(None, why="too slow", steps=3, seconds=0.5, enclosed=Enclose.TO_END),
    ],
)
def test_what_is_stored_is_read_again(given):
    again = stored_convergence(convergence_attributes(given))
    assert again is not None
    assert vars(again) == vars(given)
    assert again.sentence == given.sentence


def test_wrong_words():
    assert stored_convergence({"verdict": "certified"}) is None
    with pytest.raises(ValueError, match="convergence is 'perhaps'"):
        stored_convergence({"convergence": "perhaps"})


def test_the_sentence_says_what_is_proved():
    convergence = Convergence(True, 1, 0.36031, (915.68, 915.680002), 1020.4123, "", 42, 1.8)
    assert convergence.sentence == (
        "converges to rest state 1: proved; it is inside the certified region from t = 0.3604 s "
        "(v = 915.68 J < 1020.41 J, error ≤ 1e-06 J), 42 steps, 1.8 s"
    )
    short = replace(convergence, why="not enclosed to the end: too slow")
    assert short.sentence == f"{convergence.sentence}; not enclosed to the end: too slow"
    # An error is never rounded down.
    wider = replace(convergence, energy=(900.0, 901.96))
    assert "error ≤ 1 J" in wider.sentence
