"""Protects the checker of proofs for tied bodies with springs: it refuses wrong claims."""

from copy import deepcopy

import numpy as np
import pytest
from flint import arb, arb_mat, ctx
from rbstab.experiment.stored_proof.tied import tied_record
from rbstab.experiment.stored_proof.written_energies import tied_energy_of
from support.tied_springs import K_D, spring_of, tied_system

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.tied.bounds import Pose as ProverPose
from rbstab.analysis.proof.tied.energy import tied_energy_of_doubles
from rbstab.analysis.proof.tied.extent import scale_of
from rbstab.analysis.proof.tied.rest_states import tied_rest_states
from rbstab.analysis.proof.tied.search import isolated_zero, newton
from rbstab.analysis.proof_check.findings import range_with
from rbstab.analysis.proof_check.tied import checker
from rbstab.analysis.proof_check.tied.checker import check_tied
from rbstab.analysis.proof_check.tied.energy import Pose
from rbstab.analysis.proof_check.tied.extent import BoundedEnergy
from rbstab.analysis.proof_check.tied.rest_states import Expansion, index_of

END = np.array([0.3, 0.3, 0.3])
"""rad: a small range, so that a check takes a second."""


@pytest.fixture(autouse=True)
def _precision():
    with ctx.workprec(128):
        yield


@pytest.fixture(scope="module")
def proof():
    """Return a proof of a part of the range, as plain data."""
    W = tied_energy_of_doubles(tied_system([spring_of()], 0.5, K_d=K_D))
    rest = tied_rest_states(W, END)
    return tied_record("id", rest, None, 0.0).model_dump(mode="json")


def findings_of(proof):
    """Return what is found of the claims on the small range."""
    W = BoundedEnergy(proof["tied_energy"])
    range_ = range_with("a part", tuple(arb(float(end)) for end in END))
    return list(checker._findings(W, proof, range_))


def refused(proof):
    return {one.claim for one in findings_of(proof) if not one.verified}


def test_a_proof_is_verified(proof):
    found = findings_of(proof)
    assert [one.claim for one in found] == [
        "rest states",
        "no other rest state",
        "certified region",
    ]
    assert all(one.verified for one in found)
    assert proof["region"]["lower_bound"] > 0


def raised(proof, key):
    """Return a proof whose region is larger by 1 %."""
    proof["region"][key] += 0.01 * abs(proof["region"][key])
    return proof


def moved(proof, key):
    """Return a proof with an enclosure beside the rest state."""
    low, high = proof["states"][0][key]
    width = high[0] - low[0]
    for corner in (low, high):
        corner[0] += 3 * width
    if key == "enclosure":
        proof["states"][0]["orientation"][0] = (low[0] + high[0]) / 2
    return proof


def other_index(proof):
    proof["states"][0]["index"] = 1
    return proof


def without_states(proof):
    return proof | {"states": [], "unique": False, "region": None}


def two(proof):
    return proof | {"states": proof["states"] * 2, "unique": False}


@pytest.mark.parametrize(
    ("change", "claim"),
    [
        (lambda proof: raised(proof, "energy_bound"), "certified region"),
        (lambda proof: raised(proof, "lower_bound"), "certified region"),
        (lambda proof: moved(proof, "enclosure"), "rest states"),
        (lambda proof: moved(proof, "shift"), "rest states"),
        (other_index, "rest states"),
        (without_states, "no other rest state"),
        (two, "rest states"),
        (lambda proof: proof | {"unique": False}, "rest states"),
    ],
    ids=["bound", "height", "Θ", "z", "index", "none", "two", "unique"],
)
def test_a_wrong_claim_is_refused(proof, change, claim):
    assert claim in refused(change(deepcopy(proof)))


def test_another_energy_is_refused(proof):
    stronger = deepcopy(proof)
    stronger["tied_energy"]["lines"][0]["weight"] *= 1.01
    assert "rest states" in refused(stronger)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"stiffness": [[1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]]}, "positive definite"),
        ({"stiffness": [[1.0, 0.1, 0], [0, 1.0, 0], [0, 0, 1.0]]}, "symmetric"),
        ({"lines": []}, "line"),
    ],
)
def test_what_is_no_such_energy_is_refused(proof, change, text):
    (found,) = check_tied(proof | {"tied_energy": proof["tied_energy"] | change})
    assert not found.verified
    assert text in found.text


def test_a_line_that_pulls_at_any_length_is_refused(proof):
    other = deepcopy(proof)
    other["tied_energy"]["lines"][0]["weight"] *= -1
    (found,) = check_tied(other)
    assert "not negative" in found.text


def test_the_derivatives_are_those_of_the_prover(proof):
    """The formulas are different, so both enclose the same numbers."""
    prover = tied_energy_of_doubles(tied_system([spring_of()], 0.5, K_d=K_D))
    W = BoundedEnergy(proof["tied_energy"])
    rng = np.random.default_rng(0)
    for _ in range(5):
        Theta, z = rng.uniform(-1.5, 1.5, 3), 0.1 * rng.normal(size=3)
        found = Pose(W, tuple((x, x) for x in Theta.tolist())).at([arb(x) for x in z.tolist()])
        bounds = ProverPose(prover, Boxes(Theta[None], Theta[None])).at(z[None])
        pairs = [(found.value, bounds.value.middle[0])]
        pairs += list(zip(found.gradient, bounds.gradient.middle[0], strict=True))
        pairs += list(zip(found.hessian.entries(), bounds.hessian.middle[0].ravel(), strict=True))
        for one, other in pairs:
            assert float(one) == pytest.approx(other, rel=1e-9, abs=1e-7)


def test_bounds_over_a_box_contain_those_at_its_points(proof):
    W = BoundedEnergy(proof["tied_energy"])
    rng = np.random.default_rng(1)
    Theta, z = rng.uniform(-1, 1, 3), 0.1 * rng.normal(size=3)
    over = Pose(W, tuple((x - 0.05, x + 0.05) for x in Theta)).at([arb(x, 0.01) for x in z], "over")
    for _ in range(10):
        a, b = Theta + 0.05 * rng.uniform(-1, 1, 3), z + 0.0099 * rng.uniform(-1, 1, 3)
        point = Pose(W, tuple((x, x) for x in a.tolist())).at([arb(x) for x in b.tolist()])
        assert over.value.contains(point.value)
        pairs = zip(
            [*over.gradient, *over.hessian.entries()],
            [*point.gradient, *point.hessian.entries()],
            strict=True,
        )
        assert all(one.contains(other) for one, other in pairs)


def test_a_box_with_two_rest_states_has_not_only_one():
    """A spring that pushes from above bends the body to both sides."""
    bent = spring_of((0.0, 0.0, 0.5), (0.1, 0.05, 1.3), 6000.0, 1.3)
    prover = tied_energy_of_doubles(tied_system([bent], 0.3, K_d=K_D))
    scale = scale_of(prover)
    starts = [[0.62, -0.33, -0.19, -0.14, -0.18, -0.47], [-0.51, 0.69, 0.06, 0.17, 0.11, -0.47]]
    with np.errstate(all="ignore"):
        found = newton(prover, np.array(starts))
        zeros = [isolated_zero(prover, y, scale) for y in found if y is not None]
    assert [zero is not None and zero.index for zero in zeros] == [0, 1]
    W = BoundedEnergy(tied_energy_of(prover).model_dump())
    points = np.array(found)
    low, high = points.min(axis=0) - 1e-3, points.max(axis=0) + 1e-3
    both = tuple(zip(low.tolist(), high.tolist(), strict=True))
    assert not Expansion(W, both).is_unique
    for point in points:
        near = tuple((x - 1e-6, x + 1e-6) for x in point.tolist())
        assert Expansion(W, near).is_unique
        assert Expansion(W, near).has_zero


@pytest.mark.parametrize("index", range(7))
def test_the_index_is_the_number_of_negative_eigenvalues(index):
    rng = np.random.default_rng(index)
    Q = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    values = np.array([-1.0] * index + [1.0] * (6 - index)) * rng.uniform(1, 9, 6)
    H = (Q * values) @ Q.T
    assert index_of(arb_mat([[arb(x) for x in row] for row in H.tolist()])) == index
    assert index_of(arb_mat(6, 6)) is None
