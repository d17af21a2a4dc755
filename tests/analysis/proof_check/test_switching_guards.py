"""Protects the checker of proofs with soft guards and stops: true claims pass, false ones do not.

U = ½ |Θ - c|² with guards has rest states and regions in closed form.
"""

import copy
import math
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st

from rbstab.analysis.proof_check.checker import check
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.guards import SwitchingGuard
from rbstab.analysis.proof_check.taylor import Taylor

ANGLE = 0.5
CENTRE = (0.3, 0.7, -0.2)

REPELLING = {"soft_guards": [{"couple": 5.0, "stiffness": 0.0, "soft_angle": ANGLE}]}
STIFF = {"soft_guards": [{"couple": 0.0, "stiffness": 3.0, "soft_angle": ANGLE}]}
STOP = {"stop": ANGLE}


@pytest.fixture(autouse=True)
def _precision() -> Any:
    with ctx.workprec(128):
        yield


def proof(guards: dict[str, Any], pitch: float, held: bool, border: float) -> dict[str, Any]:
    """Return a proof with one rest state, and the least energy on the border, J."""
    Theta = [CENTRE[0], pitch, CENTRE[2]]
    least = 0.5 * (CENTRE[1] - pitch) ** 2
    if guards is STIFF:
        least += 1.5 * (pitch - ANGLE) ** 2
    region = {"energy_bound": border - 1e-9, "lower_bound": border - least - 2e-9}
    state = {"index": 0, "index_proved": True, "orientation": Theta, "proved": True}
    size = np.array([1e-9, 1e-15 if held else 1e-9, 1e-9])
    state["enclosure"] = [(Theta - size).tolist(), (Theta + size).tolist()]
    if held:
        state["held"] = True
    claims = {"proved": True, "unique": True, "states": [state], "undecided": []}
    claims |= {"region": region, "regions": [region | {"rest_state": 1}]}
    constant = 0.5 * sum(x * x for x in CENTRE)
    energy = {"quadratic": np.eye(3).tolist(), "linear": [-x for x in CENTRE]}
    energy |= {"coefficients": [[[constant]]], **guards}
    wide = copy.deepcopy(claims) | {"end": [4.0, math.pi / 2, 4.0]}
    wide["region"] = None
    wide["regions"] = []
    return claims | {"reduced_energy": energy, "unwrapped": wide}


def half(x: float) -> float:
    return 0.5 * x * x


AT_END = half(math.pi / 2 - CENTRE[1])
AT_FACE = half(math.pi - CENTRE[0])

PROOFS = {
    "repelling": proof(REPELLING, ANGLE, True, AT_FACE + half(0.2)),
    "stiff": proof(STIFF, (0.7 + 3 * ANGLE) / 4, False, AT_END + 1.5 * (math.pi / 2 - ANGLE) ** 2),
    "stop": proof(STOP, ANGLE, True, AT_FACE + half(0.2)),
}
# With θ2 = π/2 the energy of the repelling guard is larger than that on the other faces.
assert half(math.pi / 2 - 0.7) + 5 * (math.pi / 2 - ANGLE) > AT_FACE


def refused(data: dict[str, Any]) -> set[str]:
    return {finding.claim for finding in check(data) if not finding.verified}


@pytest.mark.parametrize("kind", PROOFS)
def test_true_claims_are_verified(kind: str) -> None:
    findings = check(PROOFS[kind])
    assert [finding.text for finding in findings if not finding.verified] == []
    claims = {finding.claim for finding in findings}
    assert {"rest states", "no other rest state", "certified region"} <= claims
    assert ("stop" in claims) == (kind == "stop")


def changed(kind: str, **changes: Any) -> dict[str, Any]:
    """Return a proof with other claims on its rest state, in both ranges."""
    data = copy.deepcopy(PROOFS[kind])
    for claims in (data, data["unwrapped"]):
        claims["states"][0] |= changes
    return data


@pytest.mark.parametrize("kind", ["repelling", "stop"])
@pytest.mark.parametrize(
    "changes",
    [
        {"index": 1},
        {"held": None},
        {"orientation": [0.3, 0.6, -0.2]},
        {
            "enclosure": [[0.29, 0.51, -0.21], [0.31, 0.52, -0.19]],
            "orientation": [0.3, 0.515, -0.2],
        },
        {
            "enclosure": [[0.31, 0.49, -0.21], [0.32, 0.51, -0.19]],
            "orientation": [0.315, 0.5, -0.2],
        },
    ],
    ids=["index", "not held", "point", "not at the angle", "not balanced"],
)
def test_false_claims_on_a_held_state_are_refused(kind: str, changes: dict[str, Any]) -> None:
    assert "rest states" in refused(changed(kind, **changes))


def test_a_state_is_not_held_where_nothing_jumps() -> None:
    assert "rest states" in refused(changed("stiff", held=True))


@pytest.mark.parametrize("kind", PROOFS)
def test_a_region_that_is_too_large_is_refused(kind: str) -> None:
    data = copy.deepcopy(PROOFS[kind])
    data["region"]["energy_bound"] += 2e-9
    assert refused(data) == {"certified region"}
    data = copy.deepcopy(PROOFS[kind])
    data["regions"][0]["lower_bound"] += 3e-9
    assert refused(data) == {"region of rest state 1"}


@pytest.mark.parametrize("couple", [0.1, 0.2, 0.19999999])
def test_a_guard_that_is_too_weak_does_not_hold(couple: float) -> None:
    data = copy.deepcopy(PROOFS["repelling"])
    data["reduced_energy"]["soft_guards"][0]["couple"] = couple
    assert "rest states" in refused(data)


def test_a_load_that_pulls_off_the_stop_is_not_held() -> None:
    data = copy.deepcopy(PROOFS["stop"])
    data["reduced_energy"]["linear"][1] = -0.4
    assert "rest states" in refused(data)


def test_a_second_rest_state_at_a_kink_is_missed_by_no_cover() -> None:
    """The listed state is the one at the stop; a claim without it leaves a box open."""
    data = copy.deepcopy(PROOFS["stop"])
    for claims in (data, data["unwrapped"]):
        claims |= {"states": [], "unique": False, "region": None, "regions": []}
    assert "no other rest state" in refused(data)


def test_other_held_states_beside_a_listed_one_are_not_missed() -> None:
    """With cos 2θ1 there are three states at the stop; the listed one is the saddle between."""
    data = copy.deepcopy(PROOFS["stop"])
    energy = data["reduced_energy"]
    coefficients = np.zeros((5, 5, 5))
    coefficients[3, 0, 0] = 0.5  # cos 2θ1: θ1 = sin 2θ1 has three solutions
    # The stop is pressed at all these angles: without the test in θ1 and θ3, they were one place.
    energy |= {"coefficients": coefficients.tolist(), "linear": [0.0, -3.0, 0.2]}
    for claims in (data, data["unwrapped"]):
        (state,) = claims["states"]
        state |= {"index": 1, "orientation": [0.0, ANGLE, -0.2]}
        state["enclosure"][0][0], state["enclosure"][1][0] = -1e-9, 1e-9
        claims |= {"region": None, "regions": []}
    assert refused(data) == {"no other rest state"}


def test_every_start_needs_a_stop_or_a_barrier() -> None:
    for kind, wanted in (("stop", set()), ("repelling", {"every start"})):
        data = copy.deepcopy(PROOFS[kind])
        data["unwrapped"]["every_start"] = True
        assert refused(data) == wanted


@pytest.mark.parametrize(
    "guards",
    [
        {"soft_guards": [{"couple": -1.0, "stiffness": 0.0, "soft_angle": 0.5}]},
        {"soft_guards": [{"couple": 0.0, "stiffness": -1.0, "soft_angle": 0.5}]},
        {"soft_guards": [{"couple": 1.0, "stiffness": 1.0, "soft_angle": 1.6}]},
        {"soft_guards": [{"couple": 1.0, "stiffness": 1.0, "soft_angle": 0.5}] * 21},
        {"stop": 1.6},
        {"stop": -0.1},
    ],
)
def test_energies_without_a_meaning_are_refused(guards: dict[str, Any]) -> None:
    data = copy.deepcopy(PROOFS["repelling"])
    data["reduced_energy"] |= guards
    assert refused(data) == {"energy"}


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32))
def test_expansions_contain_the_energy_and_its_slopes(seed: int) -> None:
    """Against formulas in doubles, at random points of boxes that contain a soft angle, or not."""
    rng = np.random.default_rng(seed)
    soft = [
        {"couple": 4.0 * rng.integers(0, 2), "stiffness": 9.0 * rng.integers(0, 2), "soft_angle": a}
        for a in rng.uniform(0.2, 0.9, 2).tolist()
    ]
    data = PROOFS["stop"]["reduced_energy"] | {"soft_guards": soft, "stop": 1.0}
    U, end = Energy(data), 1.0
    size = 10.0 ** rng.uniform(-4, 0)
    place = rng.choice([-1, 1]) * rng.choice([soft[0]["soft_angle"], soft[1]["soft_angle"], 1.0])
    ends = np.clip(place + size * np.sort(rng.uniform(-1, 1, 2)), -end, end)
    box = ((0.1, 0.2), (float(ends[0]), float(ends[1])), (-0.4, 0.4))
    taylor = Taylor(U, box)
    gradient = taylor.whole_gradient.entries()
    for _ in range(20):
        Theta = np.array([rng.uniform(low, high) for low, high in box])
        excess = [max(abs(Theta[1]) - one["soft_angle"], 0.0) for one in soft]
        value = 0.5 * np.sum((Theta - CENTRE) ** 2)
        slope = Theta[1] - CENTRE[1]
        for one, e in zip(soft, excess, strict=True):
            value += one["couple"] * e + 0.5 * one["stiffness"] * e * e
            slope += np.sign(Theta[1]) * (e > 0) * (one["couple"] + one["stiffness"] * e)
        near = arb(value, 1e-12)
        assert taylor.values.overlaps(near)
        assert not taylor.stays_above(arb(value) + 1e-12)
        assert gradient[1].overlaps(arb(slope, 1e-12)) or not gradient[1].is_finite()
        hessian = 1 + sum(one["stiffness"] * (e > 0) for one, e in zip(soft, excess, strict=True))
        whole = taylor.whole_hessian[1, 1]
        assert whole.overlaps(arb(hessian, 1e-12)) or not whole.is_finite()


def test_a_line_below_makes_thin_boxes_unnecessary_at_a_kink() -> None:
    U = Energy(PROOFS["repelling"]["reduced_energy"])
    taylor = Taylor(U, ((0.29, 0.31), (0.49, 0.52), (-0.21, -0.19)))
    assert taylor.stays_above(arb(half(0.2)) - 1e-3)
    assert not taylor.values > half(0.2) - 1e-3
    assert not taylor.stays_above(arb(half(0.2)) + 1e-12)


def test_a_line_below_is_no_steeper_than_the_guard() -> None:
    """With K = 0.1 the least energy is at θ2 = 0.6; a line with the slope 0.2 would be above it."""
    weak = {"soft_guards": [{"couple": 0.1, "stiffness": 0.0, "soft_angle": ANGLE}]}
    U = Energy(PROOFS["repelling"]["reduced_energy"] | weak)
    taylor = Taylor(U, ((0.299, 0.301), (0.499, 0.7), (-0.201, -0.199)))
    assert not taylor.stays_above(arb(half(0.1) + 0.1 * 0.1 + 1e-6))


def test_the_hessian_does_not_bound_a_slope_that_jumps() -> None:
    U = Energy(PROOFS["repelling"]["reduced_energy"])
    across = Taylor(U, ((0.2, 0.4), (0.45, 0.55), (-0.3, -0.1)))
    assert not across.whole_hessian[1, 1].is_finite()
    beside = Taylor(U, ((0.2, 0.4), (0.51, 0.55), (-0.3, -0.1)))
    assert beside.whole_hessian[1, 1].contains(1)


@pytest.mark.parametrize("kind", PROOFS)
def test_mirrored_claims_are_verified(kind: str) -> None:
    data = copy.deepcopy(PROOFS[kind])
    data["reduced_energy"]["linear"][1] *= -1
    for claims in (data, data["unwrapped"]):
        (state,) = claims["states"]
        state["orientation"][1] *= -1
        low, high = state["enclosure"]
        low[1], high[1] = -high[1], -low[1]
    assert refused(data) == set()


@pytest.mark.parametrize("ends", [(-0.5000001, 0.6), (-0.6, 0.6), (-0.6, 0.5000001)])
@pytest.mark.parametrize("slope", [1.0, -1.0])
def test_a_box_from_stop_to_stop_may_hold_a_state_at_either(
    ends: tuple[float, float], slope: float
) -> None:
    zeros = np.zeros((3, 3)).tolist()
    energy = {"quadratic": zeros, "linear": [0.0, slope, 0.0], "coefficients": [[[0.0]]]}
    taylor = Taylor(Energy(energy | STOP), ((-0.1, 0.1), ends, (-0.1, 0.1)))
    assert all(entry.contains(0) for entry in taylor.whole_gradient.entries())


def test_slopes_between_both_sides_of_a_jump() -> None:
    guard = SwitchingGuard(5.0, 2.0, 0.5)
    inner, kink, outer = (guard.slope(arb(x)) for x in (0.4, 0.5, 0.7))
    assert inner == 0
    assert kink.contains(0)
    assert kink.contains(5)
    assert outer.overlaps(arb(5.4, 1e-15))
    assert guard.slope(arb(-0.7)).overlaps(arb(-5.4, 1e-15))
    both = guard.slope(arb(0, 0.7))
    assert both.contains(-5)
    assert both.contains(5)
    assert guard.energy(arb(0.7)).overlaps(arb(1.04, 1e-15))
