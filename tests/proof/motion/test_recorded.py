"""Protects that motions are enclosed by the formulas that the code of users states."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from support.user_code import (
    CREEPING_TIE,
    MAXWELL,
    ROPE,
    SPRING,
    TIE,
    element_text,
    loaded_with,
    python_section,
)

from rbstab.config.build import problem_of
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.proof.motion.equations import Equations
from rbstab.proof.motion.models import evaluated
from rbstab.proof.motion.motion_set import point_sets
from rbstab.proof.motion.recorded import why_not_recorded

K = [[30.0, 2.0, 0.0], [2.0, 20.0, 1.0], [0.0, 1.0, 10.0]]
AT = {"point": [0.1, 0.2, -0.1], "anchor": [0.0, 0.3, 1.1]}

ALL_FUNCTIONS = element_text(
    """
    def wrench(self, motion, states):
        x, v = motion.X, motion.V
        force = self.k * sin(x) + cos(v) * tan(x / 10) - atan(v) + sqrt(2 + x @ x) * x
        couple = exp(-motion.Omega) + log(3 + motion.Omega @ motion.Omega) * motion.Theta
        back = power(2 + x @ x, 3) ** -1 - motion.A @ v / (1 + v @ v) + x**2
        return Wrench(force, couple + sinh(x / 9) * cosh(v / 9), back * tanh(motion.F))

    def stored(self, motion, states):
        return self.k * (motion.B @ motion.Omega)[0] + motion.E @ motion.X

    def dissipated(self, motion, states):
        return 1 / 3 * (motion.V @ motion.V)
    """,
)

KINDS: dict[str, tuple[str, dict[str, Any]]] = {
    "tie": (TIE, AT | {"K_c": K, "L_c": [1.0, 2.0, 3.0]}),
    "maxwell": (MAXWELL, AT | {"k": 3.0, "c": 2.0}),
    "all functions": (ALL_FUNCTIONS, {"k": 3.0}),
    "own states": (
        CREEPING_TIE.read_text(encoding="utf-8").replace("CreepingTie", "Mine"),
        AT | {"K_c": K, "L_c": K, "K_d": K, "L_d": [1.0, 2.0, 3.0]},
    ),
}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def loaded(folder, text, parameters, variant="visco-elastic"):
    (folder / "mine.py").write_text(text)
    return loaded_with({"one": python_section(**parameters)}, variant)


@pytest.mark.parametrize("variant", ["visco-elastic", "permanent"])
@pytest.mark.parametrize("name", KINDS)
def test_motions_follow_the_code(folder, name, variant):
    config = loaded(folder, *KINDS[name], variant)
    equations = Equations(partial(enclosed_system, config))
    system = enclosed_system(config, lambda values: values)
    random, n = np.random.default_rng(8), system.size
    assert equations.size == n
    states = random.uniform(-0.7, 0.7, (5, n))
    at = point_sets(states, np.zeros_like(states), np.ones(n))
    rates = evaluated(equations.field().rates, at.models)
    low, high = rates.range()
    lowest, highest = equations.energy_bounds(at)
    for k, y in enumerate(states):
        expected = system.rates(y)
        np.testing.assert_allclose([low[:, k], high[:, k]], [expected] * 2, rtol=1e-10, atol=1e-10)
        energy = system.observe(y).energy.sum()
        np.testing.assert_allclose([lowest[k], highest[k]], energy, rtol=1e-10)


FACTOR = "return f @ self.L_c @ f"
WITHOUT: dict[str, tuple[str, dict[str, Any]]] = {
    "its event functions depend on its modes": (
        ROPE.replace(
            "def guards(self, motion, states):",
            "def guards(self, motion, states):\n        return motion.X[:1] * self.mode",
        ),
        {"k": 1.0},
    ),
    "an expression has no value": (
        TIE.replace(FACTOR, f"{FACTOR} if f[0] > 0 else 0.0"),
        KINDS["tie"][1],
    ),
    "a statement depends on the time": (
        SPRING.replace("-self.k * motion.X", "-self.k * motion.time * motion.X"),
        {"k": 3.0},
    ),
}


@pytest.mark.parametrize("why", WITHOUT)
def test_code_without_formulas(folder, why):
    text, parameters = WITHOUT[why]
    assert text not in {ROPE, TIE, SPRING}
    more = AT if text.count("self.anchor") else {}
    reason = why_not_recorded(problem_of(loaded(folder, text, more | parameters)).system)
    assert "one is code of a user that cannot be recorded" in str(reason)
    assert why in str(reason)


@pytest.mark.parametrize("text", [ROPE, TIE])
def test_code_with_formulas(folder, text):
    parameters = KINDS["tie"][1] if text == TIE else AT | {"k": 1.0}
    assert why_not_recorded(problem_of(loaded(folder, text, parameters)).system) is None
