"""Protects the covers of the checker: they cover all of a box, and each reason in them is true."""

import numpy as np
import pytest
from support.proofs import PROOF, findings_of, leaves, proof_of
from support.rest import paper_system

from rbstab.analysis.proof_check.boxes import Box
from rbstab.analysis.proof_check.cover import cover
from rbstab.experiment.stored_proof.energies import ProvedEnergy
from rbstab.mechanics.numbers import Array

UNIT: Box = ((0.0, 1.0), (0.0, 1.0), (0.0, 1.0))


def volume(box: Array) -> float:
    return float(np.prod(box[:, 1] - box[:, 0]))


def test_a_cover_has_all_of_the_box() -> None:
    seen = []

    def reason(box: Box) -> str | None:
        seen.append(box)
        return "near" if box[0][1] - box[0][0] < 0.3 else "far" if box[1][0] >= 0.5 else None

    found = cover(UNIT, reason)
    assert found.open is None
    assert found.boxes == len(seen)
    listed = leaves(found)
    assert {name for name, _ in listed} == {"near", "far"}
    assert sum(volume(box) for _, box in listed) == 1.0


def test_a_box_that_cannot_be_settled_is_returned() -> None:
    found = cover(UNIT, lambda box: None if box[2][0] <= 0.3 <= box[2][1] else "away")
    assert found.open is not None
    low, high = found.open[2]
    assert low <= 0.3 <= high
    assert high - low < 1e-8


def test_the_limit_of_boxes() -> None:
    found = cover(UNIT, lambda _: None, limit=3)
    assert found.open is not None
    assert found.boxes == 3


@pytest.fixture(scope="module")
def proof() -> PROOF:
    return proof_of(paper_system("visco-elastic", 0.1))


def test_each_reason_holds(proof: PROOF, rng: np.random.Generator) -> None:
    """The gradient at random points is that of the prover's form, to round-off."""
    form = ProvedEnergy.model_validate(proof["reduced_energy"]).form
    findings = {finding.claim: finding for finding in findings_of(proof)}
    range_cover = findings["no other rest state"].covers["range"]
    listed = leaves(range_cover)
    assert sum(volume(box) for _, box in listed) == pytest.approx(volume(np.array(range_cover.box)))
    assert {name[0] for name, _ in listed} == {"g", "y", "s"}
    for name, box in listed:
        Theta = rng.uniform(box[:, 0], box[:, 1], size=(20, 3))
        if name[0] == "s":
            place = np.array(range_cover.places[name])
            assert np.all(place[:, 0] <= box[:, 0])
            assert np.all(box[:, 1] <= place[:, 1])
            continue
        _, gradient, _ = form.approximate(Theta, 2)
        if name[0] == "y":
            centre = box[:, 0] / 2 + box[:, 1] / 2
            gradient = gradient @ np.linalg.inv(form.approximate(centre[np.newaxis], 2)[2][0]).T
        component = gradient[:, int(name[1:]) - 1]
        assert abs(np.sum(np.sign(component))) == len(Theta)


def test_each_face_is_above_the_bound(proof: PROOF, rng: np.random.Generator) -> None:
    form = ProvedEnergy.model_validate(proof["reduced_energy"]).form
    (finding,) = [one for one in findings_of(proof) if one.claim == "certified region"]
    faces = {name: found for name, found in finding.covers.items() if name.startswith("θ")}
    assert len(faces) == 6
    assert len(finding.covers) == 6 + len(proof["states"]) - 1
    for name, found in faces.items():
        axis, end = int(name[1]) - 1, float(name.split("=")[1])
        box = np.array(found.box)
        for _, part in leaves(found):
            Theta = rng.uniform(part[:, 0], part[:, 1], size=(5, 3))
            Theta[:, axis] = end
            # The name has six digits of the end, so U may be lower by a little.
            assert np.all(form.value(Theta) > proof["region"]["energy_bound"] - 0.1)
        flat = np.delete(np.array([part[:, 1] - part[:, 0] for _, part in leaves(found)]), axis, 1)
        area = np.prod(np.delete(box[:, 1] - box[:, 0], axis))
        assert np.sum(np.prod(flat, axis=1)) == pytest.approx(area)
