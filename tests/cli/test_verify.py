"""Protects `rbstab verify`: its output, its exit codes, and refusals of edited files."""

import json
from pathlib import Path

import pytest
from cli.conftest import ended, json_of, rbstab, success
from support.printed_paths import printed

from rbstab.store.document import read_document, write_document


@pytest.fixture
def proof(folder):
    success("stability", "good.yaml", "--no-run")
    (path,) = (folder / "results" / "proofs").iterdir()
    return path


def test_a_proof_is_verified(proof):
    done = success("verify", str(proof))
    assert done.stdout.startswith(f"{proof}: verified\n")
    assert "The range of eq. 5\n    Rest states: checked. 1 are isolated" in done.stdout
    assert "No other rest state: checked (" in done.stdout
    assert "Certified region: checked (" in done.stdout
    assert "not compared with a config" in done.stdout
    assert "REFUSED" not in done.stdout
    quiet = rbstab("verify", str(proof), "-q")
    assert (quiet.stdout, quiet.stderr, done.stderr) == (done.stdout, "", "")
    with_config = success("verify", str(proof), "--config", "good.yaml")
    assert "as an exact expression" in with_config.stdout
    assert "not compared with a config" not in with_config.stdout


def test_a_larger_bound_with_a_new_digest_is_refused(proof):
    data = read_document(proof)
    data["region"]["energy_bound"] *= 1.01
    write_document(proof, data)
    done = ended(4, "verify", str(proof))
    assert done.stdout.startswith(f"{proof}: REFUSED\n")
    assert "Certified region: REFUSED" in done.stdout


def test_a_check_that_takes_too_long_is_no_refusal(proof, monkeypatch):
    wrong = proof.with_name(f"{'0' * 32}.json")
    data = read_document(proof)
    data["reduced_energy"]["operations"][1] = ["tan", 0]
    write_document(wrong, data)
    monkeypatch.setattr("rbstab.proof.check.energy.EVALUATIONS", 10)
    done = ended(5, "verify", str(proof))
    assert done.stdout.startswith(f"{proof}: not decided: the check takes too long\n")
    assert "REFUSED" not in done.stdout
    assert json_of("verify", str(proof))["too_long"]
    ended(4, "verify", str(wrong))
    ended(4, "verify", str(proof), str(wrong))


def test_an_edit_without_a_new_digest_is_damage(proof):
    text = proof.read_text()
    proof.write_text(text.replace('"lower_bound":4', '"lower_bound":5', 1))
    assert proof.read_text() != text
    done = ended(4, "verify", str(proof))
    assert "is damaged" in done.stderr


def test_another_config_is_refused(proof):
    changes = ("--set", "body.contact_point=[0.15, 0.10, -0.43]")
    done = ended(4, "verify", str(proof), "--config", "good.yaml", *changes)
    assert "it was made for another one" in done.stdout


def test_all_proofs_of_a_folder_are_checked(proof):
    changes = ("--set", "body.contact_point=[0.15, 0.10, -0.43]")
    success("stability", "good.yaml", "--no-run", *changes)
    (other,) = set(proof.parent.iterdir()) - {proof}
    (proof.parent / "within-0.json").write_text("{}")
    for folder in (proof.parent.parent, proof.parent):
        done = success("verify", str(folder))
        for path in (proof, other):
            assert f"{folder / path.relative_to(folder)}: verified\n" in done.stdout
        counts = "2 of 2 proofs verified; 1 within tolerances cannot be checked\n"
        assert done.stdout.endswith(f"{folder}: {counts}")
    # That of one config is found by the config.
    done = success("verify", "results", "--config", "good.yaml", *changes, "--json")
    assert [checked["id"] for checked in json.loads(done.stdout)] == [other.stem]
    # A wrong proof does not stop the others, and neither does a damaged one.
    data = read_document(proof)
    data["region"]["energy_bound"] *= 1.01
    write_document(proof, data)
    (proof.parent / "0.json").write_text("{}")
    done = ended(4, "verify", "results")
    assert f"{Path('results/proofs', proof.name)}: REFUSED\n" in done.stdout
    assert f"{Path('results/proofs', other.name)}: verified\n" in done.stdout
    assert "results: 1 of 3 proofs verified" in done.stdout
    assert printed("results/proofs/0.json is damaged") in done.stderr


def test_a_file_that_claims_nothing_is_not_counted(proof):
    load = "quantity: force, point: [0, 0, 0], direction: [1, 0, 0], amplitude: 1"
    element = f"{{kind: input, {load}, signal: {{kind: sine, frequency: 1}}}}"
    text = Path("good.yaml").read_text().replace("title:", "schema_version: 2\ntitle:")
    Path("guarded.yaml").write_text(f"{text}elements: {{load: {element}}}\n")
    success("run", "guarded.yaml", "--prove")
    done = success("verify", "results")
    assert ".json: claims nothing: an element supplies power" in done.stdout
    assert done.stdout.splitlines()[-1] == "results: 1 of 1 proofs verified; 1 file claims nothing"


def test_a_second_opinion_that_is_not_decided_is_no_refusal(proof, monkeypatch):
    monkeypatch.setattr("rbstab.experiment.verification.second.opinion.LATEST", 0.01)
    done = ended(5, "verify", str(proof), "--config", "good.yaml", "--second")
    assert done.stdout.startswith(f"{proof}: not decided: codac does not decide every claim\n")
    assert "REFUSED" not in done.stdout


def test_a_certificate_has_the_boxes_that_are_counted(proof):
    words = ("verify", str(proof), "--certificate", "boxes.json")
    done = success(*words, "--json")
    data, certificate = json.loads(done.stdout), json.loads(Path("boxes.json").read_text())
    assert data["verified"] is True
    assert data["id"] == certificate["id"] == proof.stem
    boxes = {(entry["about"], entry["claim"]): entry["boxes"] for entry in data["findings"]}
    for about, faces in (("the range of eq. 5", 6), ("all θ1 and θ3", 2)):
        parts = [entry for entry in certificate["covers"] if entry["about"] == about]
        for claim, count in (("no other rest state", 1), ("certified region", faces)):
            trees = [entry["tree"].split() for entry in parts if entry["claim"] == claim]
            assert len(trees) == count
            assert sum(map(len, trees)) == boxes[about, claim]


@pytest.mark.heavy
def test_a_second_opinion_confirms_and_refutes(folder):
    config = str(Path(__file__).parents[2] / "configs/examples/stability/fast.yaml")
    success("stability", config, "--no-run")
    (proof,) = (folder / "results/proofs").iterdir()
    second = ("verify", str(proof), "--config", config, "--second")
    done = success(*second)
    assert "  Codac: the range of eq. 5\n    Rest states: checked." in done.stdout
    assert "codac is asked about lists of rest states and certified regions only" in done.stdout
    data = read_document(proof)
    data["states"][0]["index"] = 1
    write_document(proof, data)
    done = ended(4, *second, "--json")
    wrong = [
        finding["about"]
        for finding in json.loads(done.stdout)["findings"]
        if not finding["verified"]
    ]
    assert "codac: the range of eq. 5" in wrong
