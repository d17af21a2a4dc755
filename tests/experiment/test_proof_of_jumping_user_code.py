"""Protects proofs with elements of users whose force jumps: against our guards, and searches."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from support.proofs import rest_states, stored_energies
from support.user_code import element_text, loaded_with, mine

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of, system_of
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.proof.passive.passive import why_not_in_proofs
from rbstab.proof.passive.switches import NOT_CONTINUOUS, SIGN_UNKNOWN

GUARD = element_text(
    """
    mode_count = 2

    def guards(self, motion, own):
        pitch = motion.Theta[1]
        return np.array([pitch - self.soft, -pitch - self.soft])

    def wrench(self, motion, own):
        return couple_on_body(-self.k * (self.mode[0] - self.mode[1]) * motion.B[1])

    def stored(self, motion, own):
        above, below = self.guards(motion, own)
        return self.k * (self.mode[0] * above + self.mode[1] * below)
    """,
    'Gain("k", "N m", "couple", shape="number"), Gain("soft", "rad", "soft angle", shape="number")',
)
"""What `kind: guard` with `method: repelling` is."""

WEIGHT = element_text(
    """
    mode_count = 1

    def guards(self, motion, own):
        return np.array([line(motion, self.point, self.anchor).length - self.length])

    def wrench(self, motion, own):
        along = line(motion, self.point, self.anchor)
        return force_at(motion, self.point, -self.mode[0] * self.k * along.direction)

    def stored(self, motion, own):
        along = line(motion, self.point, self.anchor)
        return self.mode[0] * self.k * (along.length - self.length)
    """,
    'POINT, ANCHOR, Gain("k", "N", "weight", shape="number"), '
    'Gain("length", "m", "length", shape="number")',
)
"""A weight on the ground that a rope lifts where it is longer than ℓ₀."""

VALUES: dict[str, Any] = {
    "point": [0.1, 0.2, -0.1],
    "anchor": [0.3, 0.3, 1.1],
    "k": 3.0,
    "length": 1.48,
}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "guard.py").write_text(GUARD)
    (tmp_path / "weight.py").write_text(WEIGHT)
    return tmp_path


def guard(k=30.0, soft=0.02):
    return mine(k=k, soft=soft) | {"file": "guard.py"}


def weight(**changes):
    return mine(**VALUES | changes) | {"file": "weight.py"}


@pytest.mark.parametrize("variant", ["permanent", "visco-elastic"])
@pytest.mark.parametrize(("soft", "held"), [(0.02, True), (0.3, False)])
def test_a_repelling_guard_of_users_has_the_rest_states_of_ours(variant, soft, held):
    """For the smaller angle, the guard holds the body."""
    theirs = prove(loaded_with({"one": guard(soft=soft)}, variant))
    ours = {"kind": "guard", "method": "repelling", "couple": 30.0, "soft_angle": soft}
    expected = prove(loaded_with({"one": ours}, variant))
    assert theirs.proved
    assert [bool(state.held) for state in theirs.states] == [held]
    for one, other in zip(theirs.states, expected.states, strict=True):
        np.testing.assert_allclose(one.orientation, other.orientation, atol=1e-9)
        assert one.energy == pytest.approx(other.energy, abs=1e-9)
        assert (one.index, one.index_proved, one.held) == (other.index, True, other.held)
    assert theirs.region is not None
    assert expected.region is not None
    assert theirs.region.lower_bound == pytest.approx(expected.region.lower_bound, rel=1e-6)
    assert theirs.closed == expected.closed


def test_beside_a_barrier_every_start_is_proved_as_with_our_guard():
    barrier = {"kind": "guard", "method": "barrier", "stiffness": 1.0}
    ours = {"kind": "guard", "method": "repelling", "couple": 30.0, "soft_angle": 0.02}
    both = [prove(loaded_with({"range": barrier, "one": one})) for one in (guard(), ours)]
    assert both[0].unwrapped is not None
    assert both[1].unwrapped is not None
    assert both[0].unwrapped.every_start is both[1].unwrapped.every_start is True


def longer_of(at_rest, *, point, anchor, length, **_):
    """Return how much a line of a body is longer than a length, as a function of Θ."""

    def longer(Theta):
        motion = at_rest.motion(Theta)
        at = motion.X + motion.A @ np.array(point)
        return np.sqrt(np.sum((at - np.array(anchor)) ** 2)) - length

    return longer


def smoothed(at_rest, *, k, **ends):
    """Return the energy with a weight, made smooth over a width, m."""
    longer = longer_of(at_rest, **ends)

    def smooth(Theta, width):
        h = longer(Theta)
        return float(at_rest.energy(Theta)) + 0.5 * k * (h + np.hypot(h, width))

    return smooth


def test_the_weight_holds_the_body_where_a_search_finds_it():
    """A search in a smooth energy near that of the code, and the forces of the code."""
    config = loaded_with({"one": weight()})
    proof = prove(config)
    assert proof.proved
    (state,) = proof.states
    assert (state.held, state.index, state.index_proved) == (True, 0, True)
    (point,) = rest_states(problem_of(config).system, partial(system_of, config)).states
    assert point.state.is_at_rest
    assert point.state.on_kink
    at_rest = configurations(problem_of(loaded_with({})).system)
    longer, smooth = longer_of(at_rest, **VALUES), smoothed(at_rest, **VALUES)
    Theta = np.zeros(3)
    for width in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7):
        Theta = minimize(smooth, Theta, args=(width,), tol=1e-12).x
    np.testing.assert_allclose(state.orientation, Theta, atol=1e-3)
    exact = np.array(state.orientation)
    assert abs(longer(exact)) < 1e-9
    step = 1e-6 * np.eye(3)
    normal = np.array([(longer(exact + one) - longer(exact - one)) / 2e-6 for one in step])
    force = at_rest.gradient(exact)
    share = -force @ normal / (normal @ normal)
    np.testing.assert_allclose(force + share * normal, 0, atol=1e-6)
    assert 0 < share < VALUES["k"]


def mast(elements):
    """Return the config of a mast that falls to any side."""
    return loaded_with(
        elements,
        body={"mass": 2, "inertia": [0.06, 0.05, 0.03], "contact_point": [0, 0, -0.25]},
        gravity=[0, 0, -9.81],
        controller={
            "variant": "permanent",
            "K_t": [2, 2, 2],
            "L_t": [2, 2, 2],
            "K_r": [4, 4, 3],
            "L_r": [0.3, 0.3, 0.2],
        },
    )


@pytest.mark.heavy
def test_all_rest_states_are_those_of_many_searches():
    """Of a mast that falls to any side, and leans on its rope: minima and passes."""
    falling = {"point": [0, 0, 0.25], "anchor": [-0.8, 0.3, 0.1], "k": 10.0, "length": 0.9}
    config = mast({"one": weight(**falling)})
    proof = prove(config)
    assert proof.proved
    minima = [np.array(state.orientation) for state in proof.states if state.index == 0]
    assert sum(bool(state.held) for state in proof.states) >= 1
    smooth = smoothed(configurations(problem_of(mast({})).system), **falling)
    random = np.random.default_rng(3)
    ends = []
    for start in random.uniform([-3, -1.5, -3], [3, 1.5, 3], (60, 3)):
        end = start
        for width in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5):
            end = minimize(smooth, end, args=(width,)).x
        ends.append(end)
    inside = [end for end in ends if np.all(np.abs(end) < [np.pi, np.pi / 2, np.pi])]
    assert len(inside) > 20
    reached = set()
    for end in inside:
        distances = [np.abs(end - one).max() for one in minima]
        assert min(distances) < 1e-3
        reached.add(int(np.argmin(distances)))
    assert reached == set(range(len(minima)))
    points = random.uniform([-3, -1.5, -3], [3, 1.5, 3], (200, 3))
    at_rest = configurations(problem_of(config).system)
    theirs = [float(at_rest.energy(q)) for q in points]
    np.testing.assert_allclose(stored_energies(proof, points), theirs, atol=1e-9)


def why_not(folder, text, parameters, variant="permanent"):
    (folder / "mine.py").write_text(text)
    config = loaded_with({"one": mine(**parameters)}, variant)
    why = why_not_in_proofs(problem_of(config).system)
    assert why is not None
    return why


TURNING = element_text(
    """
    mode_count = 1

    def guards(self, motion, own):
        return np.array([motion.A[0, 2] - self.soft])

    def stored(self, motion, own):
        return self.mode[0] * self.k * motion.A[0, 1] * (motion.A[0, 2] - self.soft)

    def wrench(self, motion, own):
        row, g = motion.A[0], motion.A[0, 2] - self.soft
        by_second = np.array([row[2], 0.0, -row[0]])
        by_third = np.array([-row[1], row[0], 0.0])
        couple = row[1] * by_third + g * by_second
        return couple_on_body(-self.mode[0] * self.k * couple)
    """,
    'Gain("k", "N m", "couple", shape="number"), Gain("soft", "1", "place", shape="number")',
)
"""The energy k a b where b is positive, with entries a and b + soft of the rotation matrix."""


def test_what_is_not_shown(folder):
    """An energy that jumps, and a force that pulls back in one place and pushes away in another."""
    guard_values = {"k": 30.0, "soft": 0.3}
    jumps = GUARD.replace("self.k * (self.mode[0] * above", "self.k * (self.mode[0] * (above + 1)")
    assert NOT_CONTINUOUS in why_not(folder, jumps, guard_values)
    assert SIGN_UNKNOWN in why_not(folder, TURNING, {"k": 0.3, "soft": 0.3})


def test_of_a_body_that_is_not_held_a_force_that_jumps_is_searched_beside_springs():
    spring: dict[str, Any] = {"kind": "spring", "point": [0.1, 0.2, 0.3], "anchor": [0.5, 0.6, 0.7]}
    spring |= {"stiffness": 20.0, "rest_length": 0.1}
    proof = prove(loaded_with({"one": guard(), "spring": spring}, "visco-elastic"))
    assert not proof.proved
    assert "its force jumps" in proof.outcome


DETENT = element_text(
    """
    mode_count = 2
    kinked = True

    def guards(self, motion, own):
        turn = motion.A[0, 2] - self.k
        return np.array([turn, -turn])

    def wrench(self, motion, own):
        row = motion.A[0]
        push = 2.0 * self.mode[0] - 3.0 * self.mode[1]
        return couple_on_body(-push * np.array([-row[1], row[0], 0.0]))

    def stored(self, motion, own):
        turn = motion.A[0, 2] - self.k
        return 2.0 * self.mode[0] * turn - 3.0 * self.mode[1] * turn
    """,
    'Gain("k", "1", "where it clicks", shape="number")',
)
"""The energy 2 x or -3 x on the two sides of x = 0: it clicks into place there."""


def test_a_detent_has_one_kink_and_holds_the_body(folder):
    (folder / "mine.py").write_text(DETENT)
    config = loaded_with({"one": mine(k=0.05)})
    proof = prove(config)
    assert proof.proved
    (state,) = proof.states
    assert state.held
    at_rest = configurations(problem_of(config).system)
    Theta = np.random.default_rng(2).uniform(-1.4, 1.4, (200, 3))
    ours = stored_energies(proof, Theta)
    np.testing.assert_allclose(ours, [float(at_rest.energy(q)) for q in Theta], atol=1e-9)
    motion = at_rest.motion(np.array(state.orientation))
    assert float(motion.A[0, 2]) == pytest.approx(0.05, abs=1e-12)


@pytest.mark.parametrize("declared", [False, True])
def test_a_run_tells_of_a_class_that_does_not_declare_its_kinks(folder, declared):
    """Declared, the search finds the state that is held: v is never below zero."""
    text = WEIGHT.replace("mode_count = 1", "mode_count = 1\n    kinked = True")
    (folder / "weight.py").write_text(text if declared else WEIGHT)
    result = simulate(loaded_with({"one": weight()}))
    assert ("`kinked = True`" in str(result.attributes["warnings"])) is not declared
    if declared:
        assert np.all(np.asarray(result["lyapunov"]) >= -1e-12)


def test_of_a_body_that_is_not_held_a_search_finds_where_it_is_held_at_a_switch(folder):
    text = WEIGHT.replace("mode_count = 1", "mode_count = 1\n    kinked = True")
    (folder / "weight.py").write_text(text)
    proof = prove(loaded_with({"one": weight()}, "visco-elastic"))
    assert not proof.proved
    (state,) = proof.states
    assert state.held
    assert not state.proved
