"""Protects the answers of `prove_bound`: what is proved, the reasons, and the sentences."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from support.config_elements import HELD, config_data
from support.disturbed import COUPLE, FORCE, Held, full_config, sprung_config, tied_config

import rbstab
from rbstab.experiment.disturbed.prove_bound import prove_bound

HALF = Fraction(1, 2)
CASE_1 = tied_config("permanent")


@pytest.fixture(scope="module")
def bound():
    return prove_bound(CASE_1, {COUPLE: Fraction(100)}, HALF)


@pytest.mark.slow
def test_the_answer_is_said_in_numbers_that_are_not_better_than_proved(bound):
    assert bound.proved
    first, second = bound.statements
    head = "Any disturbance couple up to 100 N m keeps the tilt of this body below 0.5 rad for ever"
    assert first.startswith(
        f"{head}, from rest at Θ = 0, and from every start with less tilt and V < "
    )
    level = float(first.partition("V < ")[2].split()[0])
    assert 30 < level <= float(bound.claim.level)
    assert ": proved (" in first
    rest, _, forced = second.partition("V(0) + ")[2].split()[:3]
    assert float(rest) + float(forced) >= float(bound.claim.level)


@pytest.mark.slow
def test_v_at_the_start_is_that_of_the_equations(bound):
    held = Held(CASE_1)
    start = CASE_1.plain()["initial"]
    Theta, Omega = np.zeros((3, 1)), np.array(start["angular_velocity"], dtype=float)[:, None]
    expected = held.value(Theta, Omega, float(bound.claim.cross)).item()
    assert bound.start == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("angle", "speed", "is_inside"),
    # Beyond the tilt V is low only far away; within it a fast body has a high V.
    [(0.05, 0.0, True), (0.05, 20.0, False), (0.6, 0.0, False)],
)
def test_whether_a_start_is_one_of_those_is_said(angle, speed, is_inside):
    start = {"orientation": [angle, 0, 0], "angular_velocity": [speed, 0, 0]}
    config = rbstab.load_config(CASE_1.plain() | {"initial": start})
    bounded = prove_bound(config, {COUPLE: Fraction(100)}, HALF)
    assert bounded.as_data()["start_inside"] is is_inside
    assert ("is one of these starts" in bounded.statements[0]) is is_inside


@pytest.mark.slow
def test_v_falls_as_fast_as_it_is_said(bound):
    """V(t) <= e^(-αt)V(0) + ℓ(1 - f + f s²) under couples below a share s of the bound."""
    held, c = Held(CASE_1), bound.claim
    cross, rate, level = float(c.cross), float(c.rate), float(c.level)
    forced = float(c.weights[0] * c.sizes[0] ** 2 / (c.rate * c.level))
    assert 0.5 < forced < 1
    share = 0.6
    Theta = 0.2 * np.random.default_rng(0).normal(size=(3, 40))
    Theta = Theta[:, held.value(Theta, 0 * Theta, cross) < 0.9 * level]
    V0 = held.value(Theta, 0 * Theta, cross)

    def load(t, Theta, Omega):
        to = Omega + cross * held.pull(Theta)
        return share * 100.0 * to / np.linalg.norm(to + 1e-12, axis=0)

    motion = held.driven(Theta, 0 * Theta, load, 2.0, 4e-3)
    for k, (angles, Omega) in enumerate(motion, start=1):
        allowed = np.exp(-rate * 4e-3 * k) * V0 + level * (1 - forced + forced * share**2)
        assert np.all(held.value(angles, Omega, cross) <= allowed + 1e-6)


@pytest.mark.heavy
def test_too_large_a_couple_is_not_decided_and_the_largest_is_bracketed():
    bounded = prove_bound(CASE_1, {COUPLE: Fraction(150)}, HALF, largest=True)
    assert not bounded.proved
    assert (
        "not decided, as the best V that was found allows a couple up to 11"
        in bounded.statements[0]
    )
    largest: Any = bounded.largest
    assert largest.proved[0] >= 105
    assert largest.proved[0] < largest.undecided[0] < 121 < largest.broken[0] < 150
    assert bounded.as_data()["largest"]["proved"] == {
        "couple": float(largest.proved[0]),
        "force": None,
    }


@pytest.mark.slow
def test_a_body_of_many_parts_is_proved_under_a_couple_and_a_force():
    bounded = prove_bound(full_config(), {COUPLE: Fraction(30), FORCE: Fraction(20)}, HALF)
    assert bounded.proved
    assert (
        "couple up to 30 N m with any force up to 20 N at [0.1, 0.2, 0.4] m"
        in bounded.statements[0]
    )


@pytest.mark.slow
def test_springs_of_a_held_body_are_proved():
    assert prove_bound(sprung_config(), {COUPLE: Fraction(20)}, HALF).proved


GUST: dict[str, Any] = {
    "kind": "input",
    "quantity": "couple",
    "direction": [1, 0, 0],
    "amplitude": 3,
}
WEIGHTLESS = {"gravity": [0.0, 0.0, 0.0]}
GUST |= {"amplitude": 3, "signal": {"kind": "sine", "frequency": 1}}


@pytest.mark.slow
def test_inputs_are_left_out_and_this_is_said():
    config = rbstab.load_config(config_data({"gust": GUST}, HELD) | WEIGHTLESS)
    bounded = prove_bound(config, {COUPLE: Fraction(50)}, HALF)
    assert bounded.proved
    assert "the tilt of this body without its inputs below" in bounded.statements[0]


def test_another_desired_attitude_is_not_decided():
    data = config_data({}, HELD) | {"desired": {"orientation": [0.1, 0, 0]}}
    bounded = prove_bound(rbstab.load_config(data), {COUPLE: Fraction(50)}, HALF)
    assert not bounded.proved
    assert bounded.why == "the desired attitude is not Θ = 0, from where the tilt is counted"
    assert bounded.as_data()["level"] is None


def test_a_body_without_a_stiffness_of_attitude_is_not_decided():
    loose = {**HELD, "K_r": [0.0, 0.0, 0.0], "K_t": [0.0, 0.0, 0.0]}
    config = rbstab.load_config(config_data({}, loose) | WEIGHTLESS)
    bounded = prove_bound(config, {COUPLE: Fraction(1)}, HALF)
    assert bounded.why.startswith("no V of this form was found that falls")
