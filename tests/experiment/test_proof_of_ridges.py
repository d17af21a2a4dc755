"""Protects proofs with forces of users that jump and push away: against plain bodies, searches."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from support.ridges import LETS_GO, OUTWARDS
from support.switching_cords import CORD, REPELLING
from support.user_code import loaded_with, mine

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stability import kind_of
from rbstab.experiment.verification.verify import verify

BARRIER = {"kind": "guard", "method": "barrier", "stiffness": 20.0}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "outwards.py").write_text(OUTWARDS)
    (tmp_path / "lets_go.py").write_text(LETS_GO)
    return tmp_path


def outwards(k=30.0, soft=0.3):
    return mine(k=k, soft=soft) | {"file": "outwards.py"}


def lets_go(k=40.0, reach=0.2):
    return mine(k=k, reach=reach) | {"file": "lets_go.py"}


def plain_energy():
    """Return the energy of the same held body without any element."""
    at_rest = configurations(problem_of(loaded_with({})).system)
    return lambda Theta: float(at_rest.energy(np.asarray(Theta)))


@pytest.mark.parametrize("variant", ["permanent", "visco-elastic"])
def test_the_inside_is_that_of_the_plain_body(variant):
    """Where nothing acts, the rest state is the same; the ridges bound its region."""
    plain = prove(loaded_with({}, variant))
    proof = prove(loaded_with({"one": outwards()}, variant))
    assert proof.proved
    lowest, *passes = proof.states
    np.testing.assert_allclose(lowest.orientation, plain.states[0].orientation, atol=1e-9)
    assert (lowest.index, lowest.held, lowest.ridge) == (0, None, None)
    assert len(passes) == 2
    for state in passes:
        assert (state.index, state.index_proved) == (1, True)
        assert (state.held, state.ridge) == (True, True)
        assert kind_of(state) == "unstable, index 1, on a ridge"
    (region,) = proof.regions
    heights = [state.energy - lowest.energy for state in passes]
    assert region.lower_bound == pytest.approx(min(heights), rel=1e-6)
    assert not proof.unique


def test_the_passes_are_the_least_energies_on_the_ridges():
    """On θ2 = ±0.3, of the plain body, found by a search over θ1 and θ3."""
    energy = plain_energy()
    proof = prove(loaded_with({"one": outwards()}))
    passes = {np.sign(one.orientation[1]): one for one in proof.states if one.ridge}
    for sign, state in passes.items():
        pitch = sign * 0.3
        found = minimize(lambda x, pitch=pitch: energy([x[0], pitch, x[1]]), [0, 0], tol=1e-12)
        expected = [found.x[0], pitch, found.x[1]]
        np.testing.assert_allclose(state.orientation, expected, atol=1e-5)
        assert state.energy == pytest.approx(found.fun, abs=1e-9)
        step = 1e-6 * np.array([0, 1, 0])
        slope = (energy(expected + step) - energy(expected - step)) / 2e-6
        assert 0 < sign * slope < 30.0


def test_wells_on_both_sides_of_the_ridges_have_their_regions(folder):
    """A barrier stops the fall outside: three wells, which searches find too, and two passes."""
    config = loaded_with({"range": BARRIER, "one": outwards()})
    proof = prove(config)
    assert proof.proved
    wells = [np.array(one.orientation) for one in proof.states if one.index == 0]
    passes = [one for one in proof.states if one.ridge]
    assert (len(wells), len(passes), len(proof.states)) == (3, 2, 5)
    energy = plain_energy()

    def whole(Theta):
        push = 30.0 * max(abs(Theta[1]) - 0.3, 0.0)
        return energy(Theta) + 10.0 * np.tan(Theta[1]) ** 2 - push

    for pitch in (-0.8, 0.0, 0.8):
        limits = [(-3, 3), sorted([np.sign(pitch) * 0.31, pitch * 1.5]), (-3, 3)]
        limits[1] = (-0.29, 0.29) if pitch == 0 else limits[1]
        end = minimize(whole, [0, pitch, 0], bounds=limits, method="L-BFGS-B", tol=1e-14).x
        assert min(np.abs(end - one).max() for one in wells) < 1e-4
    low = {region.rest_state for region in proof.regions}
    assert low == {k for k, one in enumerate(proof.states, start=1) if one.index == 0}
    # Which well is beyond a pass is not proved, so the lower pass bounds all regions.
    for region in proof.regions:
        height = min(one.energy for one in passes) - proof.states[region.rest_state - 1].energy
        assert region.lower_bound == pytest.approx(height, rel=1e-6)


@pytest.mark.parametrize(("shift", "stays"), [(-2e-3, True), (2e-3, False)])
def test_a_motion_below_the_lower_pass_stays_and_one_beyond_it_leaves(shift, stays):
    """From rest just inside and just outside of the ridge: the force of the code decides."""
    proof = prove(loaded_with({"one": outwards()}))
    lowest, state, _ = proof.states
    side = np.sign(state.orientation[1])
    start = np.array(state.orientation) + side * np.array([0, shift, 0])
    (region,) = proof.regions
    assert region.energy_bound == pytest.approx(state.energy, rel=1e-9)
    assert plain_energy()(start) - 30.0 * max(shift, 0.0) < region.energy_bound
    initial = {"orientation": start.tolist(), "angular_velocity": [0, 0, 0]}
    Theta = np.asarray(simulate(loaded_with({"one": outwards()}, initial=initial))["orientation"])
    if stays:
        assert np.abs(Theta[:, 1]).max() < 0.3
        np.testing.assert_allclose(Theta[-1], lowest.orientation, atol=0.05)
    else:
        assert side * Theta[-1, 1] > 0.5


def test_a_spring_that_lets_go_has_the_rest_states_of_its_two_parts():
    """Inside it is a spring, outside nothing: each well is that of a body with either of them."""
    config = loaded_with({"one": lets_go()})
    proof = prove(config)
    assert proof.proved
    found = verify(proof.model_copy(update={"unwrapped": None}), config)
    assert found.verified, [one.text for one in found.findings if not one.verified]
    assert all(one.ridge for one in proof.states if one.held)
    energy = plain_energy()
    at_rest = configurations(problem_of(config).system)
    for state in proof.states:
        x = at_rest.motion(np.array(state.orientation)).A[0, 2]
        assert (abs(abs(x) - 0.2) < 1e-9) == bool(state.ridge)

    def whole(Theta, inside):
        x = at_rest.motion(np.asarray(Theta)).A[0, 2]
        return energy(Theta) + (20.0 * x * x if inside else 20.0 * 0.04)

    wells = [np.array(one.orientation) for one in proof.states if one.index == 0]
    reached = set()
    for inside in (True, False):
        for start in np.random.default_rng(4).uniform(-1, 1, (20, 3)):
            end = minimize(whole, start, args=(inside,), tol=1e-12).x
            x = at_rest.motion(end).A[0, 2]
            if np.all(np.abs(end) < [np.pi, np.pi / 2, np.pi]) and (abs(x) < 0.2) == inside:
                distances = [np.abs(end - one).max() for one in wells]
                assert min(distances) < 1e-3
                reached.add(int(np.argmin(distances)))
    assert reached == set(range(len(wells)))


@pytest.mark.heavy
def test_beside_own_states_of_the_same_element(folder):
    """The energy of the cord is not quadratic in its own state."""
    text = CORD
    for old, new in REPELLING.items():
        assert text.count(old) == 1
        text = text.replace(old, new.replace("self.k", "(-self.k)"))
    (folder / "mine.py").write_text(text)
    values: dict[str, Any] = {"point": [0.1, 0.2, -0.1], "k": 30.0, "soft": 0.3}
    config = loaded_with({"one": mine(**values)})
    proof = prove(config)
    assert proof.proved
    assert sum(bool(one.ridge) for one in proof.states) == 2
    # One of the two ranges: a flood takes a minute.
    found = verify(proof.model_copy(update={"unwrapped": None}))
    assert found.verified, [one.text for one in found.findings if not one.verified]
