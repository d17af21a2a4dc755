"""Protects the checker of forces of users that jump: true claims pass, false ones do not.

U = ½ |Θ - c|² + max(K (n'Θ - b), 0) has its rest state and region in closed form.
"""

import copy
import math
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from support.kinks import plane, sphere

from rbstab.analysis.proof_check.checker import check
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.taylor import Taylor

CENTRE = np.array([0.3, 1.0, -0.2])
NORMAL = np.array([0.0, 1.0, 0.5])
OFFSET, COUPLE = 0.4, 5.0
GAP = float(NORMAL @ CENTRE) - OFFSET
STATE = CENTRE - GAP / float(NORMAL @ NORMAL) * NORMAL
LEAST = 0.5 * GAP * GAP / float(NORMAL @ NORMAL)

# On the face θ2 = π/2 U is least on the plane too.
ON_FACE = (OFFSET - math.pi / 2) / 0.5
BORDER = 0.5 * (math.pi / 2 - 1.0) ** 2 + 0.5 * (ON_FACE + 0.2) ** 2
assert 0.5 * (math.pi - 0.3) ** 2 > BORDER
assert abs(ON_FACE + 0.2) < COUPLE * 0.5


@pytest.fixture(autouse=True)
def _precision() -> Any:
    with ctx.workprec(128):
        yield


def energy_with(*operations: Any) -> dict[str, Any]:
    constant = 0.5 * float(CENTRE @ CENTRE)
    kinks = [{"name": "one", "operations": one} for one in operations]
    energy = {"quadratic": np.eye(3).tolist(), "linear": (-CENTRE).tolist()}
    return energy | {"coefficients": [[[constant]]], "kinks": kinks}


def state_at(Theta: Any, *, held: bool = True) -> dict[str, Any]:
    Theta = np.array(Theta, dtype=float)
    state = {"index": 0, "index_proved": True, "orientation": Theta.tolist(), "proved": True}
    state["enclosure"] = [(Theta - 1e-9).tolist(), (Theta + 1e-9).tolist()]
    return state | ({"held": True} if held else {})


def proof_of(energy: dict[str, Any], state: dict[str, Any], border: float) -> dict[str, Any]:
    region = {"energy_bound": border - 1e-9, "lower_bound": border - LEAST - 2e-8}
    claims = {"proved": True, "unique": True, "states": [state], "undecided": []}
    claims |= {"region": region, "regions": [region | {"rest_state": 1}]}
    return claims | {"reduced_energy": energy, "unwrapped": None}


PROOF = proof_of(energy_with(plane(NORMAL, OFFSET, COUPLE)), state_at(STATE), BORDER)


def refused(data: dict[str, Any]) -> set[str]:
    return {finding.claim for finding in check(data) if not finding.verified}


def test_true_claims_are_verified() -> None:
    findings = check(PROOF)
    assert [finding.text for finding in findings if not finding.verified] == []
    claims = {finding.claim for finding in findings}
    assert claims == {
        "rest states",
        "no other rest state",
        "certified region",
        "region of rest state 1",
    }


@pytest.mark.parametrize(
    "changes",
    [
        {"index": 1},
        {"held": None},
        {"orientation": (STATE + np.array([0, 1e-3, 0])).tolist()},
        state_at(STATE + 0.01 * NORMAL),
        state_at(STATE + np.array([0.01, 0, 0])),
        state_at(STATE + np.array([0, 0.5e-3, -1e-3])),
    ],
    ids=["index", "not held", "point", "not on the plane", "not at rest", "aside on the plane"],
)
def test_false_claims_on_the_state_are_refused(changes: dict[str, Any]) -> None:
    data = copy.deepcopy(PROOF)
    data["states"][0] |= changes
    assert "rest states" in refused(data)


@pytest.mark.parametrize("couple", [1.0, GAP / 1.25, 0.6])
def test_a_plane_that_is_too_weak_does_not_hold(couple: float) -> None:
    """λ would be above 1, or at its end."""
    data = copy.deepcopy(PROOF)
    data["reduced_energy"] = energy_with(plane(NORMAL, OFFSET, 0.4 * couple))
    assert "rest states" in refused(data)


def test_a_plane_that_is_not_pressed_does_not_hold() -> None:
    data = copy.deepcopy(PROOF)
    data["reduced_energy"] = energy_with(plane(-NORMAL, -OFFSET, COUPLE))
    assert "rest states" in refused(data)


def test_a_region_that_is_too_large_is_refused() -> None:
    data = copy.deepcopy(PROOF)
    data["region"]["energy_bound"] += 2e-9
    assert refused(data) == {"certified region"}
    data = copy.deepcopy(PROOF)
    data["regions"][0]["lower_bound"] += 4e-8
    assert refused(data) == {"region of rest state 1"}
    data = copy.deepcopy(PROOF)
    data["regions"][0]["energy_bound"] += 2e-9
    assert "region of rest state 1" in refused(data)


def test_a_state_that_is_left_out_is_missed_by_no_cover() -> None:
    data = copy.deepcopy(PROOF) | {"states": [], "unique": False, "region": None, "regions": []}
    assert "no other rest state" in refused(data)


def test_other_states_on_the_surface_are_not_missed() -> None:
    """All weights are below zero: a sphere holds at ±r on each axis; one of them is listed."""
    energy = energy_with(sphere(0.5, 2.0))
    energy |= {"quadratic": (-np.diag([1.0, 2.0, 3.0])).tolist(), "linear": [0.0, 0.0, 0.0]}
    listed = [
        state_at(sign * 0.5 * np.eye(3)[axis]) | {"index": 2 - axis}
        for axis in range(3)
        for sign in (1, -1)
    ]
    centre = state_at(np.zeros(3), held=False) | {"index": 3}
    claims = {"proved": True, "unique": False, "undecided": [], "region": None, "regions": []}
    data = claims | {"reduced_energy": energy, "unwrapped": None, "states": [*listed, centre]}
    assert refused(data) == set()
    for k in range(6):
        left = [one for place, one in enumerate(listed) if place != k]
        assert refused(data | {"states": [*left, centre]}) == {"no other rest state"}
    wrong = [listed[0] | {"index": 1}, *listed[1:], centre]
    assert refused(data | {"states": wrong}) == {"rest states"}


def test_what_is_no_formula_is_refused() -> None:
    data = copy.deepcopy(PROOF)
    data["reduced_energy"]["kinks"][0]["operations"][3] = ["*", 7, 2]
    assert refused(data) == {"energy"}


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32))
def test_expansions_contain_the_energy_and_its_slopes(seed: int) -> None:
    """Against formulas in doubles, at random points of boxes across a plane and a sphere."""
    rng = np.random.default_rng(seed)
    U = Energy(energy_with(plane(NORMAL, OFFSET, COUPLE), sphere(0.6, 2.0)))
    middle = rng.uniform(-0.6, 0.6, 3)
    reach = 10.0 ** rng.uniform(-4, -0.3) * rng.uniform(0.1, 1, 3)
    box = tuple((float(m - r), float(m + r)) for m, r in zip(middle, reach, strict=True))
    taylor = Taylor(U, box)
    gradient = taylor.whole_gradient.entries()
    below = taylor.smooth_below if taylor.jumping else taylor
    for _ in range(20):
        Theta = np.array([rng.uniform(low, high) for low, high in box])
        h = [COUPLE * (NORMAL @ Theta - OFFSET), 2.0 * (Theta @ Theta - 0.36)]
        slopes = [COUPLE * NORMAL, 4.0 * Theta]
        value = 0.5 * np.sum((Theta - CENTRE) ** 2) + max(h[0], 0.0) + max(h[1], 0.0)
        assert taylor.values.overlaps(arb(value, 1e-12))
        assert not taylor.stays_above(arb(value) + 1e-12)
        assert not below.values > arb(value) + 1e-12
        slope = Theta - CENTRE
        for one, other in zip(h, slopes, strict=True):
            slope = slope + (one > 0) * other
        for entry, exact in zip(gradient, slope, strict=True):
            assert entry.overlaps(arb(exact, 1e-12))
    if taylor.jumping:
        assert not any(entry.is_finite() for entry in taylor.whole_hessian.entries())


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32))
def test_a_box_with_a_rest_state_is_never_excluded(seed: int) -> None:
    """The load is chosen so that the body is held at a point of a plane and of a sphere, or one."""
    rng = np.random.default_rng(seed)
    Theta = rng.uniform(-0.8, 0.8, 3)
    normal = rng.uniform(-1, 1, 3)
    couples = 10.0 ** rng.uniform(-1, 1.5, 2)
    shares = rng.uniform(0, 1, 2) * [1, rng.integers(0, 2)]
    parts = [
        plane(normal, float(normal @ Theta), couples[0]),
        sphere(float(np.linalg.norm(Theta)), couples[1]),
    ]
    energy = energy_with(*parts)
    bent = rng.uniform(-2, 2, (3, 3))
    bent = bent + bent.T
    force = bent @ Theta + shares[0] * couples[0] * normal + shares[1] * couples[1] * 2 * Theta
    energy |= {"quadratic": bent.tolist(), "linear": (-force).tolist()}
    U = Energy(energy)
    for _ in range(5):
        reach = 10.0 ** rng.uniform(-6, -0.5, (2, 3))
        box = tuple((float(t - a), float(t + b)) for t, a, b in zip(Theta, *reach, strict=True))
        taylor = Taylor(U, box)
        assert not taylor.excludes_jumps
        assert all(entry.contains(0) for entry in taylor.whole_gradient.entries())


@pytest.mark.parametrize("share", [0.2, 0.8])
def test_states_on_both_sides_of_a_held_one_are_not_missed(share: float) -> None:
    """U = -½ θ1² + max(θ1 - λ, 0) + ...: all is linear, and λ is 0 or 1 at the other two."""
    energy = energy_with(plane([1.0, 0.0, 0.0], share, 1.0))
    energy |= {"quadratic": np.diag([-1.0, 1.0, 1.0]).tolist(), "linear": [0.0, 0.0, 0.0]}
    states = [
        state_at(np.zeros(3), held=False) | {"index": 1},
        state_at([share, 0.0, 0.0]),
        state_at([1.0, 0.0, 0.0], held=False) | {"index": 1},
    ]
    claims = {"proved": True, "unique": False, "undecided": [], "region": None, "regions": []}
    data = claims | {"reduced_energy": energy, "unwrapped": None, "states": states}
    assert refused(data) == set()
    for left in ([0, 1], [1, 2], [0, 2]):
        assert refused(data | {"states": [states[k] for k in left]}) == {"no other rest state"}
