"""Protects the folder of a sweep: which content is accepted, and which sweeps may resume in it."""

import os
import shutil

import numpy as np
import pytest
from support.sweeping import Listener, run_sweep
from support.sweeps import FakeEngine, plan_of, shard_files

from rbstab.store.disk.lock import FolderInUseError, locked
from rbstab.store.errors import NotAResultError, ResultExistsError, StoreError
from rbstab.sweep.execution.events import Started
from rbstab.sweep.folder.open_folder import planned_folder
from rbstab.sweep.folder.sweep_folder import read_folder
from rbstab.sweep.folder.sweep_table import open_sweep, read_sweep


def test_a_different_plan_is_refused_or_moves_the_old_one_aside(tmp_path):
    path = tmp_path / "a"
    run_sweep(path)
    before, name = shard_files(path), read_folder(path).manifest.plan_id[:8]
    for other in ({"plan": plan_of(59)}, {"shard_size": 20}):
        with pytest.raises(ResultExistsError, match="--force"):
            run_sweep(path, **other)
    assert shard_files(path) == before
    listener = Listener()
    run_sweep(path, plan_of(59), listener, force=True)
    aside = tmp_path / f"a.{name}"
    assert listener.of(Started)[0].moved_aside == aside
    assert shard_files(aside) == before
    run_sweep(path, plan_of(58), force=True)
    run_sweep(path, plan_of(60), force=True)
    run_sweep(path, plan_of(57), force=True)
    assert (tmp_path / f"a.{name}-1").is_dir()
    # The same plan resumes, so nothing is moved aside.
    again = Listener()
    run_sweep(path, plan_of(57), again, force=True)
    assert (again.computed, again.of(Started)[0].moved_aside) == ([], None)


def test_a_title_is_no_difference(tmp_path):
    run_sweep(tmp_path / "a")
    assert run_sweep(tmp_path / "a", plan_of(title="Another")).finished


def test_other_things_in_the_folder(tmp_path):
    path = tmp_path / "a"
    path.mkdir()
    (path / "thesis.tex").write_text("")
    with pytest.raises(ResultExistsError, match=r"other files \(thesis.tex\)"):
        run_sweep(path)
    run_sweep(path, force=True)
    assert (tmp_path / "a.damaged" / "thesis.tex").exists()
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match="cannot be written"):
        run_sweep(tmp_path / "file")
    with pytest.raises(NotAResultError):
        read_folder(tmp_path)


@pytest.mark.skipif(os.name != "posix", reason="other systems say something else")
def test_a_folder_of_which_nothing_can_be_known(tmp_path):
    nowhere = tmp_path / ("a" * 300)
    for look in (read_folder, lambda path: planned_folder(path, plan_of(60), None)):
        with pytest.raises(StoreError, match="cannot be read: File name too long"):
            look(nowhere)


def test_a_damaged_manifest(tmp_path):
    path = tmp_path / "a"
    run_sweep(path)
    (path / "manifest.json").write_text("{}")
    with pytest.raises(ResultExistsError, match="damaged"):
        run_sweep(path)
    assert run_sweep(path, force=True).finished


def test_what_somebody_has_removed_comes_back(tmp_path):
    path = tmp_path / "a"
    run_sweep(path)
    before = shard_files(path)
    shutil.rmtree(path / "shards")
    (path / "plan.yaml").unlink()
    assert run_sweep(path).finished
    assert shard_files(path) == before
    assert (path / "plan.yaml").read_text() == read_sweep(path / "members.h5")["plan"].item()


def test_other_versions_are_told(tmp_path, monkeypatch):
    run_sweep(tmp_path / "a")
    monkeypatch.setattr(np, "__version__", "99.0")
    listener = Listener()
    run_sweep(tmp_path / "a", listener=listener)
    (changed,) = listener.of(Started)[0].changed_versions
    assert changed.startswith("numpy ")
    assert changed.endswith(" -> 99.0")


def test_killed_before_the_manifest_was_there(tmp_path):
    path = tmp_path / "a"
    (path / "shards").mkdir(parents=True)
    (path / "plan.yaml").write_text("title")
    (path / ".manifest.json.0123.part").write_text("")
    assert run_sweep(path).finished
    assert not list(path.glob(".*.part"))


def test_two_sweeps_into_one_folder(tmp_path):
    path = tmp_path / "a"
    run_sweep(path)
    with locked(path):
        for force in (False, True):
            with pytest.raises(FolderInUseError, match="in use by another process"):
                run_sweep(path, plan_of(59), force=force)


@pytest.mark.parametrize("harm", ["damaged", "removed"])
def test_the_plan_in_the_folder_is_made_whole(tmp_path, harm):
    run_sweep(tmp_path / "a")
    plan = tmp_path / "a" / "plan.yaml"
    before = plan.read_bytes()
    if harm == "removed":
        plan.unlink()
    else:
        plan.write_bytes(before[:100])
    run_sweep(tmp_path / "a", shard_size=None)
    assert plan.read_bytes() == before


def test_a_sweep_that_is_not_finished_cannot_be_opened(tmp_path):
    """However slow the machine is, shard 5 waits for the stop, and shard 6 comes after it."""
    listener = Listener(1)

    class Waiting(FakeEngine):
        def compute(self, start, stop):
            if start >= 40:
                assert listener.stop.wait(600)
            return super().compute(start, stop)

    run_sweep(tmp_path / "a", listener=listener, factory=Waiting, threads=1)
    with pytest.raises(StoreError, match=r"not finished: [1-5] of 6 shards are stored"):
        open_sweep(tmp_path / "a")
