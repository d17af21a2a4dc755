"""Protects proofs of a body that is not held with elements of users that are no quadratics of X.

They are compared with searches by scipy, and with solutions in closed form.
"""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, minimize
from support.user_code import element_text, mine

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import start_state
from rbstab.experiment.verification.verify import verify
from rbstab.proof.check.checker import check
from rbstab.proof.exact.expr import variable
from rbstab.proof.record import energy_record, read_energy
from rbstab.proof.rest_states import Body

MASS, G = 2.0, 9.81

K_T = 300.0

CUBIC = element_text(
    """
    def wrench(self, motion, own):
        return force_at_centre(-self.k * power(motion.X, 3))

    def stored(self, motion, own):
        return 0.25 * (self.k @ power(motion.X, 4))
    """,
    'Gain("k", "N/m^3", "stiffness", shape="diagonal")',
)

BOTH = element_text(
    """
    def wrench(self, motion, own):
        e = motion.E
        return force_at_contact(-(self.k * (e @ e) + self.c) * e)

    def stored(self, motion, own):
        e = motion.E
        return 0.25 * self.k * (e @ e) ** 2 + 0.5 * self.c * (e @ e)
    """,
    'Gain("k", "N/m^3", "k", shape="number"), Gain("c", "N/m", "c", shape="number")',
)
"""All that holds the position is in it: a quadratic and another part."""

STEEP = element_text(
    """
    def wrench(self, motion, own):
        e = motion.E
        return force_at_contact(-2 * self.b * exp(self.b * (e @ e)) * e)

    def stored(self, motion, own):
        return exp(self.b * (motion.E @ motion.E)) - 1.0
    """,
    'Gain("b", "1/m^2", "b", shape="number")',
)
"""Convex and steep."""

WELL = element_text(
    """
    def wrench(self, motion, own):
        return force_at_centre(-self.k * exp(-(motion.X @ motion.X)) * motion.X)

    def stored(self, motion, own):
        return -0.5 * self.k * exp(-(motion.X @ motion.X))
    """,
    'Gain("k", "N/m", "k", shape="number")',
)
"""A magnet: not convex."""

STABILIZERS = {"K_t": [K_T] * 3, "L_t": [20, 20, 20], "K_r": [9, 9, 8], "L_r": [1, 1, 0.8]}
FREE: dict[str, Any] = {"variant": "free"} | STABILIZERS
ENDS: dict[str, Any] = {"point": [0.1, 0, 0.2], "anchor": [0.3, 0.1, 0.9]}
BARRIER = {"kind": "guard", "method": "barrier", "stiffness": 20.0}
K = [4000.0, 3000.0, 9000.0]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in (("mine", CUBIC), ("both", BOTH), ("well", WELL), ("steep", STEEP)):
        (tmp_path / f"{name}.py").write_text(text)
    return tmp_path


def load(elements, controller=FREE, **changes):
    data = {
        "schema_version": 2,
        "body": {"mass": MASS, "inertia": [1, 1.5, 2], "contact_point": [0.1, -0.1, -0.3]},
        "gravity": [0, 0, -G],
        "controller": controller,
        "elements": elements,
        "initial": {"orientation": [0.2, -0.1, 0.1], "velocity": [0.2, 0, 0]},
        "integration": {"duration": 1.0, "samples": 21},
    }
    return load_config(data | changes, allow_python=True)


def cubic(initial=None, **others):
    changes = {} if initial is None else {"initial": initial}
    return load({"mine": mine(k=K)} | others, **changes)


def both(**others):
    element = mine(k=4000.0, c=500.0) | {"file": "both.py"}
    controller = FREE | {"K_t": [0.5, 0.5, 0.5]}
    return load({"mine": element} | others, controller)


@pytest.fixture(scope="module")
def proof(tmp_path_factory):
    """The proof of `cubic`, made once."""
    folder = tmp_path_factory.mktemp("proofs")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        (folder / "mine.py").write_text(CUBIC)
        return prove(cubic())


def least_on_border(config, rng, tries=12):
    """Return the least stored energy on the faces of the range, by scipy."""
    at_rest = configurations(system_of(config))
    end, found = np.array([np.pi, np.pi / 2, np.pi]), []
    for axis in range(3):
        for side in (-1, 1):
            for _ in range(tries):
                start = np.concatenate([rng.uniform(-end, end), 0.1 * rng.normal(size=3)])
                low = np.concatenate([-end, [-1.0] * 3])
                high = -low
                low[axis] = high[axis] = start[axis] = side * end[axis]
                found.append(
                    minimize(
                        lambda q: float(at_rest.energy(q)),
                        start,
                        bounds=list(zip(low, high, strict=True)),
                        method="L-BFGS-B",
                        options={"maxiter": 2000, "ftol": 1e-14},
                    ).fun
                )
    return min(found)


def test_the_rest_state_is_that_of_a_cubic_equation(proof):
    assert proof.proved
    assert proof.unique
    assert proof.globally_stable
    z = brentq(lambda z: K[2] * z**3 + K_T * z + MASS * G, -1, 0, xtol=1e-15)
    (state,) = proof.states
    np.testing.assert_allclose(state.orientation, 0, atol=1e-12)
    np.testing.assert_allclose(state.position, [0, 0, z], atol=1e-12)
    energy = 0.25 * K[2] * z**4 + 0.5 * K_T * z**2 + MASS * G * z
    assert state.energy == pytest.approx(energy, abs=1e-11)
    # Nothing turns the body but K_r, whose least energy on the border is at θ2 = ±π/2.
    assert proof.region.energy == pytest.approx(energy + 0.5 * 9 * (np.pi / 2) ** 2, rel=1e-6)
    assert proof.region.energy_bound <= proof.region.energy
    assert proof.region.energy_bound > energy + 0.99 * 0.5 * 9 * (np.pi / 2) ** 2
    wide = proof.unwrapped
    assert wide is not None
    assert wide.proved


@pytest.mark.heavy
def test_position_and_attitude_may_be_coupled(monkeypatch):
    # The wider range takes longer.
    monkeypatch.setattr(Body, "wide", lambda *_, **__: None)
    config = both()
    proof = prove(config)
    assert proof.proved
    at_rest = configurations(system_of(config))
    rng = np.random.default_rng(0)
    for _ in range(6):
        q = minimize(lambda q: float(at_rest.energy(q)), 0.2 * rng.normal(size=6), tol=1e-12).x
        (state,) = [one for one in proof.states if np.abs(one.orientation - q[:3]).max() < 1e-4]
        np.testing.assert_allclose(state.position, q[3:], atol=1e-5)
        assert state.index == 0
    least = least_on_border(config, rng)
    assert proof.region is not None
    assert proof.region.energy_bound <= least + 1e-9
    depth = least - proof.states[0].energy
    assert proof.region.lower_bound >= 0.99 * min(
        depth, *(one.energy - proof.states[0].energy for one in proof.states[1:]), depth
    )


def test_what_is_said_and_stored(proof):
    config = cubic()
    problem = problem_of(config)
    assert start_state(problem, proof) == 1
    text = " ".join(stability_of(problem, proof).statements)
    assert "1 rest state in the range of eq. 5, proved to be all" in text
    assert "a length" not in text
    assert Proof(**json.loads(proof.model_dump_json())) == proof
    result = simulate(config)
    assert result.status == "completed"


@pytest.mark.heavy
def test_the_proof_is_verified_and_an_edited_one_is_not(proof):
    config = cubic()
    short = proof.model_copy(update={"unwrapped": None})
    found = verify(short, config)
    assert found.verified, found.findings
    assert verify(proof, None).verified
    # A bound that is too high.
    data = short.record
    data["ranges"][0]["level"] += 0.02 * short.region.level
    assert not all(one.verified for one in check(data))
    # Another energy has another rest state; and one that is not convex in X has no single one.
    energy = read_energy(short.record["energy"])
    z = variable(energy.free[2])
    for more, claim in ((z / 1000, "rest states"), (-(10**6) * z**4, "convexity")):
        data = short.record
        data["energy"] = energy_record(replace(energy, U=energy.U + more))
        wrong = [one.claim for one in check(data) if not one.verified]
        assert wrong[0] == claim


@pytest.mark.heavy
def test_with_a_barrier_every_start_converges():
    config = cubic(range=BARRIER)
    proof = prove(config)
    assert proof.every_start
    assert proof.region is None
    fast = cubic(range=BARRIER, initial={"orientation": [3.0, 1.5, -2.0], "velocity": [5, 0, 0]})
    assert start_state(problem_of(fast), proof) == 1
    text = " ".join(stability_of(problem_of(config), proof).statements)
    assert "Every start in the range converges: proved" in text
    assert verify(proof, config).verified
    # A spring may lose its length on the way.
    spring = {"kind": "spring", "stiffness": 5.0, "rest_length": 0.4} | ENDS
    beside = prove(cubic(range=BARRIER, strut=spring))
    assert beside.proved
    assert not beside.every_start


def test_one_that_is_not_convex_is_searched():
    config = load({"mine": mine(k=5.0) | {"file": "well.py"}})
    proof = prove(config)
    assert not proof.proved
    assert "or convex in X" in proof.outcome
    (state,) = proof.states
    assert not state.proved


def test_one_that_grows_fast_is_proved():
    """exp(b e'e) is huge at the ends of wide boxes of the position."""
    proof = prove(load({"mine": mine(b=20.0) | {"file": "steep.py"}}), brief=True)
    (state,) = proof.states
    assert state.proved


def test_a_small_brief_proof_says_that_more_may_be_proved(monkeypatch):
    monkeypatch.setattr("rbstab.proof.limits.BRIEF_WITH_SPRINGS", 20)
    proof = prove(cubic(), brief=True)
    assert proof.brief
    assert not proof.proved
