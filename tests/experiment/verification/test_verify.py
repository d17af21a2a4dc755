"""Protects the check of a proof against a config: its id, its hypotheses and its energy."""

from pathlib import Path

import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.config.load import load_config
from rbstab.experiment.proof import prove
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import no_proof
from rbstab.experiment.verification.verify import CONFIG, verify

PAPER = Path(__file__).parents[3] / "configs" / "paper"

CASES = [
    "case1_guarded",
    "case3_embedded",
    *(
        pytest.param(name, marks=pytest.mark.heavy)
        for name in ("case1_permanent", "case2_guarded", "case2_stiff", "case2_visco_elastic")
    ),
]


def refused(verification):
    assert verification.verified == all(finding.verified for finding in verification.findings)
    return [finding.claim for finding in verification.findings if not finding.verified]


@pytest.mark.parametrize("name", CASES)
def test_the_proofs_of_the_paper_s_configs_are_verified(name):
    config = load_config(PAPER / f"{name}.yaml")
    verification = verify(prove(config), config)
    assert refused(verification) == []
    claims = {(finding.about, finding.claim) for finding in verification.findings}
    assert {(CONFIG, "id"), (CONFIG, "hypotheses"), (CONFIG, "energy")} < claims
    if name.endswith("guarded"):
        # All starts converge: no region is needed.
        assert len(claims) == 11
        assert {claim for _, claim in claims} >= {"barrier", "every start"}
    else:
        # The region of the only minimum is the certified region.
        assert len(claims) == 10
        assert "certified region" in {claim for _, claim in claims}


@pytest.fixture(scope="module")
def proof():
    return prove(rbstab.load_config(paper_config("embedded", with_gravity=True)))


@pytest.mark.parametrize(
    "body", [{"mass": 41.000001}, {"contact_point": [0.15, 0.1000001, -0.42]}], ids=str
)
def test_another_energy_is_refused(proof, body):
    data = paper_config("embedded", with_gravity=True)
    changed = rbstab.load_config({**data, "body": {**data["body"], **body}})
    verification = verify(proof, changed)
    assert refused(verification) == ["id", "energy"]
    # Nor does the right id hide it.
    relabelled = proof.model_copy(update={"id": proof_id(changed)})
    assert refused(verify(relabelled, changed)) == ["energy"]


def test_damping_is_a_hypothesis(proof):
    """Damping has no effect on U, but without it no theorem holds. No file has such a config."""
    config = rbstab.load_config(paper_config("embedded", with_gravity=True))
    # The dampers at G and C leave the rotation about the line through both.
    undamped = config.controller.model_copy(update={"L_r": (0.0, 0.0, 0.0)})
    config = config.model_copy(update={"controller": undamped})
    relabelled = proof.model_copy(update={"id": proof_id(config)})
    assert refused(verify(relabelled, config)) == ["hypotheses"]


def test_what_was_not_checked_is_listed(proof, monkeypatch):
    monkeypatch.setattr("rbstab.proof.check.checker.check", lambda *_: [])
    config = rbstab.load_config(paper_config("embedded", with_gravity=True))
    alone, compared = verify(proof).unchecked, verify(proof, config).unchecked
    assert alone[0] == "The energy U was not compared with a config; use --config CONFIG."
    assert alone[1:] == compared
    assert compared == [
        "Values in doubles, which are not proved: Θ, X, own states, energies, levels and passes."
    ]


def test_a_file_without_a_proof_is_refused(proof):
    none = no_proof("id", "the mass is not positive definite")
    (finding,) = verify(none).findings
    assert not finding.verified
    assert finding.text == "There is no proof: the mass is not positive definite."
    old = proof.model_copy(update={"reduced_energy": None})
    (finding,) = verify(old).findings
    assert not finding.verified
    assert "Make the proof again" in finding.text


@pytest.mark.slow
def test_a_proof_that_no_rule_shows_to_be_convex_is_not_refused():
    """The energy of a tied ligament is convex in X, but not each of its terms."""
    config = load_config(PAPER.parent / "examples/ligament_proved.yaml")
    verification = verify(prove(config), config)
    assert refused(verification) == ["convexity"]
    assert verification.takes_too_long
    assert verification.outcome == "not decided: no rule shows that U is convex in what is not Θ"
