"""Protects soft guards that are found for a start: the least strength, and what is said of it.

The energies are those of runs and closed forms; motions below the bound are integrated.
"""

import math
from typing import Any

import numpy as np
import pytest
from support.paper_runs import paper_config

from rbstab.config.load import load_config
from rbstab.experiment.simulate import simulate
from rbstab.experiment.tuning import guard as guards
from rbstab.experiment.tuning import soft_guard as searching
from rbstab.experiment.tuning.soft_guard import NotDecidedError, SoftLaw, unguarded
from rbstab.integrate.status import RunStatus

guard: Any = guards.guard

SHORT: dict[str, Any] = {"duration": 0.4, "samples": 81, "rtol": 1e-8}


def config(
    elements=None,
    soft=1.0,
    variant="permanent",
    **initial,
):
    data = paper_config(variant, **SHORT)
    data["controller"]["K_r"] = [soft * gain for gain in data["controller"]["K_r"]]
    data["initial"] = data["initial"] | initial
    return load_config(data | {"schema_version": 2, "elements": elements or {}})


ROOM: dict[str, Any] = {
    "stiff": lambda angle, start: (math.pi / 2 - angle) ** 2 / 2 - max(0, start - angle) ** 2 / 2,
    "repelling": lambda angle, start: math.pi / 2 - max(angle, start),
}


@pytest.mark.parametrize("method", ROOM)
def test_the_least_strength_has_three_digits_and_less_is_not_proved(method):
    """At the start the guard has energy already, 5 % of that at the border or more."""
    angle, pitch = 0.7, -0.9
    given = config(orientation=[0.0, pitch, 0.0])
    guarded = guard(given, method, angle)
    energy = simulate(given)["energy"][0].sum()
    border = guarded.kept.energy_bound - guarded.strength * ROOM[method](angle, 0.0)
    least = (energy - border) / ROOM[method](angle, abs(pitch))
    assert float(f"{guarded.strength:.3g}") == guarded.strength
    unit = 10.0 ** (math.floor(math.log10(guarded.strength)) - 2)
    assert least <= guarded.strength <= least + 1.0001 * unit
    added = guarded.strength * (ROOM[method](angle, 0.0) - ROOM[method](angle, abs(pitch)))
    assert guarded.kept.energy == pytest.approx(energy + added, rel=1e-12)
    start = unguarded(given)
    assert start.keeps_range(SoftLaw(method, guarded.strength, angle))
    assert not start.keeps_range(SoftLaw(method, 0.985 * guarded.strength, angle))


def test_a_fast_body_leaves_the_range_and_not_with_a_guard():
    """The numbers say nothing of convergence within 0.4 s: that is proved, not seen."""
    given = config(variant="free", angular_velocity=[0.0, 32.0, 0.0])
    guarded = guard(given, "stiff", 1.3)
    assert guarded.given.status is RunStatus.RANGE_LEFT
    assert guarded.guarded.status is RunStatus.COMPLETED
    assert 1.3 < guarded.guarded.largest_pitch < math.pi / 2
    assert guarded.guarded.settling_time != guarded.guarded.settling_time
    excess = guarded.guarded.largest_pitch - 1.3
    assert guarded.guarded.largest_couple == pytest.approx(guarded.strength * excess, rel=1e-9)
    run = simulate(guarded.config)
    couples = np.linalg.norm(run["element_couple"][:, 0], axis=1)
    assert couples.max() <= guarded.guarded.largest_couple <= guarded.couple_bound
    assert guarded.couple_bound == pytest.approx(guarded.strength * (math.pi / 2 - 1.3))
    assert len(guarded.kept.states) == 1
    assert guarded.kept.convergence == "to the rest state at Θ = (0, 0, 0) rad: proved"


def test_what_is_not_decided_says_why():
    spring: dict[str, Any] = {"kind": "spring", "point": [0, 0, 0.1], "anchor": [0, 0, 0.5]}
    spring |= {"stiffness": 100.0, "rest_length": 0.3}
    guarded = guard(config({"strut": spring}), "stiff")
    assert (guarded.config, guarded.strength, guarded.kept) == (None, None, None)
    assert guarded.reason is not None
    assert guarded.reason.startswith("the least soft guard is not looked for beside springs")
    soft = guard(config(soft=0.15), "stiff")
    assert soft.config is not None
    assert soft.kept.states == ()
    assert (
        soft.kept.convergence == "not decided: a rest state beyond the soft angle is not excluded"
    )
    start = ["initial.orientation=[0, 1.5707963267, 0]", "integration.range_bound=1e-12"]
    close = guard(load_config(config(), start), "stiff")
    assert close.reason == "the start is too close to θ2 = ±π/2 for a soft guard"


def test_a_refusal_of_the_checker_is_not_called_proved(monkeypatch):
    true: Any = searching.energy_bound  # type: ignore[attr-defined]
    monkeypatch.setattr(searching, "energy_bound", lambda *args: true(*args) + 1e-3)
    guarded = guard(config(), "stiff")
    assert guarded.config is None
    assert guarded.reason.startswith("the checker refuses it: Every motion with an energy below")


def test_a_body_whose_proof_is_about_rotations_has_no_soft_guard():
    spring = {"kind": "attitude", "K": [70, 50, 30], "L": [6, 6, 4]}
    with pytest.raises(NotDecidedError, match="no element reads Euler angles"):
        unguarded(config({"up": spring}, soft=0.0))
