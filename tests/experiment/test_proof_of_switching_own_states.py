"""Protects proofs of elements of users that have own states and switch.

Against a cord without switches beside our own guards, and searches over all variables in doubles.
"""

from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from support.proofs import rest_states
from support.switching_cords import (
    CLUTCH,
    CORD,
    REPELLING,
    STIFF,
    TIGHTER,
    linear,
    text_of,
)
from support.user_code import loaded_with, mine

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of, system_of
from rbstab.elements.user_code.loaded import UserCode, element_class
from rbstab.experiment.element_check.check import check_class
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.proof.passive.passive import NOT_CONVEX_IN_STATES, NOT_RELAXING, why_not_in_proofs
from rbstab.proof.passive.switches import JUMPS_BY_MORE, NOT_OF_ANGLES

SOFT = 0.02
"""The body rests against a guard at this angle."""

OURS = {
    "stiff": {"kind": "guard", "method": "stiff", "stiffness": 31.0, "soft_angle": SOFT},
    "repelling": {"kind": "guard", "method": "repelling", "couple": 31.0, "soft_angle": SOFT},
}

MOVING = """first, second = self.slopes(motion, own)
        return -0.5 * np.array([first, {0} * second])"""
"""Rates with which an own state rests anywhere in one of the modes."""

HEAVY = [pytest.param(name, marks=pytest.mark.heavy) for name in ("repelling", "tighter")]

NAMES = ["stiff", *HEAVY]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    texts = {"cord": CORD, "stiff": text_of(STIFF), "repelling": text_of(REPELLING)}
    for name, text in (texts | {"tighter": TIGHTER}).items():
        (tmp_path / f"{name}.py").write_text(text)
    return tmp_path


GAINS = {"K_t": [40, 40, 30], "L_t": [2, 2, 1], "K_r": [20, 20, 20], "L_r": [0.6, 0.6, 0.4]}


def load(elements, **changes):
    return loaded_with(elements, controller={"variant": "permanent"} | GAINS, **changes)


def element(name):
    if name == "tighter":
        return mine(point=[0.1, 0, 0.3], k=60.0, soft=0.05) | {"file": "tighter.py"}
    return mine(point=[0, 0, 0.4], k=31.0, soft=SOFT) | {"file": f"{name}.py"}


@cache
def proved(name: str) -> tuple[Any, Proof]:
    config = load({"one": element(name)})
    return config, prove(config)


def lowest_found(config):
    """Return the lowest end of searches over Θ and D in doubles."""
    at_rest = configurations(problem_of(config).system)
    rng = np.random.default_rng(4)
    ends = []
    for _ in range(8):
        start = np.concatenate(
            [rng.uniform(-1.0, 1.0, 3), rng.uniform(-0.3, 0.3, at_rest.size - 3)]
        )
        options = {"xatol": 1e-9, "fatol": 1e-14, "maxiter": 20000, "maxfev": 20000}
        found = minimize(
            lambda q: float(at_rest.energy(q)), start, method="Nelder-Mead", options=options
        )
        ends.append(found)
    return min(ends, key=lambda one: one.fun)


@pytest.mark.parametrize("name", NAMES[:2])
def test_switches_of_the_cord_are_our_guards(name):
    _, proof = proved(name)
    expected = prove(load({"one": element("cord"), "range": OURS[name]}))
    assert proof.proved
    assert len(proof.states) == len(expected.states) == 1
    (one,), (other,) = proof.states, expected.states
    np.testing.assert_allclose(one.orientation, other.orientation, atol=1e-9)
    np.testing.assert_allclose(one.connector_state, other.connector_state, atol=1e-9)
    assert one.energy == pytest.approx(other.energy, abs=1e-9)
    assert (one.index, one.index_proved, bool(one.held)) == (0, True, name == "repelling")
    assert abs(one.orientation[1]) >= SOFT - 1e-12
    assert proof.region is not None
    assert expected.region is not None
    assert proof.region.lower_bound == pytest.approx(expected.region.lower_bound, rel=1e-4)


@pytest.mark.parametrize("variant", ["permanent", "visco-elastic"])
@pytest.mark.parametrize("name", OURS)
def test_switches_of_a_linear_cord_are_our_guards_also_if_the_body_is_free_to_move(
    folder, variant, name
):
    (folder / "linear.py").write_text(linear(CORD))
    (folder / f"{name}.py").write_text(linear(text_of(STIFF if name == "stiff" else REPELLING)))
    tie = {} if variant == "permanent" else {"K_c": [99, 99, 300], "L_c": [9, 9, 9]}
    controller = {"variant": variant} | GAINS | tie
    config = loaded_with({"one": element(name)}, controller=controller)
    proof = prove(config)
    assert proof.reduced_energy is not None
    assert not proof.reduced_energy.free
    others = {"one": element("linear"), "range": OURS[name]}
    expected = prove(loaded_with(others, controller=controller))
    assert proof.proved
    for one, other in zip(proof.states, expected.states, strict=True):
        np.testing.assert_allclose(one.orientation, other.orientation, atol=1e-9)
        np.testing.assert_allclose(one.connector_state, other.connector_state, atol=1e-9)
        assert one.energy == pytest.approx(other.energy, abs=1e-9)
        assert (one.index, bool(one.held)) == (other.index, name == "repelling")
    assert proof.region is not None
    assert expected.region is not None
    assert proof.region.lower_bound == pytest.approx(expected.region.lower_bound, rel=0.05)


@pytest.mark.heavy
def test_switches_beside_a_matrix_and_an_own_state_that_they_multiply():
    config, proof = proved("tighter")
    assert proof.proved
    (state,) = proof.states
    assert (state.index, state.index_proved) == (0, True)
    end = lowest_found(config)
    assert end.fun == pytest.approx(state.energy, abs=1e-9)
    np.testing.assert_allclose(end.x[:3], state.orientation, atol=1e-4)
    np.testing.assert_allclose(end.x[3:], state.connector_state, atol=1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_the_forces_and_rates_of_the_code_are_zero_at_the_rest_state(name):
    config, _ = proved(name)
    (point,) = rest_states(problem_of(config).system, partial(system_of, config)).states
    assert point.state.is_at_rest


@pytest.mark.parametrize("name", ["stiff", pytest.param("tighter", marks=pytest.mark.heavy)])
def test_runs_come_to_the_rest_state(name):
    _, proof = proved(name)
    run = {"duration": 150.0, "samples": 11}
    result = simulate(load({"one": element(name)}, integration=run))
    np.testing.assert_allclose(result["orientation"][-1], proof.states[0].orientation, atol=1e-4)
    np.testing.assert_allclose(result["one.creep"][-1], proof.states[0].connector_state, atol=1e-4)


@pytest.mark.parametrize("eps", [0.0, 1e-20, 1e-17, 1e-12])
def test_the_last_digit_of_a_sum_decides_whether_an_energy_is_convex(folder, eps):
    """k ((D1 + D2)² - ε D2²) max(g, 0)² is not, for any ε > 0: far away it is below any bound."""
    strength = f"(1 + own[0] * own[0] + 2 * own[0] * own[1] + own[1] * own[1] - {eps} * own[1]**2)"
    first = "2 * self.k * p * (own[0] + own[1])"
    second = f"2 * self.k * p * (own[0] + own[1] - {eps} * own[1])"
    text = TIGHTER.replace("(1 + power(own[0], 2))", strength)
    text = text.replace("2 * self.k * own[0] * p", first)
    text = text.replace("12 * own[1] - 4 * own[0]", f"12 * own[1] - 4 * own[0] + {second}")
    if eps:
        assert NOT_CONVEX_IN_STATES in why_not(folder, text)
    else:
        (folder / "mine.py").write_text(text)
        config = load({"one": mine(point=[0, 0, 0.4], k=31.0, soft=SOFT)})
        assert why_not_in_proofs(problem_of(config).system) is None


def why_not(folder, text):
    (folder / "mine.py").write_text(text)
    config = load({"one": mine(point=[0, 0, 0.4], k=31.0, soft=SOFT)})
    why = why_not_in_proofs(problem_of(config).system)
    assert why is not None
    return why


def test_what_is_not_shown(folder):
    by_creep = text_of(STIFF).replace("pitch - self.soft,", "pitch - self.soft + own[0],")
    assert "it is not shown" in why_not(folder, by_creep)
    follows = TIGHTER.replace("np.array([self.longer(motion)])", "np.array([own[0]])")
    assert NOT_OF_ANGLES in why_not(folder, follows)
    jumps = TIGHTER.replace("power(self.longer(motion), 2)", "self.longer(motion)")
    jumps = jumps.replace("g = self.mode[0] * self.longer(motion)", "g = 0.5 * self.mode[0]")
    assert JUMPS_BY_MORE in why_not(folder, jumps)
    # In one of its modes, an own state does not rest where the energy is least.
    for mode in ("self.mode[0]", "(1 - self.mode[0])"):
        moving = TIGHTER.replace("return -0.5 * self.slopes(motion, own)", MOVING.format(mode))
        loss = f"power(a, 2) + {mode} * power(b, 2)"
        assert NOT_RELAXING in why_not(folder, moving.replace("power(a, 2) + power(b, 2)", loss))


@pytest.mark.parametrize(
    ("text", "jumps"), [(text_of(REPELLING), True), (text_of(STIFF), False), (CLUTCH, False)]
)
def test_the_check_of_a_file_asks_for_kinked_if_the_energy_has_kinks(text, jumps):
    code = UserCode(text, "mine.py")
    found = check_class(element_class(code, "Mine"), code)
    assert found.problems == ()
    assert any("declare `kinked = True`" in note for note in found.notes) is jumps


def test_a_clutch_rests_where_the_body_does_without_it(folder):
    (folder / "clutch.py").write_text(CLUTCH)
    proof, expected = prove(load({"one": element("clutch")})), prove(load({}))
    assert proof.proved
    (one,), (other,) = proof.states, expected.states
    np.testing.assert_allclose(one.orientation, other.orientation, atol=1e-12)
    assert one.connector_state == (0, 0)


@pytest.mark.heavy
@pytest.mark.parametrize("name", OURS)
def test_beside_a_barrier_and_another_element_every_start_converges(name):
    others = {"barrier": {"kind": "guard", "method": "barrier", "stiffness": 1.0}}
    others["more"] = element("cord") | {
        "parameters": {"point": [0, 0.1, -0.2], "k": 1.0, "soft": 1}
    }
    proof = prove(load({"one": element(name)} | others))
    expected = prove(load({"one": element("cord"), "range": OURS[name]} | others))
    assert proof.proved
    assert proof.unwrapped is not None
    assert expected.unwrapped is not None
    assert proof.unwrapped.every_start is expected.unwrapped.every_start is True
    (one,), (other,) = proof.states, expected.states
    np.testing.assert_allclose(one.orientation, other.orientation, atol=1e-9)
    np.testing.assert_allclose(one.connector_state, other.connector_state, atol=1e-9)


@pytest.mark.heavy
def test_where_nothing_is_proved_a_search_finds_that_the_body_is_held_at_a_switch(folder):
    """The force jumps: a class with own states declares it like any other one."""
    _, proof = proved("repelling")
    text = text_of(REPELLING).replace("mode_count = 2", "mode_count = 2\n    kinked = True")
    # Of this strength, which is k too, it is not shown that it is positive.
    text = text.replace("self.k", "log(exp(self.k))").replace(
        "import OwnState", "import OwnState, log"
    )
    (folder / "repelling.py").write_text(text)
    code = UserCode(text, "repelling.py")
    assert check_class(element_class(code, "Mine"), code).problems == ()
    searched = prove(load({"one": element("repelling")}))
    assert not searched.proved
    (state,) = searched.states
    assert state.held
    assert not state.proved
    np.testing.assert_allclose(state.orientation, proof.states[0].orientation, atol=1e-7)
    np.testing.assert_allclose(state.connector_state, proof.states[0].connector_state, atol=1e-7)
