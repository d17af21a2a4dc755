"""Protects proofs with own states of users whose energy is no quadratic.

Against searches in doubles over the attitude and the own states together.
"""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from support.proofs import rest_states
from support.user_code import MAXWELL, element_text, loaded_with, mine

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of, system_of
from rbstab.experiment.convergence.exact_motion import convergence_at_start, prove_convergence
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.verification.verify import verify
from rbstab.proof.passive import passive
from rbstab.proof.passive.passive import why_not_in_proofs

CORD = element_text(
    """
    states = (OwnState("creep", "D", "m", "creep", size=1),)

    def share(self, motion, own):
        return (position(motion, self.point)[0] - own[0]) / self.k

    def rates(self, motion, own):
        return (20 * self.k * (exp(self.share(motion, own)) - 1) - 30 * own) / 2

    def wrench(self, motion, own):
        tension = 20 * self.k * (exp(self.share(motion, own)) - 1)
        return force_at(motion, self.point, np.array([-tension, 0, 0]))

    def stored(self, motion, own):
        x = self.share(motion, own)
        return 20 * self.k**2 * (exp(x) - x - 1) + 15 * own[0] ** 2

    def dissipated(self, motion, own):
        return 2 * self.rates(motion, own)[0] ** 2
    """,
    'POINT, Gain("k", "m", "scale", shape="number")',
).replace("import power", "import OwnState, power")
"""A long cord along e1 that stiffens and creeps."""

PAIR = element_text(
    """
    states = (OwnState("creep", "D", "m", "two points of the cord", size=2),)

    def forces(self, motion, own):
        first = position(motion, self.point)[1] - own[0]
        second = own[0] - own[1]
        return self.k * first + 9 * first**3, 30 * second, 8 * own[1] + 40 * own[1] ** 3

    def rates(self, motion, own):
        one, two, three = self.forces(motion, own)
        # A matrix that is not diagonal, and has a skew part.
        return np.array([0.5 * (one - two) + 0.3 * (two - three), 0.8 * (two - three)])

    def wrench(self, motion, own):
        return force_at(motion, self.point, np.array([0, -self.forces(motion, own)[0], 0]))

    def stored(self, motion, own):
        first = position(motion, self.point)[1] - own[0]
        second = own[0] - own[1]
        springs = 0.5 * self.k * first**2 + 2.25 * first**4 + 15 * second**2
        return springs + 4 * own[1] ** 2 + 10 * own[1] ** 4

    def dissipated(self, motion, own):
        one, two, three = self.forces(motion, own)
        a, b = one - two, two - three
        return 0.5 * a * a + 0.3 * a * b + 0.8 * b * b
    """,
    'POINT, Gain("k", "N/m", "stiffness", shape="number")',
).replace("import power", "import OwnState, power")
"""Three springs in a row along e2, two of which stiffen; both points between them are damped."""

SOFT = {"K_t": [4, 4, 3], "L_t": [2, 2, 1], "K_r": [4, 4, 3], "L_r": [0.6, 0.6, 0.4]}
STIFF = SOFT | {"K_t": [40, 40, 30], "K_r": [20, 20, 20]}


NAMES = ["cord", *(pytest.param(name, marks=pytest.mark.heavy) for name in ("pair", "both"))]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in (("cord", CORD), ("pair", PAIR), ("maxwell", MAXWELL)):
        (tmp_path / f"{name}.py").write_text(text)
    return tmp_path


def cord(k=0.3, **changes):
    return mine(point=[0, 0, 0.4], k=k, **changes) | {"file": "cord.py"}


def pair():
    return mine(point=[0.1, 0, 0.3], k=25.0) | {"file": "pair.py"}


def load(elements, gains=STIFF, variant="permanent", **changes):
    return loaded_with(elements, controller={"variant": variant} | gains, **changes)


@cache
def _proved(name: str) -> tuple[Any, Proof]:
    elements: dict[str, Callable[[], dict[str, Any]]] = {
        "cord": lambda: {"cord": cord()},
        "pair": lambda: {"pair": pair()},
        "both": lambda: {"pair": pair(), "cord": cord(0.5)},
    }
    config = load(elements[name]())
    return config, prove(config)


@pytest.mark.parametrize("name", NAMES)
def test_the_rest_state_is_where_searches_over_all_end(name):
    config, proof = _proved(name)
    assert proof.proved
    assert proof.unique
    (state,) = proof.states
    assert (state.index, state.index_proved, state.proved) == (0, True, True)
    at_rest = configurations(problem_of(config).system)
    rng = np.random.default_rng(4)
    found = []
    for _ in range(12):
        start = np.concatenate(
            [rng.uniform(-1.2, 1.2, 3), rng.uniform(-0.3, 0.3, at_rest.size - 3)]
        )
        end = minimize(lambda q: float(at_rest.energy(q)), start, method="BFGS", tol=1e-10)
        if np.all(np.abs(end.x[:3]) < [np.pi, np.pi / 2, np.pi]):
            found.append(end)
    assert len(found) > 8
    for end in found:
        assert end.fun == pytest.approx(state.energy, abs=1e-9)
        np.testing.assert_allclose(end.x[:3], state.orientation, atol=1e-5)
        np.testing.assert_allclose(end.x[3:], state.connector_state, atol=1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_forces_and_rates_are_zero_at_the_rest_state(name):
    config, _ = _proved(name)
    (point,) = rest_states(problem_of(config).system, partial(system_of, config)).states
    assert point.state.is_at_rest


def test_an_own_state_that_follows_at_once_is_part_of_the_region():
    """c* is that of the energy with the own state wherever it is least."""
    config, proof = _proved("cord")
    assert proof.region is not None
    at_rest = configurations(problem_of(config).system)
    bound, lowest = proof.region.energy_bound, proof.states[0].energy
    assert bound is not None
    assert proof.region.lower_bound == pytest.approx(bound - lowest, rel=1e-6)
    rng = np.random.default_rng(8)
    least = []
    ends = np.array([np.pi, np.pi / 2, np.pi])
    for _ in range(60):
        axis, Theta = rng.integers(3), rng.uniform(-ends, ends)
        Theta[axis] = ends[axis] * rng.choice([-1, 1])
        free = [k for k in range(at_rest.size) if k != axis]

        def on_face(x, axis=axis, Theta=Theta, free=free):
            q = np.concatenate([Theta, [0.0]])
            q[free] = x
            return float(at_rest.energy(q))

        bounds = [(-ends[k], ends[k]) if k < 3 else (-1, 1) for k in free]
        start = np.concatenate([Theta, [0.0]])[free]
        least.append(minimize(on_face, start, bounds=bounds).fun)
    assert min(least) >= bound
    assert min(least) == pytest.approx(bound, rel=1e-3)


def test_runs_from_the_region_come_to_the_rest_state():
    config, proof = _proved("cord")
    assert convergence_at_start(config, problem_of(config), proof).proved
    result = simulate(load({"cord": cord()}, integration={"duration": 200.0, "samples": 11}))
    np.testing.assert_allclose(result["orientation"][-1], proof.states[0].orientation, atol=1e-4)
    np.testing.assert_allclose(result["cord.creep"][-1], proof.states[0].connector_state, atol=1e-4)


def test_a_start_outside_of_the_region_is_decided_by_its_exact_motion():
    _, proof = _proved("cord")
    fast = {"orientation": [0.2, -0.2, -0.1], "angular_velocity": [12.0, 0.0, 0.0]}
    config = load({"cord": cord()}, initial=fast)
    problem = problem_of(config)
    assert convergence_at_start(config, problem, proof).proved is None
    found = prove_convergence(config, problem, proof).convergence
    assert (found.proved, found.rest_state) == (True, 1)
    assert found.time is not None
    assert found.time > 0


def test_beside_a_barrier_every_start_converges():
    barrier = {"kind": "guard", "method": "barrier", "stiffness": 1.0}
    proof = prove(load({"cord": cord(), "range": barrier}))
    assert proof.unwrapped is not None
    assert proof.unwrapped.every_start


def test_a_damper_whose_viscosity_changes_has_the_same_rest_states_and_region(folder):
    config, expected = _proved("cord")
    text = CORD.replace("- 30 * own) / 2", "- 30 * own) / (2 + own[0]**2)")
    text = text.replace("return 2 * self", "return (2 + own[0]**2) * self")
    (folder / "cord.py").write_text(text)
    changed = load({"cord": cord()})
    assert not np.allclose(simulate(config)["cord.creep"][1], simulate(changed)["cord.creep"][1])
    found = prove(changed)
    assert found.proved
    assert found.states[0].orientation == expected.states[0].orientation
    assert found.region is not None
    assert expected.region is not None
    assert found.region.energy_bound == expected.region.energy_bound


@pytest.mark.heavy
def test_a_proof_with_two_own_states_is_verified():
    config, proof = _proved("pair")
    found = verify(proof, config)
    assert found.verified, [one.text for one in found.findings if not one.verified]


def why_not(folder, text, variant="permanent", **parameters):
    (folder / "mine.py").write_text(text)
    gains = STIFF | ({} if variant == "permanent" else {"K_c": [99] * 3, "L_c": [9] * 3})
    config = load({"one": mine(point=[0, 0, 0.4], **parameters)}, gains, variant)
    why = why_not_in_proofs(problem_of(config).system)
    assert why is not None
    return why


def test_what_is_not_shown(folder):
    assert "quadratic function of X and its own states" in why_not(
        folder, CORD, "visco-elastic", k=0.3
    )
    first, second = "0.5 * (one - two) + 0.3 * (two - three)", "0.8 * (two - three)"
    stays = PAIR.replace(first, "0.5 * (one - two)").replace(second, "0.0 * two")
    stays = stays.replace("0.5 * a * a + 0.3 * a * b + 0.8 * b * b", "0.5 * a * a")
    assert passive.NOT_RELAXING in why_not(folder, stays, k=25.0)
    wells = CORD.replace("15 * own[0] ** 2", "5 * (own[0] ** 2 - 0.01) ** 2")
    wells = wells.replace("30 * own)", "20 * own * (own[0] ** 2 - 0.01))")
    assert passive.NOT_CONVEX_IN_STATES in why_not(folder, wells, k=0.3)
    endless = CORD.replace("(exp(x) - x - 1) + 15 * own[0] ** 2", "exp(x)")
    endless = endless.replace("(exp(self.share(motion, own)) - 1)", "exp(self.share(motion, own))")
    endless = endless.replace("- 30 * own)", "+ 0.0 * own)")
    assert passive.NO_LEAST_ENERGY in why_not(folder, endless, k=0.3)
