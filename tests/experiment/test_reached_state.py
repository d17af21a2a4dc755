"""A motion is said to converge to a rest state only if its energy and its angles prove it."""

from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import pytest
from support.config_elements import config_data
from support.proofs import stored_energies
from support.valleys import TWO_VALLEYS

import rbstab
from rbstab.analysis.exact import in_balls
from rbstab.config.build import problem_of
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.experiment.proof import prove
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import (
    enclosed_start,
    reached_state,
    start_state,
)


def two_valleys(**initial):
    return rbstab.load_config(TWO_VALLEYS | {"initial": initial})


@pytest.fixture(scope="module")
def proof():
    return prove(two_valleys())


def kinds(proof):
    return [state.index for state in proof.states]


def test_each_valley_has_its_region(proof):
    assert kinds(proof)[:2] == [0, 0]
    assert [region.rest_state for region in proof.regions] == [1, 2]
    deep, shallow = proof.regions
    assert proof.states[shallow.pass_state - 1].index == 1
    assert shallow.energy_bound > proof.region.energy_bound
    (top,) = {proof.states[region.pass_state - 1].energy for region in (deep, shallow)}
    for region in proof.regions:
        assert top - 2e-6 * region.level < region.energy_bound <= top
        energy = proof.states[region.rest_state - 1].energy
        assert region.lower_bound == pytest.approx(region.energy_bound - energy, abs=1e-9)


def test_valley_decides(proof):
    """The energy is below the pass; the angles decide on which side of it."""
    energy = proof.regions[1].energy_bound - 1e-3
    assert energy > proof.region.energy_bound
    for number in (1, 2):
        Theta = np.array(proof.states[number - 1].orientation)
        assert reached_state(proof, energy, Theta - 1e-9, Theta + 1e-9) == number
        # Part of the way to the pass is still in the valley.
        top = np.array(proof.states[proof.regions[1].pass_state - 1].orientation)
        nearer = Theta + 0.6 * (top - Theta)
        assert reached_state(proof, energy, nearer, nearer) == number
        assert reached_state(proof, energy, nearer - 0.05, nearer + 0.05) == number
        # A box over both sides of the pass is not in one valley.
        low, high = np.minimum(Theta, top) - 0.3, np.maximum(Theta, top) + 0.3
        assert reached_state(proof, energy, low, high) is None


def test_energy_at_the_pass_decides_nothing(proof):
    shallow = proof.regions[1]
    Theta = np.array(proof.states[1].orientation)
    assert reached_state(proof, shallow.energy_bound, Theta, Theta) is None
    assert reached_state(proof, float("nan"), Theta, Theta) is None
    assert reached_state(proof, np.nextafter(shallow.energy_bound, -np.inf), Theta, Theta) == 2


def test_below_the_second_valley_the_whole_range_leads_to_the_first(proof):
    energy = np.nextafter(proof.region.energy_bound, -np.inf)
    again = Proof.model_validate_json(proof.model_dump_json())
    assert again == proof
    end = np.array([np.pi, np.pi / 2, np.pi])
    assert reached_state(again, energy, -end, end) == 1
    assert reached_state(proof, energy, -end, np.nextafter(end, 9)) is None
    assert reached_state(proof, energy, np.nextafter(-end, -9), end) is None
    assert reached_state(proof, energy, end, -end) is None


def test_other_proofs_decide_nothing(proof):
    Theta = np.array(proof.states[0].orientation)
    energy = proof.states[0].energy + 1.0
    assert reached_state(proof, energy, Theta, Theta) == 1
    searched = prove(two_valleys(), search_only=True)
    assert searched.regions == ()
    assert reached_state(searched, energy, Theta, Theta) is None
    older = proof.model_copy(update={"reduced_energy": None})
    assert reached_state(older, energy, Theta, Theta) is None


@pytest.mark.parametrize("number", [1, 2])
def test_start_in_a_valley_converges_there(proof, number):
    """Just below the pass, at rest: proved, and seen in the run."""
    region = proof.regions[1]
    minimum = np.array(proof.states[number - 1].orientation)
    top = np.array(proof.states[region.pass_state - 1].orientation)
    shares = np.linspace(0, 1, 2000)[:, np.newaxis]
    way = top + shares * (minimum - top)
    Theta = way[np.flatnonzero(stored_energies(proof, way) < region.energy_bound - 1e-2)[0]]
    config = two_valleys(orientation=Theta.tolist())
    problem = problem_of(config)
    assert start_state(problem, proof) == number
    result = rbstab.simulate(config, proof=proof)
    assert result["orientation"][-1] == pytest.approx(minimum, abs=1e-3)
    words = (result.attributes["verdict"], result.attributes["convergence"])
    assert words == ("consistent", "proved")
    assert result.attributes["convergence_rest_state"] == number
    depth = proof.regions[number - 1].lower_bound
    assert result.attributes["convergence_bound"] == pytest.approx(depth, rel=1e-9)
    *others, this_start = stability_of(problem, proof).statements
    assert f"convergence to rest state {number} is proved." in this_start
    assert f"Region of rest state 2: {region.lower_bound:.6g} J deep" in " ".join(others)
    region_of_it = {1: "the certified region", 2: "the region of rest state 2"}[number]
    assert str(answer_of(result, proof=proof).this_start).endswith(f"inside {region_of_it}")


def test_a_push_over_the_pass_is_not_proved(proof):
    region, state = proof.regions[1], proof.states[1]
    for excess, number in ((-1e-6, 2), (1e-6, None)):
        # ½ (1 + 1) kg m² about the contact point.
        spin = np.sqrt(region.energy_bound - state.energy + excess)
        config = two_valleys(orientation=state.orientation, angular_velocity=[spin, 0, 0])
        assert start_state(problem_of(config), proof) == number


def test_start_is_enclosed_in_decimals():
    """0.1 and -0.7 are no doubles; the box of Θ has the decimals inside."""
    config = two_valleys(orientation=[0.1, -0.7, 0.3])
    exact = problem_of(config).exact
    assert exact is not None
    _, energy, low, high = in_balls(partial(enclosed_start, exact))
    for decimal, a, b in zip(("0.1", "-0.7", "0.3"), low, high, strict=True):
        assert Fraction(a) < Fraction(decimal) < Fraction(b)
        assert b - a < 1e-15
    problem = problem_of(config)
    seen = float(problem.system.observe(problem.start).energy.sum())
    assert 0 < energy - seen + 1e-12 < 1e-11


@pytest.mark.parametrize("place", [0.5, 1.0, 1.2, 1.4, 3.0])
def test_the_energy_at_a_start_has_that_of_a_ligament(place):
    """The ligament is slack, at its slack length, in its toe, at the end of it, and beyond.

    At a switch the balls do not tell in which mode it is; both have nearly the same energy.
    """
    along = np.array([0.6, 0.0, 0.8])
    band: dict[str, Any] = {"kind": "ligament", "stiffness": 100.0, "slack_length": 0.5}
    band |= {"toe_strain": 0.2, "point": [0, 0, 0], "anchor": (-0.5 * place * along).tolist()}
    data = config_data({"band": band}, gravity=[0.0, 0.0, 0.0])
    data["initial"] = {"velocity": [1.0, 0.0, 0.0]}
    build = problem_of(rbstab.load_config(data)).exact
    assert build is not None
    start = in_balls(partial(enclosed_start, build))
    strain = place - 1
    beyond = (strain - 0.2) ** 2 / 2 + 0.2**2 / 6
    toe = max(strain, 0) ** 3 / (12 * 0.2)
    exact = 0.5 * 41 + 0.5 * 100 * (toe if strain <= 0.4 else beyond)
    assert start.least <= exact * (1 + 1e-12)
    assert start.energy >= exact * (1 - 1e-12)
    assert start.energy - start.least < 1e-9


# The same body as a softer pendulum: its valleys are bounded by the half turn.
TURNING: dict[str, Any] = {**TWO_VALLEYS["controller"], "K_r": [30, 1000, 1000]}


@pytest.fixture(scope="module")
def turning():
    changes: dict[str, Any] = {"gravity": [0, 5, -100], "controller": TURNING}
    config = rbstab.load_config(TWO_VALLEYS | changes)
    return config, prove(config)


def test_unwrapped_angles_have_a_proof_of_their_own(turning):
    _, proof = turning
    wide = proof.unwrapped
    assert wide is not None
    assert wide.proved
    assert wide.end is not None
    assert wide.end[0] > np.pi
    # Pulled to +y, the body leans to the negative side of θ1 a little deeper.
    assert proof.states[0].orientation[0] < 0
    # Both have the same least energy.
    assert {region.pass_face for region in proof.regions} <= {"θ1 = -π", "θ1 = π"}
    # Without wrapping, the valleys end at the top between them.
    assert [region.pass_state for region in wide.regions] == [3, 3]
    for inner, outer in zip(proof.regions, wide.regions, strict=True):
        assert outer.energy_bound > inner.energy_bound + 1
        number = inner.rest_state
        Theta = np.array(proof.states[number - 1].orientation)
        # Only the unwrapped region reaches this energy, and these angles.
        energy = 0.5 * (inner.energy_bound + outer.energy_bound)
        assert reached_state(proof, energy, Theta, Theta) == number
        without = proof.model_copy(update={"unwrapped": None})
        assert reached_state(without, energy, Theta, Theta) is None
        beyond = np.array([np.sign(Theta[0]) * 3.2, 0.0, 0.0])
        assert reached_state(proof, outer.energy_bound - 1e-3, beyond, beyond) == number
        assert reached_state(without, outer.energy_bound - 1e-3, beyond, beyond) is None


def test_rest_state_beyond_the_range_has_no_number(turning):
    _, proof = turning
    assert proof.unwrapped is not None
    moved = proof.unwrapped.states[0].model_copy(update={"enclosure": ((4, 0, 0), (4.1, 0, 0))})
    wide = proof.unwrapped.model_copy(update={"states": (moved, *proof.unwrapped.states[1:])})
    other = proof.model_copy(update={"unwrapped": wide, "region": None, "regions": ()})
    energy, Theta = proof.states[0].energy + 1e-3, np.array(proof.states[0].orientation)
    assert reached_state(other, energy, Theta, Theta) is None
    alone = proof.model_copy(update={"region": None, "regions": ()})
    assert reached_state(alone, energy, Theta, Theta) == 1


def test_angles_beyond_the_unwrapped_range_decide_nothing(turning):
    _, proof = turning
    wide = proof.unwrapped
    assert wide is not None
    assert wide.region is not None
    assert wide.region.energy_bound is not None
    energy = wide.region.energy_bound - 1e-3
    assert wide.end is not None
    ends = np.array([wide.end[0], np.pi / 2, wide.end[2]])
    assert reached_state(proof, energy, -ends, ends) == 1
    for axis in range(3):
        beyond = ends.copy()
        beyond[axis] = np.nextafter(ends[axis], 99)
        assert reached_state(proof, energy, -ends, beyond) is None
        assert reached_state(proof, energy, -beyond, ends) is None
