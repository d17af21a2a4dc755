"""Protects proofs with elements of users that switch: against our own guards, and searches."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from support.proofs import stored_energies
from support.user_code import SPRING, element_text, loaded_with, mine

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of
from rbstab.experiment.convergence.exact_motion import convergence_at_start
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.verification.verify import verify
from rbstab.proof.passive.passive import UNBALANCED, in_proofs, why_not_in_proofs
from rbstab.proof.passive.switches import NOT_CONTINUOUS, NOT_OF_ANGLES

GUARD = element_text(
    """
    mode_count = 2

    def _beyond(self, motion):
        pitch = motion.Theta[1]
        return np.array([pitch - self.soft, -pitch - self.soft])

    def guards(self, motion, own):
        return self._beyond(motion)

    def wrench(self, motion, own):
        above, below = self.mode * self._beyond(motion)
        return couple_on_body(-self.k * (above - below) * motion.B[1])

    def stored(self, motion, own):
        above, below = self._beyond(motion)
        return 0.5 * self.k * (self.mode[0] * above * above + self.mode[1] * power(below, 2))
    """,
    'Gain("k", "N m/rad", "stiffness", shape="number"), '
    'Gain("soft", "rad", "soft angle", shape="number")',
)
"""What `kind: guard` with `method: stiff` is."""

BAND = element_text(
    """
    mode_count = 1

    def _longer(self, motion):
        return line(motion, self.point, self.anchor).length - self.length

    def guards(self, motion, own):
        return np.array([self._longer(motion)])

    def wrench(self, motion, own):
        along = line(motion, self.point, self.anchor)
        pull = self.k * power(self._longer(motion), 2) + self.c * along.rate
        return force_at(motion, self.point, -self.mode[0] * pull * along.direction)

    def stored(self, motion, own):
        return self.mode[0] * self.k / 3 * power(self._longer(motion), 3)

    def dissipated(self, motion, own):
        rate = line(motion, self.point, self.anchor).rate
        return self.mode[0] * self.c * rate * rate
    """,
    'POINT, ANCHOR, Gain("k", "N/m^2", "stiffness", shape="number"), '
    'Gain("c", "N s/m", "damping", shape="number"), Gain("length", "m", "length", shape="number")',
)
"""A band whose tension grows with the square of its extension, damped while it is taut."""

VALUES: dict[str, Any] = {
    "point": [0.1, 0.2, -0.1],
    "anchor": [0.3, 0.3, 1.1],
    "k": 40.0,
    "c": 0.3,
    "length": 1.15,
}

SOFT = {"k": 30.0, "soft": 0.3}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "guard.py").write_text(GUARD)
    (tmp_path / "band.py").write_text(BAND)
    return tmp_path


def guard(**changes):
    return mine(**SOFT | changes) | {"file": "guard.py"}


def band(**changes):
    return mine(**VALUES | changes) | {"file": "band.py"}


@pytest.mark.parametrize("variant", ["permanent", "visco-elastic"])
@pytest.mark.parametrize("soft", [0.02, 0.3])
def test_a_stiff_guard_of_users_has_the_rest_states_of_ours(variant, soft):
    """For the smaller angle, the body rests against it."""
    theirs = prove(loaded_with({"one": guard(soft=soft)}, variant))
    ours = {"kind": "guard", "method": "stiff", "stiffness": 30.0, "soft_angle": soft}
    expected = prove(loaded_with({"one": ours}, variant))
    assert theirs.proved
    assert len(theirs.states) == len(expected.states)
    for one, other in zip(theirs.states, expected.states, strict=True):
        np.testing.assert_allclose(one.orientation, other.orientation, atol=1e-9)
        assert one.energy == pytest.approx(other.energy, abs=1e-9)
        assert one.index == other.index
    beyond = max(abs(state.orientation[1]) for state in theirs.states) > soft
    assert beyond is (soft == 0.02)
    assert theirs.region is not None
    assert expected.region is not None
    assert theirs.region.lower_bound == pytest.approx(expected.region.lower_bound, rel=0.05)


def test_a_proof_of_a_switching_element_is_verified():
    config = loaded_with({"one": guard(soft=0.02)})
    proof = prove(config)
    found = verify(proof, config)
    assert found.verified, [one.text for one in found.findings if not one.verified]


def test_the_energy_is_that_of_the_code_on_both_sides():
    """And it is the same at points where the band is slack, taut, and between."""
    config = loaded_with({"one": band()})
    at_rest = configurations(problem_of(config).system)
    place = [one.name for one in at_rest.system.elements].index("one")
    Theta = np.random.default_rng(5).uniform(-1.4, 1.4, (400, 3))
    theirs = np.array([at_rest.energies(q)[place] for q in Theta])
    others = np.array([at_rest.energies(q).sum() for q in Theta]) - theirs
    ours = stored_energies(prove(config), Theta)
    np.testing.assert_allclose(ours - others, theirs, atol=1e-12)
    assert 20 < np.sum(theirs > 0) < 380


def test_a_band_has_the_rest_state_of_a_search_and_its_start_is_proved():
    config = loaded_with({"one": band()})
    proof = prove(config)
    assert proof.proved
    at_rest = configurations(problem_of(config).system)
    expected = minimize(at_rest.energy, np.zeros(3), jac=at_rest.gradient, tol=1e-13)
    (state,) = proof.states
    np.testing.assert_allclose(state.orientation, expected.x, atol=1e-6)
    length = line_length(config, state.orientation)
    assert length > VALUES["length"] + 1e-3  # it is taut there
    found = convergence_at_start(config, problem_of(config), proof)
    assert (found.proved, found.rest_state) == (True, 1)
    end = np.asarray(simulate(config)["orientation"])[-1]
    assert np.abs(end - state.orientation).max() < 0.02
    points = np.random.default_rng(2).uniform(-1.4, 1.4, (200, 3))
    theirs = [float(at_rest.energy(q)) for q in points]
    np.testing.assert_allclose(stored_energies(proof, points), theirs, atol=1e-9)


def line_length(config, Theta):
    at_rest = configurations(problem_of(config).system)
    motion = at_rest.motion(np.array(Theta))
    at = motion.X + motion.A @ np.array(VALUES["point"])
    return float(np.linalg.norm(at - np.array(VALUES["anchor"])))


def why_not(folder, text, parameters, variant="permanent"):
    (folder / "mine.py").write_text(text)
    config = loaded_with({"one": mine(**parameters)}, variant)
    why = why_not_in_proofs(problem_of(config).system)
    assert why is not None
    return why


SQUARE = "self.mode[0] * above * above"

REFUSED = {
    "an energy that jumps": (GUARD.replace(SQUARE, f"{SQUARE} + self.mode[0]"), NOT_CONTINUOUS),
    "two modes at once": (
        GUARD.replace(SQUARE, f"{SQUARE} + 0.0 * above + self.mode[0] * self.mode[1]"),
        NOT_CONTINUOUS,
    ),
    "the square of another function": (
        GUARD.replace(
            "return self._beyond(motion)\n",
            "return self._beyond(motion) + np.array([0.1, 0.0])\n",
            1,
        ),
        NOT_CONTINUOUS,
    ),
    "an event function of a velocity": (
        GUARD.replace(
            "return self._beyond(motion)\n", "return self._beyond(motion) + motion.V[:2]\n", 1
        ),
        NOT_OF_ANGLES,
    ),
    "an event function by its mode": (
        GUARD.replace(
            "return self._beyond(motion)\n", "return self._beyond(motion) + self.mode\n", 1
        ),
        NOT_OF_ANGLES,
    ),
    "a mode inside a function": (
        GUARD.replace("import power", "import power, sqrt")
        .replace(SQUARE, "(sqrt(1.0 + self.mode[0]) - 1.0) * above * above")
        .replace(
            "self.mode * self._beyond(motion)",
            "self._beyond(motion) * [sqrt(1.0 + self.mode[0]) - 1.0, self.mode[1]]",
        ),
        NOT_CONTINUOUS,
    ),
    "a mode in a divisor": (
        GUARD.replace(SQUARE, "self.mode[0] * above * above / (2.0 - self.mode[0])"),
        NOT_CONTINUOUS,
    ),
    "modes in the square of a sum": (
        GUARD.replace(
            "0.5 * self.k * (self.mode[0] * above * above + self.mode[1] * power(below, 2))",
            "0.5 * self.k * power(self.mode[0] * above - self.mode[1] * below, 2)",
        ).replace(
            "-self.k * (above - below)",
            "-self.k * (self.mode[0] + self.mode[1]) * (above - below)",
        ),
        "",
    ),
    "a mode in an exponential": (
        GUARD.replace("import power", "import exp, power")
        .replace(SQUARE, "2.0 * exp(self.mode[0] * above)")
        .replace(
            "above, below = self.mode * self._beyond(motion)",
            "above, below = self.mode * self._beyond(motion)\n"
            "        above = self.mode[0] * exp(self.mode[0] * above)",
        ),
        NOT_CONTINUOUS,
    ),
    "a wrench that is wrong in one mode": (
        GUARD.replace("(above - below)", "(above - 1.01 * below)"),
        UNBALANCED,
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_shown_to_be_continuous(folder, name):
    text, reason = REFUSED[name]
    assert reason in why_not(folder, text, SOFT)


@pytest.mark.parametrize(("k", "soft"), [(1e200, 0.3), (1e-110, 1e110)])
def test_numbers_that_no_double_has(folder, k, soft):
    """k² is too large, or k³ too small: its double would be an exact zero."""
    text = GUARD.replace("motion.Theta[1]", "(self.soft / 0.3 * motion.Theta[1])")
    text = text.replace(SQUARE, "2 * self.k * self.mode[0] * power(self.k * above, 3)")
    push = "above, below = self.mode * self._beyond(motion)"
    text = text.replace(
        push, f"{push}\n        above = 20 * self.k * self.k * self.k * above * above"
    )
    (folder / "mine.py").write_text(text)
    config = loaded_with({"one": mine(k=k, soft=soft)})
    assert not prove(config).proved


def test_an_energy_of_the_position_of_a_free_body_is_not_one_of_the_angles(folder):
    """The line of a band may have no length then; a band to a plane has another reason."""
    assert "may be zero" in why_not(folder, BAND, VALUES, "visco-elastic")
    assert NOT_OF_ANGLES in why_not(folder, FLOOR, {"k": 3.0}, "visco-elastic")
    (folder / "mine.py").write_text(FLOOR)
    assert prove(loaded_with({"one": mine(k=3.0)})).proved


FLOOR = element_text("""
    mode_count = 1

    def guards(self, motion, own):
        return np.array([-motion.X[2] - 0.1])

    def wrench(self, motion, own):
        depth = -motion.X[2] - 0.1
        return force_at_centre(np.array([0.0, 0.0, self.mode[0] * self.k * depth]))

    def stored(self, motion, own):
        depth = -motion.X[2] - 0.1
        return 0.5 * self.k * self.mode[0] * depth * depth
    """)
"""A soft floor under the centre."""


ALL_ANGLES = element_text(
    """
    mode_count = 6

    def guards(self, motion, own):
        first, second, third = motion.Theta
        return np.array([first, -first, second, -second, third, -third]) - self.soft

    def wrench(self, motion, own):
        g = self.mode * self.guards(motion, own)
        slope = np.array([g[0] - g[1], g[2] - g[3], g[4] - g[5]])
        return couple_on_body(-self.k * (slope @ motion.B))

    def stored(self, motion, own):
        return 0.5 * self.k * (self.mode @ power(self.guards(motion, own), 2))
    """,
    'Gain("k", "N m/rad", "stiffness", shape="number"), '
    'Gain("soft", "rad", "soft angle", shape="number")',
)
"""A stiff guard on each angle."""


def test_a_guard_on_each_angle_has_the_rest_state_of_a_search(folder):
    """Six modes in one element: the rest state lies beyond all three of its angles."""
    (folder / "mine.py").write_text(ALL_ANGLES)
    proof = prove(loaded_with({"one": mine(k=30.0, soft=0.1)}))
    assert proof.proved
    (state,) = proof.states
    at_rest = configurations(problem_of(loaded_with({})).system)

    def whole(Theta):
        beyond = np.maximum(np.abs(Theta) - 0.1, 0.0)
        return float(at_rest.energy(Theta)) + 15.0 * beyond @ beyond

    found = minimize(whole, np.zeros(3), tol=1e-12).x
    np.testing.assert_allclose(state.orientation, found, atol=1e-5)
    assert np.all(np.abs(found) > 0.1)
    assert (state.index, state.index_proved) == (0, True)


SWITCHING = """
    mode_count = {0}

    def guards(self, motion, own):
        return motion.Theta[0] * np.ones({0})
"""

OWN_STATE = """
    states = (OwnState("s", "s", "m", "a state", size=1),)

    def rates(self, motion, own):
        return -own
"""


@pytest.mark.parametrize(("count", "own", "expected"), [(1, 0, 1), (6, 0, 1), (7, 0, 0), (1, 1, 1)])
def test_which_switching_elements_may_be_in_proofs(folder, count, own, expected):
    text = SPRING.replace("import power", "import OwnState, power")
    (folder / "mine.py").write_text(text + SWITCHING.format(count) + OWN_STATE * own)
    elements = problem_of(loaded_with({"one": mine(k=1.0)})).system.elements
    (found,) = (one for one in elements if one.from_user)
    assert in_proofs(found) is bool(expected)
