"""Protects the checker of forces of users that jump: true claims pass, false ones do not.

U = ½ |Θ - c|² + max(K (n'Θ - b), 0) has its rest state and region in closed form. So has the energy
with min(K (n'Θ - b), 0): two minima, and a pass on the ridge between them.
"""

import copy
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from support.kinks import plane, sphere

from rbstab.analysis.proof_check.checker import check
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.formulas.kinks import signs_over
from rbstab.analysis.proof_check.taylor import Taylor, centre_and_step

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


def random_ridges(
    rng: np.random.Generator, energy: dict[str, Any]
) -> tuple[dict[str, Any], list[Callable[[float, float], float]]]:
    """Return an energy with two kinks of which any may be ridges, and how each h is cut."""
    first, second = energy["kinks"]
    count = int(rng.integers(0, 3))
    cuts: list[Callable[[float, float], float]] = [max, max] if count == 0 else [max, min]
    cuts = [min, min] if count == 2 else cuts
    pairs = list(zip(cuts, (first, second), strict=True))
    kinks, ridges = ([one for cut, one in pairs if cut is kind] for kind in (max, min))
    return energy | {"kinks": kinks, "ridges": ridges}, cuts


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32))
def test_expansions_contain_the_energy_and_its_slopes(seed: int) -> None:
    """Against formulas in doubles, at random points of boxes across a plane and a sphere."""
    rng = np.random.default_rng(seed)
    energy, cuts = random_ridges(rng, energy_with(plane(NORMAL, OFFSET, COUPLE), sphere(0.6, 2.0)))
    U = Energy(energy)
    middle = rng.uniform(-0.6, 0.6, 3)
    reach = 10.0 ** rng.uniform(-4, -0.3) * rng.uniform(0.1, 1, 3)
    box = tuple((float(m - r), float(m + r)) for m, r in zip(middle, reach, strict=True))
    taylor = Taylor(U, box)
    gradient = taylor.whole_gradient.entries()
    below = taylor.below_valleys or taylor
    for _ in range(20):
        Theta = np.array([rng.uniform(low, high) for low, high in box])
        h = [COUPLE * (NORMAL @ Theta - OFFSET), 2.0 * (Theta @ Theta - 0.36)]
        slopes = [COUPLE * NORMAL, 4.0 * Theta]
        parts = [cut(one, 0.0) for cut, one in zip(cuts, h, strict=True)]
        value = 0.5 * np.sum((Theta - CENTRE) ** 2) + sum(parts)
        assert taylor.values.overlaps(arb(value, 1e-12))
        assert not taylor.stays_above(arb(value) + 1e-12)
        assert not below.values > arb(value) + 1e-12
        slope = Theta - CENTRE
        for one, part, other in zip(h, parts, slopes, strict=True):
            slope = slope + (part == one) * other
        ridges = [one for cut, one in zip(cuts, h, strict=True) if cut is min]
        for one, ridge in zip(ridges, U.kinks[-len(ridges) :], strict=False):
            assert int(np.sign(one)) in signs_over(ridge, *centre_and_step(box))
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
    U = Energy(random_ridges(rng, energy)[0])
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


WELL = np.array([0.2, 0.5, -0.1])
ACROSS = np.array([0.3, 1.0, 0.2])
EDGE, PUSH = 0.1, 0.5
STEEP = float(ACROSS @ ACROSS)
SHARE = (float(ACROSS @ WELL) - EDGE) / (PUSH * STEEP)
"""U = ½ |Θ - c|² + min(K (n'Θ - b), 0) has minima at c and c - Kn, and a pass at c - λKn."""
PASS = 0.5 * SHARE * SHARE * PUSH * PUSH * STEEP
SECOND = 0.5 * PUSH * PUSH * STEEP + PUSH * (float(ACROSS @ WELL) - PUSH * STEEP - EDGE)
assert 0 < SHARE < 1
assert 0 < SECOND < PASS < 0.5 * (math.pi / 2 - 0.5 - 0.5) ** 2


def two_wells() -> dict[str, Any]:
    energy = {"quadratic": np.eye(3).tolist(), "linear": (-WELL).tolist()}
    energy |= {"coefficients": [[[0.5 * float(WELL @ WELL)]]]}
    energy |= {"ridges": [{"name": "one", "operations": plane(ACROSS, EDGE, PUSH)}]}
    states = [
        state_at(WELL, held=False),
        state_at(WELL - PUSH * ACROSS, held=False),
        state_at(WELL - SHARE * PUSH * ACROSS) | {"index": 1, "ridge": True},
    ]
    wells = [
        {"rest_state": 1, "energy_bound": PASS - 1e-8, "lower_bound": PASS - 2e-8},
        {"rest_state": 2, "energy_bound": PASS - 1e-8, "lower_bound": PASS - SECOND - 2e-8},
    ]
    region = {"energy_bound": SECOND - 1e-8, "lower_bound": SECOND - 2e-8}
    claims = {"proved": True, "unique": False, "undecided": [], "region": region, "regions": wells}
    return claims | {"reduced_energy": energy, "unwrapped": None, "states": states}


BOTH_WELLS = [pytest.param(0, marks=pytest.mark.heavy), 1]


@pytest.mark.parametrize("well", BOTH_WELLS)
def test_a_well_and_its_region_up_to_the_ridge_are_verified(well: int) -> None:
    data = two_wells()
    data["regions"] = [data["regions"][well]]
    findings = check(data)
    assert [finding.text for finding in findings if not finding.verified] == []
    (flooded,) = (one for one in findings if one.claim == f"region of rest state {well + 1}")
    assert "r1" in flooded.covers["range"].tree


@pytest.mark.parametrize(
    "changes",
    [{"index": 0}, {"index": 2}, {"ridge": None}, {"held": None}, {"held": None, "ridge": None}],
    ids=str,
)
def test_false_claims_on_a_pass_on_a_ridge_are_refused(changes: dict[str, Any]) -> None:
    data = two_wells()
    data["states"][2] |= changes
    assert "rest states" in refused(data)


def test_a_ridge_is_claimed_of_no_other_state() -> None:
    data = two_wells()
    data["states"][0]["ridge"] = True
    assert "rest states" in refused(data)
    data = copy.deepcopy(PROOF)
    data["states"][0]["ridge"] = True
    assert "rest states" in refused(data)


def test_a_valley_is_no_ridge() -> None:
    data = two_wells()
    energy = data["reduced_energy"]
    energy["kinks"] = energy.pop("ridges")
    assert "rest states" in refused(data)


@pytest.mark.parametrize("left", [0, 1, 2])
def test_none_of_two_wells_and_their_pass_is_missed(left: int) -> None:
    data = two_wells() | {"region": None, "regions": []}
    del data["states"][left]
    assert refused(data) == {"no other rest state"}


@pytest.mark.parametrize("well", BOTH_WELLS)
def test_a_region_over_the_ridge_is_refused(well: int) -> None:
    data = two_wells()
    data["regions"] = [data["regions"][well]]
    data["regions"][0]["energy_bound"] += 1.2e-8
    assert refused(data) == {f"region of rest state {well + 1}"}


def test_a_region_over_the_other_well_is_refused() -> None:
    data = two_wells() | {"regions": []}
    data["region"]["energy_bound"] += 1.2e-8
    assert refused(data) == {"certified region"}
