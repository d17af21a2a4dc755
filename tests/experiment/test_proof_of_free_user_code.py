"""Protects proofs with elements of users of bodies that are not held, or that have own states.

They are compared with those of the program's own elements, and with searches by scipy.
"""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from support.user_code import CREEPING_TIE, MAXWELL, ROPE, SPRING, TIE, element_text, mine

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.experiment.answers.reasons import NOT_DAMPED
from rbstab.experiment.convergence.convergence import Enclose, Undecided
from rbstab.experiment.convergence.exact_motion import convergence_at_start, prove_convergence
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.verification.verify import verify

POINT = {"point": [0.1, 0.2, -0.1], "anchor": [0.0, 0.3, 0.1]}

K = [[30.0, 2.0, 0.0], [2.0, 20.0, 1.0], [0.0, 1.0, 10.0]]
L = [[2.0, 1.0, 0.0], [1.0, 3.0, 0.5], [0.0, 0.5, 1.0]]

TIED = POINT | {"K_c": K, "L_c": L}
CREEP = TIED | {"K_d": [[9.0, 1.0, 0.0], [1.0, 8.0, 0.0], [0.0, 0.0, 7.0]], "L_d": [3.0, 2.0, 1.0]}

GAINS = {"K_t": [40, 40, 30], "L_t": [2, 2, 1], "K_r": [4, 4, 3], "L_r": [0.6, 0.6, 0.4]}
FREE = {"variant": "free"} | GAINS
VISCO = {"variant": "visco-elastic", "K_c": [40, 30, 50], "L_c": [1, 1, 1]} | GAINS
EMBEDDED = (
    {"variant": "embedded", "K_d": [60, 50, 40], "L_d": [2, 3, 2]} | VISCO | {"variant": "embedded"}
)
PERMANENT = {"variant": "permanent"} | GAINS
NONE = {"variant": "none"}

UPRIGHT = {"kind": "attitude", "K": [6, 6, 4], "L": [0.5, 0.5, 0.4]}

FAST = {"orientation": [0.5, -0.4, 0.3], "angular_velocity": [3.0, -1.5, 2.0]}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tie.py").write_text(TIE)
    (tmp_path / "maxwell.py").write_text(MAXWELL)
    (tmp_path / CREEPING_TIE.name).write_text(CREEPING_TIE.read_text(encoding="utf-8"))
    return tmp_path


def tie(**changes):
    return mine(**TIED | changes) | {"file": "tie.py"}


def creeping(**changes):
    return mine(**CREEP | changes) | {"file": CREEPING_TIE.name, "class": "CreepingTie"}


def load(elements, controller=VISCO, **changes):
    data = {
        "schema_version": 2,
        "body": {"mass": 2, "inertia": [1, 1.5, 2], "contact_point": [0.1, -0.1, -0.3]},
        "controller": controller,
        "elements": elements,
        "initial": {"angular_velocity": [0.4, -0.3, 0.2]},
        "integration": {"duration": 1.0, "samples": 21},
    }
    if controller is NONE:
        del data["controller"]
    return load_config(data | changes, allow_python=True)


def assert_same(theirs, ours, *, proved=True):
    """Compare two proofs: all but round-off."""
    assert theirs.proved is ours.proved is proved
    assert theirs.outcome == ours.outcome
    assert len(theirs.states) == len(ours.states)
    for one, other in zip(theirs.states, ours.states, strict=True):
        np.testing.assert_allclose(one.orientation, other.orientation, atol=1e-9)
        np.testing.assert_allclose(one.position, other.position, atol=1e-9)
        np.testing.assert_allclose(one.connector_state, other.connector_state, atol=1e-9)
        assert one.energy == pytest.approx(other.energy, abs=1e-9)
        assert (one.index, one.proved) == (other.index, other.proved)
    assert len(theirs.regions) == len(ours.regions)
    for one, other in zip(theirs.regions, ours.regions, strict=True):
        assert one.energy_bound == pytest.approx(other.energy_bound, rel=1e-6)


@pytest.mark.parametrize("controller", [FREE, VISCO, EMBEDDED], ids=lambda one: one["variant"])
def test_a_tie_of_users_has_the_proof_of_ours(controller):
    theirs = prove(load({"one": tie()}, controller))
    assert_same(theirs, prove(load({"one": {"kind": "visco-elastic"} | TIED}, controller)))
    assert verify(theirs, load({"one": tie()}, controller)).verified


@pytest.mark.parametrize("controller", [FREE, EMBEDDED, PERMANENT], ids=lambda one: one["variant"])
def test_own_states_of_users_have_the_proof_of_ours(controller):
    """Their own states stand before those of our element: `one` before `two`."""
    two = {"kind": "embedded"} | CREEP | {"point": [-0.1, 0.2, 0.3]}
    config = load({"one": creeping(), "two": two}, controller)
    theirs = prove(config)
    ours = prove(load({"one": {"kind": "embedded"} | CREEP, "two": two}, controller))
    assert_same(theirs, ours)
    found = verify(theirs, config)
    assert found.verified, [one.text for one in found.findings if not one.verified]


def test_elements_of_users_alone_damp_a_body_without_a_controller(folder):
    config = load({"one": creeping(), "upright": UPRIGHT}, NONE, gravity=[0.0, 0.5, -9.81])
    proof = prove(config)
    ours = load(
        {"one": {"kind": "embedded"} | CREEP, "upright": UPRIGHT}, NONE, gravity=[0.0, 0.5, -9.81]
    )
    # At θ2 = ±π/2 rest states are not isolated. But there is a region.
    assert_same(proof, prove(ours), proved=False)
    assert proof.region is not None
    assert proof.region.lower_bound > 0
    (folder / "mine.py").write_text(SPRING)
    undamped = load({"one": mine(k=30.0), "upright": UPRIGHT}, NONE)
    assert NOT_DAMPED in prove(undamped).outcome


def test_beside_a_spring_of_a_free_body(folder):
    ends = {"point": [0.2, 0.1, 0.0], "anchor": [0.9, 0.1, 0.0]}
    strut = {"kind": "spring", "stiffness": 6.0, "rest_length": 0.4, "damping": 0.2} | ends
    config = load({"one": tie(), "strut": strut})
    theirs = prove(config)
    assert_same(theirs, prove(load({"one": {"kind": "visco-elastic"} | TIED, "strut": strut})))
    assert verify(theirs, config).verified
    (folder / "mine.py").write_text(NOD)
    config = load({"one": mine(k=1.0), "strut": strut})
    nodding = prove(config)
    assert nodding.proved
    assert nodding.needs_lengths
    lowest = nodding.states[0]
    at_rest = configurations(system_of(config))
    q = np.concatenate([lowest.orientation, lowest.position])
    found = minimize(lambda q: float(at_rest.energy(q)), q + 0.01, tol=1e-12)
    np.testing.assert_allclose(found.x, q, atol=1e-5)


NOD = element_text(
    """
    def wrench(self, motion, own):
        up = motion.A[2]
        push = self.k * exp(-up[2])
        return couple_on_body(push * np.array([-up[1], up[0], 0.0 * up[2]]))

    def stored(self, motion, own):
        return self.k * exp(-motion.A[2][2])
    """,
    'Gain("k", "J", "energy", shape="number")',
)
"""An energy of the attitude alone that is no polynomial: it pulls upright."""


@pytest.mark.parametrize("ligament", [False, True])
def test_a_formula_of_the_attitude_beside_a_tie(folder, ligament):
    (folder / "mine.py").write_text(NOD)
    elements = {"one": mine(k=3.0)}
    if ligament:
        elements["cord"] = {
            "kind": "ligament",
            "point": [0.2, 0.1, 0.0],
            "anchor": [0.9, 0.1, 0.0],
            "slack_length": 0.5,
            "stiffness": 5.0,
            "toe_strain": 0.1,
        }
    config = load(elements, gravity=[1.0, -2.0, -9.0])
    proof = prove(config)
    assert proof.proved
    assert proof.reduced_energy is not None
    assert "exp" in {kind for kind, *_ in proof.reduced_energy.operations}
    at_rest = configurations(problem_of(config).system)
    expected = minimize(at_rest.energy, at_rest.unloaded, jac=at_rest.gradient, tol=1e-13)
    (state,) = proof.states
    np.testing.assert_allclose([*state.orientation, *state.position], expected.x, atol=1e-5)
    assert state.energy == pytest.approx(expected.fun, abs=1e-8)


def test_a_force_by_the_velocity_of_an_own_state_that_does_not_relax(folder):
    """It does not creep at all: its state keeps any value, and the body rests anywhere."""
    text = CREEPING_TIE.read_text(encoding="utf-8")
    held = text.replace("(self.K_c @ self.stretch(motion, own) - self.K_d @ own) / self.L_d", "{}")
    (folder / CREEPING_TIE.name).write_text(held.replace("{}", "0.0 * own / self.L_d"))
    proof = prove(load({"one": creeping()}))
    assert "its own states move down its energy" in proof.outcome
    assert proof.claims_nothing


def test_a_proof_of_another_element_is_refused():
    config = load({"one": creeping()})
    stiffer = load({"one": creeping(K_d=[9.0, 8.0, 7.01])})
    refused = [one.claim for one in verify(prove(config), stiffer).findings if not one.verified]
    assert refused == ["id", "energy"]


SEARCHED: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "a magnet of a free body": (
        SPRING.replace(
            "-self.k * motion.X", "-self.k * exp(-(motion.X @ motion.X)) * motion.X"
        ).replace(
            "0.5 * self.k * (motion.X @ motion.X)", "-0.5 * self.k * exp(-(motion.X @ motion.X))"
        ),
        {"k": 30.0},
        VISCO,
    ),
    "a rope of a free body": (
        ROPE,
        {"point": [0.2, 0.1, 0.0], "anchor": [0.9, 0.1, 0.0], "k": 0.5},
        VISCO,
    ),
    "damping that is not seen": (
        SPRING
        + """
    def dissipated(self, motion, own):
        return 0.0 * sin(motion.Theta[0])
""".replace("0.0 *", "1e-9 *"),
        {"k": 30.0},
        PERMANENT,
    ),
}


@pytest.mark.parametrize("name", SEARCHED)
def test_rest_states_that_are_searched_where_nothing_is_proved(folder, name):
    """With scipy's minimum of the energy."""
    text, parameters, controller = SEARCHED[name]
    (folder / "mine.py").write_text(text.replace("import power", "import power, sin"))
    config = load({"one": mine(**parameters)}, controller, gravity=[0.0, 1.0, -9.0])
    proof = prove(config)
    assert proof.claims_nothing
    at_rest = configurations(problem_of(config).system)
    least = minimize(at_rest.energy, at_rest.unloaded, jac=at_rest.gradient, tol=1e-13)
    state = proof.states[0]
    found = [*state.orientation, *([] if at_rest.held else state.position)]
    np.testing.assert_allclose(found, least.x, atol=1e-5)
    assert (state.proved, proof.region, proof.unique) == (False, None, None)
    assert not verify(proof, config).verified


def _motion(elements, controller, **changes):
    config = load(elements, controller, initial=FAST, **changes)
    proof = prove(config)
    found = prove_convergence(config, problem_of(config), proof, Enclose.TO_END)
    return config, proof, found


@pytest.mark.parametrize("controller", [VISCO, PERMANENT], ids=lambda one: one["variant"])
def test_the_exact_motion_is_that_of_our_own_element(controller):
    _, _, theirs = _motion({"one": creeping()}, controller)
    _, _, ours = _motion({"one": {"kind": "embedded"} | CREEP}, controller)
    assert theirs.convergence.proved
    assert theirs.convergence.time == ours.convergence.time > 0
    assert list(theirs.samples.low) == list(ours.samples.low)
    for name, low in theirs.samples.low.items():
        # Each contains the exact motion, which is the same.
        assert np.all(low <= ours.samples.high[name])
        assert np.all(ours.samples.low[name] <= theirs.samples.high[name])
        assert np.all(theirs.samples.high[name] - low < 1e-9)


SATURATING = element_text(
    """
    def wrench(self, motion, own):
        f = velocity(motion, self.point)
        return force_at(motion, self.point, -self.c * f / sqrt(0.2 + f @ f) - self.k * tanh(f))

    def dissipated(self, motion, own):
        f = velocity(motion, self.point)
        return self.c * (f @ f) / sqrt(0.2 + f @ f) + self.k * (f @ tanh(f))
    """,
    'POINT, Gain("c", "N", "c", shape="number"), Gain("k", "N", "k", shape="number")',
).replace("import power", "import power, sqrt")


@pytest.mark.parametrize("controller", [VISCO, PERMANENT], ids=lambda one: one["variant"])
def test_runs_stay_in_the_enclosures_of_other_functions(folder, controller):
    """A run with a tenth of a percent more damping leaves them."""
    (folder / "saturating.py").write_text(SATURATING)
    (folder / "mine.py").write_text(NOD)
    parameters = {"point": [0.1, 0.2, 0.3], "c": 1.0, "k": 0.3}
    elements = {"one": mine(**parameters) | {"file": "saturating.py"}, "two": mine(k=0.5)}
    config, _, found = _motion(elements, controller)
    assert found.convergence.proved
    more = elements | {"one": mine(**parameters | {"k": 0.3003}) | {"file": "saturating.py"}}
    other = simulate(load(more, controller, initial=FAST))
    run, outside = simulate(config), 0.0
    for name, low in found.samples.low.items():
        high, count = found.samples.high[name], len(low)
        values, wrong = (np.asarray(one[name])[:count] for one in (run, other))
        assert np.maximum(low - values, values - high).max() < 1e-10
        outside = max(outside, np.maximum(low - wrong, wrong - high).max())
    assert outside > 1e-5


def test_motions_that_cannot_be_enclosed_may_start_in_a_region(folder):
    (folder / "mine.py").write_text(ROPE)
    config = load({"one": mine(point=[0.2, 0.1, 0.0], anchor=[0.9, 0.1, 0.0], k=0.5)})
    found = prove_convergence(config, problem_of(config), prove(config), Enclose.TO_END)
    assert found.samples is None
    assert found.convergence.reason is Undecided.USER_CODE
    assert "one is code of a user that switches" in found.convergence.why
    assert convergence_at_start(config, problem_of(config), prove(config)).proved is None
