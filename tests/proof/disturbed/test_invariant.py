"""Protects that a proved bound on disturbances is never broken, and that it is as large as known.

Adversaries act on a held body in equations of the tests' own (`support.disturbed`).
"""

from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest
from support.disturbed import Held, forms_of_config, random_held, tied_config
from support.disturbed_balls import proves

from rbstab.mechanics.quaternion import angles
from rbstab.proof.disturbed.candidates import Samples
from rbstab.proof.disturbed.invariant import Claim, prove

FEW = 2500
"""Boxes; right claims on case 1 need fewer."""

CASE_1 = tied_config("permanent")


@cache
def claim_of(config, tilt, share):
    """Return the claim for a share of the largest couple of the samples, and the forms."""
    forms = forms_of_config(config)
    candidate = Samples(forms, float(tilt), [1.0]).candidate()
    size = Fraction(f"{share * candidate.factor:.4g}")
    return forms, candidate.claim(Fraction(tilt), [size], share)


@pytest.mark.slow
@pytest.mark.parametrize(("tilt", "couple"), [("0.5", 105), ("1.0", 195), ("1.5", 290)])
def test_couples_that_are_known_to_be_safe_are_proved(tilt, couple):
    """The couples were found by another program, for |Θ| in place of the tilt."""
    forms = forms_of_config(CASE_1)
    candidate = Samples(forms, float(tilt), [1.0]).candidate()
    assert candidate.factor > couple
    claim = candidate.claim(Fraction(tilt), [Fraction(couple)], couple / candidate.factor)
    assert prove(forms, claim).proved


@pytest.mark.slow
def test_a_tied_body_is_proved():
    forms, claim = claim_of(tied_config("visco-elastic"), "0.5", 0.9)
    assert claim.sizes[0] > 95
    assert prove(forms, claim).proved


@pytest.mark.heavy
@pytest.mark.parametrize("config", [CASE_1, random_held(2)], ids=["case 1", "random"])
def test_formulas_by_hand_in_balls_prove_the_same_claim_and_no_larger_one(config):
    forms, claim = claim_of(config, "0.5", 0.85)
    assert prove(forms, claim).proved
    assert proves(Held(config), claim)[0]
    larger = replace(claim, sizes=(claim.sizes[0] * Fraction(13, 10),))
    assert not proves(Held(config), larger, 300)[0]


def starts_on(held, claim, rng, count):
    """Return states with V just below ℓ and a tilt below ρ."""
    level, cross = float(claim.level), float(claim.cross)
    axes = rng.normal(size=(3, count))
    axes /= np.linalg.norm(axes, axis=0)
    half = 0.5 * float(claim.tilt) * rng.random(count)
    Theta, _ = angles(np.cos(half), np.sin(half) * axes)
    away = rng.normal(size=(3, count))
    low, high = np.zeros(count), np.full(count, 1e3)
    center = -cross * held.pull(Theta)  # where V is least at Θ
    room = held.value(Theta, center, cross) < level
    for _ in range(60):
        middle = 0.5 * (low + high)
        below = held.value(Theta, center + middle * away, cross) < level
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    Omega = center + 0.999999 * low * away
    return Theta[:, room], Omega[:, room]


def unit(x):
    return x / np.maximum(np.linalg.norm(x, axis=0), 1e-12)


def adversaries(cross):
    """Return directions of a couple that work against the proof: c1 Ω + c2 B⁻¹Θ + c3 fixed."""
    return {
        "raises V fastest": (1.0, cross, 0.0),
        "drives": (1.0, 0.0, 0.0),
        "pulls outwards": (0.2, 1.0, 0.0),
        "never changes": (0.0, 0.0, 1.0),
        "jumps": (0.0, 0.0, lambda t: np.sign(np.sin(7.0 * t))),
    }


BODIES = [
    pytest.param(CASE_1, "0.5", id="case 1", marks=pytest.mark.slow),
    pytest.param(random_held(0), "1.2", id="random", marks=pytest.mark.slow),
    pytest.param(random_held(1), "0.5", id="another", marks=pytest.mark.heavy),
    pytest.param(random_held(2), "1.2", id="a third", marks=pytest.mark.heavy),
    pytest.param(CASE_1, "1.5", id="far", marks=pytest.mark.heavy),
]


@pytest.mark.parametrize(("config", "tilt"), BODIES)
def test_no_adversary_breaks_what_is_proved(config, tilt):
    forms, claim = claim_of(config, tilt, 0.9)
    assert prove(forms, claim).proved
    held, rng = Held(config), np.random.default_rng(3)
    cross, level, size = float(claim.cross), float(claim.level), float(claim.sizes[0])
    fixed, reached = rng.normal(size=(3, 1)), 0.0
    for way in adversaries(cross).values():
        angles_at_start, rates_at_start = starts_on(held, claim, rng, 40)
        assert angles_at_start.shape[1] > 10

        def load(t, Theta, Omega, way=way):
            c1, c2, c3 = way
            course = c3(t) if callable(c3) else c3
            return size * unit(c1 * Omega + c2 * held.pull(Theta) + course * fixed)

        for Theta, Omega in held.driven(angles_at_start, rates_at_start, load, 1.2, 4e-3):
            V = held.value(Theta, Omega, cross)
            reached = max(reached, float(V.max()) / level)
            assert np.all(level * (1 + 1e-9) > V)
            assert np.all(held.tilt(Theta) < float(tilt))
    assert reached > 0.99


RANDOM = random_held(0)


@pytest.mark.parametrize(
    "config",
    [
        pytest.param(CASE_1, id="case 1", marks=pytest.mark.slow),
        pytest.param(RANDOM, id="random", marks=pytest.mark.heavy),
    ],
)
def test_couples_that_break_the_bound_are_never_proved(config):
    """A couple that follows the motion drives the body beyond the tilt: no claim is proved."""
    forms, claim = claim_of(config, "0.5", 0.9)
    held, size = Held(config), 1.45 / 0.9 * float(claim.sizes[0])

    def load(t, Theta, Omega):
        return size * unit(np.linalg.solve(held.J, Omega))

    away = 0.01 * np.random.default_rng(0).normal(size=(3, 40))
    motion = held.driven(0 * away, away, load, 3.0, 5e-3)
    assert max(held.tilt(Theta).max() for Theta, _ in motion) > 0.5
    broken = Fraction(f"{size:.4g}")
    for level, weight in ((0.8, 0.95), (1.05, 0.6)):
        changed = claim.level * Fraction(str(level))
        beta = claim.rate * changed * Fraction(str(weight)) / broken**2
        wrong = replace(claim, sizes=(broken,), level=changed, weights=(beta,))
        assert not prove(forms, wrong, FEW).proved


@pytest.mark.slow
def test_few_boxes_are_enough_for_a_right_claim():
    forms, claim = claim_of(CASE_1, "0.5", 0.9)
    assert prove(forms, claim, FEW).proved


WRONG: dict[str, Any] = {
    "a larger level": {"level": Fraction(60)},
    "a faster rate": {"rate": Fraction(8)},
    "a larger cross term": {"cross": Fraction(6)},
    "a smaller weight": {"weights": (Fraction(1, 1000),)},
    "a larger weight": {"weights": (Fraction(1),)},
    "a smaller tilt": {"tilt": Fraction(2, 5)},
}


@pytest.mark.slow
@pytest.mark.parametrize("what", WRONG)
def test_a_claim_with_a_wrong_number_is_not_proved(what):
    forms, claim = claim_of(CASE_1, "0.5", 0.9)
    proof = prove(forms, replace(claim, **WRONG[what]), FEW)
    assert not proof.proved
    assert proof.where is not None


def test_no_claim_with_a_negative_number_or_a_large_tilt_is_tried():
    forms, claim = claim_of(CASE_1, "0.5", 0.9)
    changes = ({"level": Fraction(-1)}, {"weights": (Fraction(0),)}, {"tilt": Fraction(8, 5)})
    for change in changes:
        with pytest.raises(ValueError, match="no claim"):
            prove(forms, replace(claim, **change))
    assert isinstance(claim, Claim)
