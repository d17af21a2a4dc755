"""Protects brief proofs, which nobody asked for: they end early, say so, and block no other one."""

import json
from pathlib import Path

import pytest
import yaml
from click.testing import CliRunner
from support.config_elements import CONTROLLER, config_data

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment import proof as module
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.proof_cache import cached_proof, proof_for
from rbstab.experiment.run_to_file import prove_run, run_to_file
from rbstab.experiment.stability import statements_of
from rbstab.experiment.stored_proof.data import STOPPED
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import Proof, no_proof
from rbstab.proof import limits
from rbstab.proof.rest_states import Body
from rbstab.proof.search import BATCH
from rbstab_cli.main import cli

TIED = CONTROLLER | {
    "variant": "visco-elastic",
    "K_c": [9000.0, 9000.0, 9000.0],
    "L_c": [90.0, 90.0, 90.0],
}
DATA = config_data({}, TIED, integration={"duration": 0.02, "samples": 3})
GOES_ON = "rbstab run CONFIG --prove tries more"
IN_RUN = "the same command with --prove tries more"


@pytest.fixture(autouse=True)
def _brief(monkeypatch):
    """A brief proof ends after 100 boxes, and no proof is made for all real θ1 and θ3."""
    monkeypatch.setattr("rbstab.proof.limits.BRIEF", 100)
    monkeypatch.setattr(Body, "wide", lambda *_, **__: None)


@pytest.fixture
def made(monkeypatch):
    """Return the list of the proofs that are made, and whether each was to be brief."""
    calls: list[bool] = []

    def counted(*arguments, prove=module.prove, **options):
        calls.append(options.get("brief", False))
        proof: Proof = prove(*arguments, **options)
        return proof

    monkeypatch.setattr(module, "prove", counted)
    return calls


def test_a_brief_proof_is_not_repeated_and_blocks_no_other(tmp_path, made):
    config = load_config(DATA)
    first = proof_for(tmp_path, config, brief=True)
    assert (first.proved, first.brief, first.outcome) == (False, True, STOPPED)
    assert 100 <= first.examined < 100 + BATCH
    assert first.ended == f"the proof needs more than {first.examined} boxes; {GOES_ON}"
    assert [text for text in statements_of(first) if GOES_ON in text]
    assert proof_for(tmp_path, config, brief=True) == first == cached_proof(tmp_path, config)
    assert made == [True]
    full = proof_for(tmp_path, config)
    assert (full.proved, full.brief) == (True, None)
    assert made == [True, False]
    assert GOES_ON not in " ".join(statements_of(full))
    assert "brief" not in full.model_dump(mode="json")
    # What was asked for is kept by a later run that asks for nothing.
    assert proof_for(tmp_path, config, brief=True) == full
    assert made == [True, False]


def test_a_brief_proof_with_boxes_to_spare_is_the_whole_one(monkeypatch):
    monkeypatch.undo()
    full = module.prove(DATA)
    assert full.unwrapped is not None
    monkeypatch.setattr(limits, "BRIEF", 100)
    brief = module.prove(DATA, brief=True)
    assert (brief.proved, brief.brief) == (False, True)
    assert brief.region is not None
    assert not brief.region.proved
    monkeypatch.setattr(limits, "BRIEF", full.examined + full.unwrapped.examined)
    brief = module.prove(DATA, brief=True)
    assert brief.model_copy(update={"seconds": full.seconds}) == full


def test_a_brief_proof_does_not_replace_one_that_was_stored_in_the_meantime(tmp_path, monkeypatch):
    config = load_config(DATA)
    whole = no_proof(proof_id(config), "found elsewhere")

    def beside(config, problem, *, brief, prove=module.prove):
        proof: Proof = prove(config, problem, brief=brief)
        if brief:
            monkeypatch.setattr(module, "prove", lambda *_, **__: whole)
            proof_for(tmp_path, config)
        return proof

    monkeypatch.setattr(module, "prove", beside)
    assert proof_for(tmp_path, config, brief=True) == whole
    assert cached_proof(tmp_path, config) == whole


def test_a_stored_run_is_completed_by_a_later_proof(tmp_path):
    config = load_config(DATA)
    problem, path = problem_of(config), tmp_path / "x.h5"
    run = run_to_file(config, path, problem)
    brief = proof_for(tmp_path, config, problem, brief=True)
    first = prove_run(run, config, problem, brief, Enclose.BRIEFLY)
    answers = answer_of(first.result, proof=brief)
    assert GOES_ON in answers.this_start.sentence
    assert GOES_ON in answers.whole_range.sentence
    assert Enclose(int(first.result.attributes["convergence_enclosed"])) is Enclose.BRIEFLY
    # A second brief try has nothing to do, and one that is asked for has.
    assert prove_run(first, config, problem, brief, Enclose.BRIEFLY) is first
    proof = proof_for(tmp_path, config, problem)
    done = prove_run(first, config, problem, proof, Enclose.UNTIL_PROVED)
    assert str(answer_of(done.result, proof=proof).this_start).startswith("proved")
    assert str(answer_of(done.result, proof=proof).whole_range).startswith("proved")


def printed(*arguments):
    """Return what a command prints, without the breaks of its lines."""
    done = CliRunner().invoke(cli, list(arguments))
    assert done.exit_code == 0, done.output
    return " ".join(done.stdout.split())


@pytest.mark.parametrize("command", ["run", "stability"])
def test_the_command_that_is_named_goes_on(command, tmp_path, made, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("x.yaml").write_text(yaml.safe_dump(json.loads(json.dumps(DATA))))
    for _ in range(2):
        text = printed("run", "x.yaml", "-q")
        assert "not decided" in text
        assert IN_RUN in text
    assert made == [True]
    asked = ["run", "x.yaml", "-q", "--prove"] if command == "run" else ["stability", "x.yaml"]
    assert IN_RUN not in printed(*asked)
    assert made == [True, False]
    text = printed("run", "x.yaml", "-q")
    assert "not decided" not in text
    assert made == [True, False]
