"""Protects the check of the region of each minimum: true ones are verified, too large ones not."""

from copy import deepcopy

import numpy as np
import pytest
from flint import arb, ctx
from support.landscapes import end_of_flow
from support.proofs import PROOF, findings_of, leaves, parabola, proof_of
from support.rest import inverted_pendulum, paper_system, soft_body

from rbstab.analysis.proof_check.checker import PRECISION, _regions
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.findings import IN_RANGE, UNWRAPPED, Finding, range_with
from rbstab.analysis.proof_check.rest_states import proved_states
from rbstab.experiment.stored_proof.energies import ProvedEnergy

HALF_TURN = 0.5 * 30.0 * np.pi**2 - 200
"""J: the energy of the second pendulum at θ1 = ±π."""


def regions(proof: PROOF) -> list[Finding]:
    return [one for one in findings_of(proof) if one.claim.startswith("region of")]


def region_alone(proof: PROOF, claim: PROOF) -> Finding:
    """Check one region in the range of eq. 5, without the rest states, which take longer."""
    with ctx.workprec(PRECISION):
        claims = {**proof, "region": None, "regions": [claim]}
        range_ = range_with(IN_RANGE, (arb.pi(), arb.pi() / 2, arb.pi()))
        (found,) = _regions(
            Energy(proof["reduced_energy"]), claims, proved_states(claims), [], range_
        )
        return found


def refusals(proof: PROOF) -> list[Finding]:
    return [finding for finding in findings_of(proof) if not finding.verified]


def with_bound(proof: PROOF, number: int, bound: float) -> PROOF:
    """Return a proof with another bound of the region with a number, from 0."""
    changed = deepcopy(proof)
    region = changed["regions"][number]
    region["lower_bound"] += bound - region["energy_bound"]
    region["energy_bound"] = bound
    return changed


@pytest.fixture(scope="module")
def leaning() -> PROOF:
    """A pendulum with two minima. The pass between them is the top, at exactly 0 J."""
    return proof_of(inverted_pendulum([50.0, 150.0, 70.0], 100.0))


@pytest.fixture(scope="module")
def half_turn() -> PROOF:
    """A pendulum with two minima. Each region ends at its own half turn; the top is higher."""
    return proof_of(inverted_pendulum([30.0, 1e3, 1e3], 100.0), wide=True)


@pytest.fixture(scope="module")
def three_minima() -> PROOF:
    """A body with three minima: two share a pass, and the third one ends at the border."""
    return proof_of(soft_body("permanent", 4))


def test_each_region_is_a_claim_of_its_own(leaning: PROOF) -> None:
    names = ["region of rest state 1", "region of rest state 2"]
    assert [one.claim for one in regions(leaning)] == names
    assert refusals(leaning) == []


SLOW, LONG = pytest.mark.slow, pytest.mark.long


@pytest.mark.parametrize(
    "seed",
    [pytest.param(3, marks=SLOW), *(pytest.param(k, marks=LONG) for k in (0, 1, 2, 4, 8, 10))],
)
@pytest.mark.parametrize("variant", ["permanent", "visco-elastic", "embedded"])
def test_regions_of_soft_bodies(variant: str, seed: int) -> None:
    proof = proof_of(soft_body(variant, seed), wide=True)
    assert len(regions(proof)) >= len(proof["regions"]) > 0
    assert refusals(proof) == []


@pytest.mark.parametrize("number", [0, 1])
def test_the_pass_between_two_minima_is_the_limit(leaning: PROOF, number: int) -> None:
    lower, higher = (with_bound(leaning, number, x)["regions"][number] for x in (-1e-9, 1e-9))
    assert region_alone(leaning, lower).verified
    refused = region_alone(leaning, higher)
    assert not refused.verified
    assert refused.claim == f"region of rest state {number + 1}"
    assert "not shown to stay away from rest state" in refused.text


@pytest.mark.parametrize("number", [0, 1])
def test_a_point_of_the_border_is_the_limit(half_turn: PROOF, number: int) -> None:
    proof = {**half_turn, "unwrapped": None}
    assert refusals(with_bound(proof, number, HALF_TURN - 1e-8)) == []
    (refused,) = refusals(with_bound(proof, number, HALF_TURN + 1e-8))
    assert refused.claim == f"region of rest state {number + 1}"
    sign = np.sign(proof["states"][number]["orientation"][0])
    assert f"stay away from θ1 = {sign * np.pi:.6g}." in refused.text


def test_a_region_raised_by_a_hundredth_is_refused(leaning: PROOF) -> None:
    region = leaning["regions"][1]
    higher = region["energy_bound"] + 0.01 * region["lower_bound"]
    (refused,) = refusals(with_bound(leaning, 1, higher))
    assert refused.claim == "region of rest state 2"


@pytest.mark.slow
def test_three_minima(three_minima: PROOF) -> None:
    claims = three_minima["regions"]
    assert [(one["rest_state"], one["pass_state"]) for one in claims] == [(1, 3), (2, 3), (4, None)]
    for number, claim in enumerate(claims):
        assert region_alone(three_minima, claim).verified
        bound = claim["energy_bound"] + 0.01 * claim["lower_bound"]
        higher = with_bound(three_minima, number, bound)["regions"][number]
        assert not region_alone(three_minima, higher).verified


@pytest.mark.parametrize(
    ("region", "state", "reason"),
    [
        (0, 2, "is more than an energy below"),
        (1, 4, "is more than an energy below"),
        (2, 1, "not shown to stay away from"),
        (2, 2, "not shown to stay away from"),
        (0, 3, "Rest state 3 is not proved to be a minimum."),
        (0, 12, "Rest state 12 is not proved to be a minimum."),
    ],
)
def test_a_region_belongs_to_its_rest_state(
    three_minima: PROOF, region: int, state: int, reason: str
) -> None:
    found = region_alone(three_minima, {**three_minima["regions"][region], "rest_state": state})
    assert not found.verified
    assert reason in found.text


def test_the_height_of_a_region_is_checked(leaning: PROOF) -> None:
    proof = deepcopy(leaning)
    proof["regions"][1]["lower_bound"] += 1e-6
    (refused,) = refusals(proof)
    assert "is more than an energy below" in refused.text


def test_a_region_below_its_minimum_is_empty(leaning: PROOF) -> None:
    proof = deepcopy(leaning)
    proof["regions"][0].update(energy_bound=-50.0, lower_bound=0.0)
    assert regions(proof)[0].text.startswith("It is empty")
    assert refusals(proof) == []


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_no_region_reaches_a_face(axis: int, sign: int) -> None:
    """U = ½ (distance)² with its minimum 1 rad from a face."""
    end = np.pi / 2 if axis == 1 else np.pi
    centre = [0.0, 0.0, 0.0]
    centre[axis] = sign * (end - 1.0)
    proof = parabola((centre[0], centre[1], centre[2]), 0.0)
    for bound, verified in ((0.5 - 1e-9, True), (0.5 + 1e-9, False)):
        proof["regions"] = [{"rest_state": 1, "energy_bound": bound, "lower_bound": 0.0}]
        (found,) = regions(proof)
        assert found.verified is verified
        assert (f"θ{axis + 1} = {sign * end:.6g}" in found.text) is not verified


def test_no_region_reaches_an_undecided_box() -> None:
    """U = ½ |Θ|² is least at the corner [1, 0.5, 0.5] of the box: ½ 1.5 J."""
    proof = parabola((0.0, 0.0, 0.0), 0.0)
    box = [[1.0, 0.5, 0.5], [1.2, 0.6, 0.6]]
    proof.update(proved=False, unique=None, region=None, undecided=[box])
    for bound, verified in ((0.75 - 1e-9, True), (0.75 + 1e-9, False)):
        proof["regions"] = [{"rest_state": 1, "energy_bound": bound, "lower_bound": 0.0}]
        (found,) = regions(proof)
        assert found.verified is verified
        assert ("undecided box 1" in found.text) is not verified


def test_all_angles_have_their_own_regions(half_turn: PROOF) -> None:
    """Beyond ±π the pendulum turns on, up to the top at 0 J."""
    assert {one.about for one in regions(half_turn)} == {IN_RANGE, UNWRAPPED}
    assert refusals(half_turn) == []
    wide = half_turn["unwrapped"]["regions"]
    assert wide[0]["energy_bound"] > HALF_TURN + 40
    # The same bound holds in the smaller range for none of them.
    assert len(refusals({**half_turn, "regions": wide})) == 2
    wrong = deepcopy(half_turn)
    wrong["unwrapped"]["regions"][1]["energy_bound"] = 1e-9
    (refused,) = refusals(wrong)
    assert (refused.about, refused.claim) == (UNWRAPPED, "region of rest state 2")


def test_the_boxes_of_a_region(half_turn: PROOF, rng: np.random.Generator) -> None:
    """Points that flow to the minimum are in wet boxes; all boxes next to these are dry."""
    form = ProvedEnergy.model_validate(half_turn["reduced_energy"]).form
    claim = half_turn["regions"][0]
    finding = region_alone(half_turn, claim)
    bound, minimum = claim["energy_bound"], half_turn["states"][0]["orientation"]
    listed = leaves(finding.covers["range"])
    wet = np.array([box for name, box in listed if name == "w"])
    for name, box in listed:
        if name == "b":
            Theta = rng.uniform(box[:, 0], box[:, 1], size=(5, 3))
            assert np.all(form.value(Theta) > bound - 1e-9)
        if name == "a":
            apart = (wet[:, :, 0] > box[:, 1]) | (box[:, 0] > wet[:, :, 1])
            assert np.all(apart.any(axis=1))
    points = minimum + rng.normal(scale=0.15, size=(100, 3))
    inside = [
        Theta
        for Theta in points[form.value(points) < bound]
        if np.allclose(end_of_flow(form, Theta), minimum, atol=1e-2)
    ]
    assert len(inside) > 10
    for Theta in inside:
        assert np.any(np.all((wet[:, :, 0] <= Theta) & (wet[:, :, 1] >= Theta), axis=1))


def test_each_part_of_the_border_has_a_cover(half_turn: PROOF) -> None:
    finding = regions(half_turn)[0]
    whole = np.array(finding.covers["range"].box)
    parts = [np.array(found.box) for name, found in finding.covers.items() if name != "range"]
    wet = [box for name, box in leaves(finding.covers["range"]) if name == "w"]
    sides = [(axis, end) for axis in range(3) for end in range(2)]
    touching = [(box, axis) for box in wet for axis, e in sides if box[axis, e] == whole[axis, e]]
    assert len(touching) == len(parts) > 0
    for box, axis in touching:
        flat = box.copy()
        flat[axis] = 0.0
        assert any(np.array_equal(flat, part) for part in parts)


def test_a_region_without_a_certified_region_is_checked() -> None:
    """A file may claim regions alone."""
    proof = deepcopy(proof_of(paper_system("permanent", 0.1)))
    proof["region"] = None
    assert len(regions(proof)) == 1
    proof.update(proved=False, unique=False)
    assert len(regions(proof)) == 1
    proof["regions"][0]["energy_bound"] += 1.0
    assert len(refusals(proof)) == 1
