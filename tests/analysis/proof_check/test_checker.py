"""Protects the checker of proofs: it accepts true proofs, and refuses each kind of wrong claim."""

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from support.config_elements import config_data
from support.proofs import PROOF, findings_of, parabola, proof_of
from support.rest import inverted_pendulum, paper_system, soft_body, system_of

from rbstab.analysis.proof_check import energy
from rbstab.analysis.proof_check.checker import PLACE_LIMIT, check
from rbstab.analysis.proof_check.findings import UNWRAPPED, Finding
from rbstab.config.build import problem_of
from rbstab.config.load import load_config

HALF_PI = np.pi / 2


def refusals(proof: PROOF) -> list[Finding]:
    return [finding for finding in findings_of(proof) if not finding.verified]


@pytest.fixture(scope="module")
def three_states() -> PROOF:
    """The paper's body with a tenth of K_r: a minimum and two saddles."""
    return proof_of(paper_system("permanent", 0.1))


@pytest.fixture(scope="module")
def leaning() -> PROOF:
    """A pendulum with two minima and a saddle between them, lower than the border.

    It is without the regions of its minima, which have tests of their own.
    """
    return {**proof_of(inverted_pendulum([50.0, 150.0, 70.0], 100.0)), "regions": []}


@pytest.fixture(scope="module")
def wide() -> PROOF:
    """The paper's body, with the rest states for all θ1 and θ3."""
    return proof_of(paper_system("permanent"), wide=True)


@pytest.mark.parametrize(
    ("variant", "seed", "count"),
    [("free", 0, 1), ("permanent", 0, 2), ("visco-elastic", 0, 3), ("visco-elastic", 4, 4)],
)
def test_a_proof_of_a_random_body_is_verified(variant: str, seed: int, count: int) -> None:
    proof = proof_of(system_of(variant, seed))
    assert len(proof["states"]) == count
    claims = {finding.claim for finding in findings_of(proof)}
    assert claims >= {"rest states", "no other rest state", "certified region"}
    assert len(claims) == 3 + len(proof["regions"])
    assert refusals(proof) == []


@pytest.mark.parametrize("variant", ["permanent", "visco-elastic", "embedded"])
@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(0, marks=pytest.mark.slow),
        *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2)),
    ],
)
def test_more_proofs_are_verified(variant: str, seed: int) -> None:
    for system in (system_of(variant, seed + 1), soft_body(variant, seed)):
        proof = proof_of(system, wide=True)
        assert proof["proved"]
        assert refusals(proof) == []


def test_both_ranges_are_checked(wide: PROOF) -> None:
    findings = findings_of(wide)
    assert refusals(wide) == []
    assert [finding.claim for finding in findings if finding.about == UNWRAPPED] == [
        "ends",
        "rest states",
        "no other rest state",
        "certified region",
        "region of rest state 1",
    ]


def remove(*numbers: int) -> Callable[[PROOF], None]:
    def edit(proof: PROOF) -> None:
        kept = [s for n, s in enumerate(proof["states"], start=1) if n not in numbers]
        proof["states"], proof["unique"] = kept, len(kept) == 1

    return edit


def shift(proof: PROOF) -> None:
    """Move an enclosure by three times its width."""
    state = proof["states"][1]
    low, high = np.array(state["enclosure"])
    state["enclosure"] = [(low + 3 * (high - low)).tolist(), (high + 3 * (high - low)).tolist()]
    state["orientation"] = (state["orientation"] + 3 * (high - low)).tolist()


def widen(proof: PROOF) -> None:
    proof["states"][0]["enclosure"] = [[-3.0, -1.5, -3.0], [3.0, 1.5, 3.0]]


def move_point(proof: PROOF) -> None:
    proof["states"][1]["orientation"][0] += 0.01


def repeat(proof: PROOF) -> None:
    proof["states"].append(deepcopy(proof["states"][2]))


def leave_unproved(proof: PROOF) -> None:
    proof["states"][2]["proved"] = False


def leave_undecided(proof: PROOF) -> None:
    proof["undecided"] = [[[1.0, 1.0, 1.0], [1.1, 1.1, 1.1]]]


def claim_one(proof: PROOF) -> None:
    proof["unique"] = True


def change(path: str, value: Any) -> Callable[[PROOF], None]:
    """Return an edit that replaces a value, or adds a float to it."""

    def edit(proof: PROOF) -> None:
        *keys, last = [int(key) if key.isdigit() else key for key in path.split(".")]
        part: Any = proof
        for key in keys:
            part = part[key]
        part[last] = part[last] + value if isinstance(value, float) else value

    return edit


@pytest.mark.parametrize(
    ("edit", "reason"),
    [
        (remove(3), "may contain one that is not listed"),
        (remove(2, 3), "may contain one that is not listed"),
        (remove(1), "may contain one that is not listed"),
        (shift, "no zero of the gradient could be shown"),
        (widen, "may contain more than one zero"),
        (move_point, "its Θ is not in its enclosure"),
        (repeat, "Rest states 3 and 4 may be the same"),
        (leave_unproved, "not each of them is proved"),
        (leave_undecided, "some boxes are undecided"),
        (claim_one, "does not follow"),
        (change("states.1.index", 1), "its index is 2"),
        (change("states.0.index", 2), "its index is 0"),
        (change("region.energy_bound", 1e-4), "is not shown to be at least"),
        (change("region.energy_bound", 20.0), "is not shown to be at least"),
        (change("region.lower_bound", 1e-6), "is more than"),
        (change("reduced_energy.quadratic.0.0", 1e-6), "no zero of the gradient"),
        (change("reduced_energy.coefficients.1.1.1", 1e-6), "no zero of the gradient"),
        (change("reduced_energy.quadratic.0.1", 1.0), "not symmetric"),
    ],
)
def test_a_wrong_claim_is_refused(
    three_states: PROOF, edit: Callable[[PROOF], None], reason: str
) -> None:
    proof = deepcopy(three_states)
    assert refusals(proof) == []
    edit(proof)
    assert reason in " ".join(finding.text for finding in refusals(proof))


@pytest.mark.parametrize("edit", [remove(3), shift])
def test_no_region_is_checked_without_all_rest_states(
    three_states: PROOF, edit: Callable[[PROOF], None]
) -> None:
    assert len([one for one in findings_of(three_states) if "region" in one.claim]) == 2
    proof = deepcopy(three_states)
    edit(proof)
    assert not any("region" in one.claim for one in findings_of(proof))


@pytest.mark.parametrize("index", [0, 1, 3])
def test_only_one_index_of_each_state_is_accepted(three_states: PROOF, index: int) -> None:
    proof = deepcopy(three_states)
    proof["states"][2]["index"] = index
    assert "Rest state 3: its index is 2." in refusals(proof)[0].text


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_the_bound_holds_on_each_face(axis: int, sign: int) -> None:
    """The minimum is nearest to one face, where U = ½ (distance)² is least."""
    end = HALF_PI if axis == 1 else np.pi
    centre = [0.0, 0.0, 0.0]
    centre[axis] = sign * (end - 1.0)
    bound = 0.5 * 1.0**2
    placed = (centre[0], centre[1], centre[2])
    assert refusals(parabola(placed, bound - 1e-9)) == []
    (refused,) = refusals(parabola(placed, bound + 1e-9))
    assert f"θ{axis + 1} = {sign * end:.6g}" in refused.text


def test_another_minimum_limits_the_region(leaning: PROOF) -> None:
    proof = deepcopy(leaning)
    assert refusals(proof) == []
    # The other minimum is as low as the lowest; the border is above 100 J.
    proof["region"]["energy_bound"] += 1.0
    (refused,) = refusals(proof)
    assert "The energy at rest state 2 is" in refused.text
    assert "The energy at rest state 3 is" not in refused.text


def test_a_region_needs_a_minimum(leaning: PROOF) -> None:
    proof = deepcopy(leaning)
    proof["states"].reverse()
    (refused,) = refusals(proof)
    assert refused.text == "Rest state 1 is not proved to be a minimum."
    proof["states"].reverse()
    proof["states"][0]["index_proved"] = False
    (refused,) = refusals(proof)
    assert refused.text == "Rest state 1 is not proved to be a minimum."


def test_a_state_on_the_border_is_not_inside() -> None:
    assert refusals(parabola((0.0, HALF_PI - 1e-6, 0.0), 0.0)) == []
    (refused,) = refusals(parabola((0.0, HALF_PI, 0.0), 0.0))
    assert "is not inside the range" in refused.text


def test_a_range_without_rest_states() -> None:
    """The minimum is outside, at θ1 = 4."""
    proof = parabola((4.0, 0.0, 0.0), 0.0)
    assert "is not inside the range" in refusals(proof)[0].text
    empty = {**proof, "states": [], "unique": False, "region": None}
    assert refusals(empty) == []
    inside = {**parabola((3.0, 0.0, 0.0), 0.0), "states": [], "unique": False, "region": None}
    assert "may contain one that is not listed" in refusals(inside)[0].text


def test_a_double_zero_is_not_proved_by_saying_so() -> None:
    """At k2 = a the upright pendulum is about to fall; no proof isolates this rest state."""
    proof = proof_of(inverted_pendulum([100.0, 250.0, 70.0], 100.0))
    assert not proof["proved"]
    assert refusals(proof) == []
    claimed = deepcopy(proof)
    claimed["states"][0].update(proved=True, index_proved=True)
    claimed["states"][0]["enclosure"] = [[-0.01] * 3, [0.01] * 3]
    claimed.update(proved=True, unique=True, undecided=[])
    assert "may contain more than one zero" in refusals(claimed)[0].text
    # Nor may the box be left out.
    empty = {**deepcopy(proof), "states": [], "proved": True, "unique": False, "undecided": []}
    assert "may contain one that is not listed" in refusals(empty)[0].text


@pytest.mark.parametrize("axis", [0, 2])
def test_a_rest_state_beyond_the_ends_is_not_excluded_by_saying_so(wide: PROOF, axis: int) -> None:
    """The springs can balance the other forces up to 3.3 rad about axis 1, and 2.3 about axis 3."""
    proof = deepcopy(wide)
    proof["unwrapped"]["end"][axis] = 2.0
    refused = refusals(proof)
    assert refused[0].about == UNWRAPPED
    assert refused[0].claim == "ends"


def test_a_wrong_claim_on_all_angles_is_refused(wide: PROOF) -> None:
    proof = deepcopy(wide)
    proof["unwrapped"]["region"]["energy_bound"] += 1e-4
    (refused,) = refusals(proof)
    assert (refused.about, refused.claim) == (UNWRAPPED, "certified region")


def test_an_unfinished_proof_is_checked_outside_of_its_undecided_boxes() -> None:
    proof = proof_of(paper_system("permanent", 0.1), box_limit=2500)
    assert not proof["proved"]
    assert refusals(proof) == []
    outside, region = findings_of(proof)[1:]
    assert f"outside of {len(proof['undecided'])} undecided boxes" in outside.text
    # Its bound is below U = 0 at the minimum.
    assert region.text.startswith("It is empty")
    fewer = {**proof, "undecided": [], "states": proof["states"][:2]}
    assert "may contain one that is not listed" in refusals(fewer)[0].text
    higher = deepcopy(proof)
    higher["region"]["energy_bound"] = 1.0
    assert "The energy at undecided box" in refusals(higher)[0].text


def test_large_files_are_refused_at_once(three_states: PROOF) -> None:
    """The time grows with the size of the coefficients and with the number of places."""
    size = 11
    energy = {**three_states["reduced_energy"], "coefficients": np.zeros((size,) * 3).tolist()}
    (refused,) = check({**three_states, "reduced_energy": energy})
    assert refused.text == "The reduced energy has more than 4 times an angle in a sine or cosine."
    many = [[[1.0, 1.0, 1.0], [1.1, 1.1, 1.1]]] * PLACE_LIMIT
    (refused,) = check({**three_states, "proved": False, "undecided": many})
    text = "There are more than 1000 rest states, undecided boxes and regions: too many to check."
    assert refused.text == text
    for key in ("states", "regions"):
        (refused,) = check({**three_states, key: three_states[key] * PLACE_LIMIT})
        assert refused.text == text


def test_a_long_check_is_stopped(three_states: PROOF, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(energy, "MOST_EVALUATIONS", 1000)
    first, stopped = check(three_states)
    assert first.verified
    assert not stopped.verified
    assert stopped.text == "The check needs more than 1,000 evaluations of U."


@pytest.mark.parametrize(
    "edit",
    [
        change("reduced_energy.quadratic.0.0", 1e308),
        change("reduced_energy.coefficients.1.1.1", 1e308),
        change("reduced_energy.linear.0", 1e308),
        change("region.energy_bound", 1e308),
        change("regions.0.energy_bound", 1e308),
        change("regions.0.lower_bound", 1e308),
        change("states.1.enclosure", [[-1e308] * 3, [1e308] * 3]),
        change("undecided", [[[-1e308] * 3, [1e308] * 3]]),
        change("regions.0.rest_state", 10**30),
    ],
)
def test_huge_numbers_are_refused(three_states: PROOF, edit: Callable[[PROOF], None]) -> None:
    proof = deepcopy(three_states)
    edit(proof)
    assert refusals(proof)
    assert all(finding.text.endswith(".") for finding in refusals(proof))


@pytest.mark.parametrize("axis", [0, 2])
@pytest.mark.parametrize("end", [101.0, 1.7976931348623157e308])
def test_a_huge_range_is_refused(wide: PROOF, axis: int, end: float) -> None:
    proof = deepcopy(wide)
    proof["unwrapped"]["end"][axis] = end
    (refused,) = refusals(proof)
    assert refused.about == UNWRAPPED
    assert refused.text == "The range of θ1 or θ3 goes beyond 100 rad: too far to be checked."


@pytest.fixture(scope="module")
def on_the_border() -> PROOF:
    """Return a proof that ended early, with rest states at θ3 = ±π: by symmetry, exactly there."""
    elements = {
        "upright": {"kind": "attitude", "K": [60, 60, 40], "L": [2, 2, 1.5]},
        "pad": {
            "kind": "visco-elastic",
            "point": [0, 0, -0.18],
            "anchor": [0, 0, -0.18],
            "K_c": [9000, 9000, 14000],
            "L_c": [60, 60, 90],
        },
    }
    body = {"mass": 8.0, "inertia": [0.11, 0.12, 0.06], "contact_point": [0, 0, -0.18]}
    system = problem_of(load_config(config_data(elements, None, body=body))).system
    return proof_of(system, box_limit=6000)


def test_a_rest_state_on_the_border_does_not_stop_the_check(on_the_border: PROOF) -> None:
    """It is undecided, as it is not inside. All near it is free of others, by its uniqueness."""
    ends = [box for box in on_the_border["undecided"] if abs(abs(box[0][2]) - np.pi) < 1e-6]
    assert ends
    assert refusals(on_the_border) == []
    without = deepcopy(on_the_border)
    without["undecided"].remove(ends[0])
    assert "may contain one that is not listed" in refusals(without)[0].text
    # The box beside it has none, so all around it remains to be shown.
    moved = deepcopy(without)
    moved["undecided"].append(np.add(ends[0], [1e-9, 0.0, 0.0]).tolist())
    assert "may contain one that is not listed" in refusals(moved)[0].text
