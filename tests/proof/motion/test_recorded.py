"""Protects the recorded formulas of elements of users, by which their motions are enclosed."""

import numpy as np
import pytest
from flint import arb, ctx
from support.user_code import CREEPING_TIE, MAXWELL, ROPE, SPRING, TIE, element_text, mine

from rbstab.analysis.configuration import configurations
from rbstab.analysis.exact import decimal_balls
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.proof.motion.recorded import recorded_element, why_not_recorded
from rbstab.proof.passive.statements import NotRecordedError

K = [[30.0, 2.0, 0.0], [2.0, 20.0, 1.0], [0.0, 1.0, 10.0]]
AT = {"point": [0.1, 0.2, -0.1], "anchor": [0.0, 0.3, 1.1]}

ALL_FUNCTIONS = element_text(
    """
    def wrench(self, motion, own):
        x, v = motion.X, motion.V
        force = self.k * sin(x) + cos(v) * tan(x / 10) - atan(v) + sqrt(2 + x @ x) * x
        couple = exp(-motion.Omega) + log(3 + motion.Omega @ motion.Omega) * motion.Theta
        back = power(2 + x @ x, 3) ** -1 - motion.A @ v / (1 + v @ v) + x**2
        return Wrench(force, couple + sinh(x / 9) * cosh(v / 9), back * tanh(motion.F))

    def stored(self, motion, own):
        return self.k * (motion.B @ motion.Omega)[0] + motion.E @ motion.X

    def dissipated(self, motion, own):
        return 1 / 3 * (motion.V @ motion.V)
    """,
).replace("import power", "import Wrench, atan, cos, cosh, log, power, sin, sinh, sqrt, tan")

KINDS = {
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
    gains = ["K_t", "L_t", "K_r", "L_r"]
    gains += [] if variant == "permanent" else ["K_c", "L_c"]
    data = {
        "schema_version": 2,
        "body": {"mass": 2, "inertia": [1, 1.5, 2], "contact_point": [0.1, -0.2, 0.3]},
        "controller": {"variant": variant, **{key: [4, 4, 3] for key in gains}},
        "elements": {"one": mine(**parameters)},
        "integration": {"duration": 1.0},
    }
    system = problem_of(load_config(data, allow_python=True)).system
    (element,) = (one for one in system.elements if one.from_user)
    return configurations(system), element


@pytest.mark.parametrize("variant", ["visco-elastic", "permanent"])
@pytest.mark.parametrize("name", KINDS)
def test_the_formulas_have_the_values_of_the_code(folder, name, variant):
    at_rest, element = loaded(folder, *KINDS[name], variant)
    found = recorded_element(at_rest, element, lambda values: values)
    assert (found.state_size, found.name) == (element.state_size, "one")
    assert found.own_states == element.own_states
    random = np.random.default_rng(8)
    for _ in range(20):
        y = random.uniform(-0.7, 0.7, at_rest.system.coordinates.size)
        motion, own = at_rest.system.motion(y), random.normal(size=element.state_size)
        ours, theirs = found.wrench(motion, own), element.wrench(motion, own)
        for one, other in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(one.astype(float), other, rtol=1e-13, atol=1e-13)
        for statement in ("stored", "dissipated", "rates"):
            one, other = (getattr(each, statement)(motion, own) for each in (found, element))
            np.testing.assert_allclose(np.asarray(one, dtype=float), other, rtol=1e-13, atol=1e-13)


def test_constants_are_what_they_mean(folder):
    """A third of the code, and a tenth of the config, are no doubles."""
    with ctx.workprec(200):
        at_rest, element = loaded(folder, ALL_FUNCTIONS, {"k": 0.1})
        found = recorded_element(at_rest, element, decimal_balls)
        y = np.zeros(12)
        y[9] = y[3] = 1.0
        motion = at_rest.system.motion(y)
        lost = found.dissipated(motion, np.zeros(0))
        assert (3 * lost).contains(1)
        assert not lost.contains(arb(1 / 3))
        stored = found.stored(motion, np.zeros(0))
        assert (10 * stored).contains(1)
        assert not stored.contains(arb(0.1))


def test_code_without_formulas(folder):
    assert why_not_recorded(loaded(folder, ROPE, AT | {"k": 1.0})[0].system) is None
    other = ROPE.replace(
        "def guards(self, motion, own):",
        "def guards(self, motion, own):\n        if self.mode[0]:\n            return motion.X[:1]",
    )
    assert other != ROPE
    at_rest, _ = loaded(folder, other, AT | {"k": 1.0})
    assert "its event functions depend on its modes" in str(why_not_recorded(at_rest.system))
    text = TIE.replace("return f @ self.L_c @ f", "return f @ self.L_c @ f if f[0] > 0 else 0.0")
    at_rest, element = loaded(folder, text, KINDS["tie"][1])
    why = str(why_not_recorded(at_rest.system))
    assert "one is code of a user that cannot be recorded" in why
    with pytest.raises(NotRecordedError):
        recorded_element(at_rest, element, decimal_balls)
    timed = SPRING.replace("-self.k * motion.X", "-self.k * motion.time * motion.X")
    at_rest, element = loaded(folder, timed, {"k": 3.0})
    assert "a statement depends on the time" in str(why_not_recorded(at_rest.system))
    with pytest.raises(NotRecordedError):
        recorded_element(at_rest, element, decimal_balls)
    assert why_not_recorded(loaded(folder, *KINDS["tie"])[0].system) is None
