"""Protects the folder of a sweep: which content is accepted, and which sweeps may resume in it."""

import os
import shutil

import numpy as np
import pytest
from support.sweeping import Listener, run_sweep
from support.sweeps import FakeEngine, plan_of, shard_files

from rbstab.store.errors import NotAResultError, ResultExistsError, StoreError
from rbstab.sweep.execution.events import Started
from rbstab.sweep.folder.open_folder import OtherSweepError, planned_folder
from rbstab.sweep.folder.sweep_folder import read_folder
from rbstab.sweep.folder.sweep_table import open_sweep, read_sweep


def test_force_moves_what_is_there_aside(tmp_path):
    path = tmp_path / "a"
    run_sweep(path)
    before, name = shard_files(path), read_folder(path).manifest.plan_id[:8]
    with pytest.raises(OtherSweepError, match="--force"):
        run_sweep(path, plan_of(59))
    assert shard_files(path) == before
    listener = Listener()
    run_sweep(path, plan_of(59), listener, force=True)
    aside = tmp_path / f"a.{name}"
    assert listener.of(Started)[0].moved_aside == aside
    assert shard_files(aside) == before
    for members in (60, 57):
        run_sweep(path, plan_of(members), force=True)
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
    for harm in (lambda plan: plan.unlink(), lambda plan: plan.write_bytes(b"title: T")):
        shutil.rmtree(path / "shards")
        harm(path / "plan.yaml")
        assert run_sweep(path, shard_size=None).finished
        assert shard_files(path) == before
        assert (path / "plan.yaml").read_text() == read_sweep(path / "members.h5")["plan"].item()


def test_other_versions_are_told(tmp_path, monkeypatch):
    run_sweep(tmp_path / "a")
    monkeypatch.setattr(np, "__version__", "99.0")
    listener = Listener()
    run_sweep(tmp_path / "a", listener=listener)
    (changed,) = listener.of(Started)[0].changed
    assert changed.startswith("numpy ")
    assert changed.endswith(" -> 99.0")


def test_killed_before_the_manifest_was_there(tmp_path):
    path = tmp_path / "a"
    (path / "shards").mkdir(parents=True)
    (path / "plan.yaml").write_text("title")
    (path / ".manifest.json.0123.part").write_text("")
    (path / "shards" / ".00000007.h5.part").write_text("")
    assert run_sweep(path).finished
    assert not list(path.rglob(".*.part"))


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
