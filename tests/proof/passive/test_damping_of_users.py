"""Protects which motions the elements of users are shown to damp: only those that they do."""

import pytest
from support.config_elements import HELD, config_data
from support.user_code import CREEPING_TIE, MAXWELL, SPRING, TIE, element_text, python_section

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.proof.passive.damping import NOTHING, Damping, damping_of_users, why_not_damped

K = [[3.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 4.0]]
AT = {"point": [0.1, 0.2, -0.1], "anchor": [0.0, 0.3, 1.1]}


def damper(wrench, power):
    """Return the text of an element that only damps."""
    return element_text(
        f"""
        def wrench(self, motion, states):
            return {wrench}

        def dissipated(self, motion, states):
            return {power}
        """,
        'Gain("L", "1", "damping", positive=False)',
    )


BRAKE = damper("couple_on_body(-self.L @ motion.Omega)", "motion.Omega @ self.L @ motion.Omega")


QUADRATIC = damper(
    "force_at_centre(-sqrt(0.1 + motion.V @ motion.V) * motion.V)",
    "sqrt(0.1 + motion.V @ motion.V) * (motion.V @ motion.V)",
)


CASES = {
    "brake": (BRAKE, {"L": K}, Damping(True, False)),
    "a brake without one axis": (BRAKE, {"L": [1.0, 0.0, 1.0]}, NOTHING),
    "quadratic drag": (QUADRATIC, {"L": K}, Damping(False, True)),
    "tie": (TIE, AT | {"K_c": K, "L_c": K}, Damping(False, True)),
    "creeping tie": (
        CREEPING_TIE.read_text(encoding="utf-8").replace("CreepingTie", "Mine"),
        AT | {"K_c": K, "L_c": K, "K_d": K, "L_d": [1.0, 2.0, 3.0]},
        Damping(False, True),
    ),
    "spring": (SPRING, {"k": 3.0}, NOTHING),
    "what is not passive": (SPRING.replace("0.5", "0.6"), {"k": 3.0}, NOTHING),
}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def system_with(folder, text, parameters, **controller):
    (folder / "mine.py").write_text(text)
    data = config_data({"one": python_section(**parameters)}, controller or None)
    return problem_of(load_config(data, allow_python=True)).system


@pytest.mark.parametrize("name", CASES)
def test_what_is_damped(folder, name):
    text, parameters, expected = CASES[name]
    system = system_with(folder, text, parameters)
    assert damping_of_users(system) == expected
    assert why_not_damped(system) is not None
    assert why_not_damped(system, expected) is not None


def test_what_is_damped_of_a_held_body(folder):
    """V follows from Ω. A damper at one point leaves the turning about it free."""
    brake = system_with(folder, BRAKE, {"L": K}, **HELD)
    assert damping_of_users(brake).turning
    tie = system_with(folder, TIE, AT | {"K_c": K, "L_c": K}, **HELD)
    assert damping_of_users(tie) == NOTHING
    maxwell = system_with(folder, MAXWELL, AT | {"k": 3.0, "c": 2.0}, **HELD)
    assert damping_of_users(maxwell) == NOTHING
