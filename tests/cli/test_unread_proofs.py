"""Stored proofs that cannot be read do not hide the results; a run tries their folder first."""

import shutil
from pathlib import Path

import pytest
from cli.conftest import STORED, ended, json_of, rbstab, success
from support.closed_folders import close

PROOFS = Path("results", "proofs")

PLAN = "base: good.yaml\nvary: {body.mass: {values: [40, 41]}}\n"

WARNING = (
    f"warning: the stored proofs in {PROOFS} cannot be read: Permission denied. "
    "The results are shown without them.\n"
)


@pytest.fixture
def results(folder, monkeypatch):
    """A folder of results with a run, a sweep, and proofs that cannot be read."""
    PROOFS.mkdir(parents=True)
    (PROOFS / f"{'0' * 32}.json").write_text("{}")
    shutil.copy(STORED / "runs" / "embedded.h5", "results")
    shutil.copytree(STORED / "sweeps" / "finished_map", "results/finished_map")
    close(folder / PROOFS, monkeypatch)
    return Path("results")


def test_a_list_shows_the_results(results):
    done = rbstab("list")
    assert (done.exit_code, done.stderr) == (0, WARNING)
    assert str(results / "embedded.h5") in done.stdout
    assert str(results / "finished_map") in done.stdout
    assert "prints what is proved" not in done.stdout


@pytest.mark.parametrize("inside", ["", "embedded.h5", "finished_map"])
def test_a_report_and_show_go_on(inside, results):
    for words in (("report", "--format", "text"), ("show",)):
        done = success(*words, str(results / inside))
        assert done.stderr.count(WARNING) == 1
        assert done.stdout


def test_a_sweep_is_not_called_unproved(folder, monkeypatch):
    """It is not known what the proofs say of its members."""
    Path("plan.yaml").write_text(PLAN)
    success("sweep", "plan.yaml", "--engine", "scipy", "--no-prove")
    PROOFS.mkdir()
    with monkeypatch.context() as patched:
        close(folder / PROOFS, patched)
        (entry,) = json_of("list")
    assert entry["this_start"] == "-"
    (entry,) = json_of("list")
    assert entry["this_start"] == "not proved"


def test_another_folder_that_cannot_be_read_is_named(folder, monkeypatch):
    """It may be a sweep."""
    Path("results/closed").mkdir(parents=True)
    shutil.copy(STORED / "runs" / "embedded.h5", "results")
    close(folder / "results/closed", monkeypatch)
    for words in (("list",), ("report", "results", "--format", "text")):
        done = ended(4, *words)
        assert "embedded" in done.stdout
        assert "cannot be read: Permission denied" in done.stderr
