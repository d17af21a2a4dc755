"""`rbstab run` proves what it can unasked, within a limit, and ends with the answers."""

import json
from pathlib import Path

import pytest
from cli.conftest import Invoke
from click.testing import Result

import rbstab
from rbstab.store.errors import StoreError

OUTSIDE = ("--set", "controller.variant=permanent", "--set", "initial.angular_velocity=[16,32,-16]")


@pytest.fixture
def done(folder: Path, rbstab: Invoke) -> Result:
    """What the command printed for one config."""
    return rbstab("run", "good.yaml", *OUTSIDE)


def test_the_answers_come_last(done: Result) -> None:
    assert done.exit_code == 0, done.output
    head, *_, outcome, desired, this_start, whole_range, pushes, modes = done.stdout.splitlines()
    assert head.split()[:2] == ["file", "outcome"]
    assert outcome.startswith("  Outcome:     still moving at t = 0.1 s: at (")
    assert outcome.endswith("(the exact motion is proved to converge to (0°, 0°, 0°)): seen.")
    assert desired == "  Desired:     upright (default), within 10°."
    assert pushes.startswith("  Pushes:      proved: ")
    assert modes.startswith("  Modes:       natural frequencies ")
    assert this_start.startswith("  This start:  proved: ")
    assert whole_range.startswith("  Whole range: proved: ")


def test_what_is_proved_is_stored(done: Result, folder: Path) -> None:
    stored = rbstab.open_result(folder / "results/good.h5")
    assert stored.attributes["convergence"] == "proved"
    assert len(list((folder / "results/proofs").iterdir())) == 1


def test_nothing_is_proved_twice(
    done: Result, folder: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise AssertionError

    monkeypatch.setattr("rbstab.experiment.proof.prove", fail)
    monkeypatch.setattr("rbstab.experiment.convergence.exact_motion.prove_convergence", fail)
    again = rbstab("run", "good.yaml", *OUTSIDE)
    assert again.exit_code == 0, again.output
    assert again.stdout == done.stdout
    assert "already done" in again.stderr


def test_no_proof_on_request(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("run", "good.yaml", "--no-prove")
    assert "  This start:  not decided: the Lyapunov function v fell" in done.stdout
    assert "  Whole range: not decided: " in done.stdout
    assert not (folder / "results/proofs").exists()
    assert "is stored; the same command with --prove tries to make it." in done.stdout
    assert "CONFIG" not in done.stdout
    proved = rbstab("run", "good.yaml", "--no-prove", "--prove")
    assert "  This start:  proved: " in proved.stdout


def test_the_answers_of_json(folder: Path, rbstab: Invoke) -> None:
    (data,) = json.loads(rbstab("run", "good.yaml", "--json").stdout)
    assert {question: answer["word"] for question, answer in data["answers"].items()} == {
        "this_start": "proved",
        "whole_range": "proved",
        "pushes": "proved",
    }
    assert data["outcome"]["kind"] == "moving"
    assert data["outcome"]["rest_state"] == 1
    shown = json.loads(rbstab("show", "results/good.h5", "--json").stdout)
    assert [shown[key] for key in ("answers", "outcome")] == [data["answers"], data["outcome"]]


def test_a_run_without_its_proof_is_kept(
    folder: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise StoreError("the proof cannot be written")

    monkeypatch.setattr("rbstab.experiment.proof_cache.write_document", fail)
    done = rbstab("run", "good.yaml")
    assert done.exit_code == 4
    assert "good.yaml: the proof cannot be written" in done.stderr
    assert "  This start:  not decided: the Lyapunov function v fell" in done.stdout
    assert Path("results/good.h5").is_file()


def test_a_folder_whose_parent_holds_a_file_of_the_same_name(folder: Path, rbstab: Invoke) -> None:
    """The file is not in the way of one with this name in a folder that is still missing."""
    assert rbstab("run", "good.yaml", "--no-prove", "-q").exit_code == 0
    done = rbstab("run", "good.yaml", "--no-prove", "-q", "-o", "results/again")
    assert done.exit_code == 0, done.output
    assert Path("results/again/good.h5").is_file()
