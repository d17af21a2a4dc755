"""Protects the parts of a sweep, and which commands may be in one folder together."""

import errno
import functools
import os
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest
from support import sweeping
from support.sweeping import Listener, digest_of
from support.sweeps import FakeEngine, plan_of, shard_files

from rbstab.store.disk.lock import FolderInUseError, locked
from rbstab.store.document import write_document
from rbstab.sweep.execution.events import Finishing, Started
from rbstab.sweep.folder.open_folder import OtherSweepError, Part, open_folder, parse_part
from rbstab.sweep.folder.shard_inventory import shard_inventory
from rbstab.sweep.folder.sweep_folder import read_folder

run_sweep = functools.partial(sweeping.run_sweep, threads=1)


@pytest.mark.parametrize("parts", [1, 2, 7, 64, 1000])
@pytest.mark.parametrize("shards", [0, 1, 6, 71])
def test_parts_have_all_shards_once_and_equally_many(parts, shards):
    of = [list(Part(number, parts).shard_numbers(shards)) for number in range(1, parts + 1)]
    assert sorted(sum(of, [])) == list(range(shards))  # noqa: RUF017
    assert max(map(len, of)) - min(map(len, of)) <= 1


def test_what_names_a_part():
    assert parse_part("3/8") == Part(3, 8)
    assert str(parse_part("08/8")) == "8/8"


def test_the_parts_of_a_sweep_one_after_the_other(tmp_path):
    path, plan = tmp_path / "a", plan_of(60)
    for number in (3, 1, 4, 2):
        done = run_sweep(path, plan, part=Part(number, 4))
        assert (done.finished, done.inventory.missing, done.comparison) == (False, [], None)
        assert not (path / "members.h5").exists()
    assert run_sweep(path, plan, part=Part(50, 50)).inventory.members == 0
    assert run_sweep(path, plan).finished
    run_sweep(tmp_path / "b", plan)
    assert shard_files(path) == shard_files(tmp_path / "b")
    assert digest_of(path) == digest_of(tmp_path / "b")


def test_a_part_computes_what_is_missing_of_it(tmp_path):
    path = tmp_path / "a"
    listener = Listener()
    run_sweep(path, part=Part(2, 3))
    assert [Path(name).stem for name in shard_files(path)] == ["00000001", "00000004"]
    read_folder(path).shard_file(4).write_bytes(b"damaged")
    inventory = shard_inventory(read_folder(path))
    assert (inventory.missing, inventory.damaged) == ([0, 2, 3, 4, 5], [4])
    assert read_folder(path).ranges(inventory.missing) == [(0, 10), (20, 60)]
    run_sweep(path, listener=listener, part=Part(2, 3))
    assert listener.computed == [4]
    (started,) = listener.of(Started)
    assert started.members == 20


def test_a_folder_that_was_moved_is_finished_there(tmp_path):
    run_sweep(tmp_path / "a")
    digest = digest_of(tmp_path / "a")
    moved = tmp_path / "elsewhere" / "b"
    shutil.move(tmp_path / "a", moved)
    (moved / "members.h5").unlink()
    listener = Listener()
    assert run_sweep(moved, listener=listener).finished
    assert [type(event) for event in listener.events] == [Started, Finishing]
    assert digest_of(moved) == digest


def test_only_who_replaces_something_must_be_alone(tmp_path):
    path, plan = tmp_path / "a", plan_of()
    replacing: tuple[dict[str, Any], ...] = (
        {"force": True},
        {"retry_failed": True},
        {"plan": plan_of(59), "force": True},
    )
    with open_folder(path, plan, 10), open_folder(path, plan, None):
        run_sweep(path, part=Part(2, 3))
        assert run_sweep(path).finished
        for options in replacing:
            with pytest.raises(FolderInUseError, match="in use by another process"):
                run_sweep(path, **options)
    before = shard_files(path)
    for alone in (locked(path), open_folder(path, plan, 10, force=True)):
        with alone:
            for refused in ({}, {"part": Part(1, 3)}, *replacing):
                with pytest.raises(FolderInUseError):
                    run_sweep(path, **refused)
    assert shard_files(path) == before
    assert run_sweep(path, retry_failed=True).finished


def test_another_plan_or_shard_size_is_refused(tmp_path):
    path = tmp_path / "a"
    run_sweep(path, part=Part(1, 3))
    before = {file: file.read_bytes() for file in path.rglob("*.*") if file.is_file()}
    with pytest.raises(OtherSweepError, match="started with shards of 10 members"):
        run_sweep(path, part=Part(2, 3), shard_size=20)
    with pytest.raises(OtherSweepError, match="holds another sweep"):
        run_sweep(path, plan_of(59))
    assert {file: file.read_bytes() for file in before} == before
    run_sweep(path, part=Part(2, 3), shard_size=None)  # the size is that of the folder
    assert read_folder(path).manifest.shard_size == 10


def test_a_sweep_that_another_command_begins_meanwhile_is_no_foreign_file(tmp_path, monkeypatch):
    real, path = Path.iterdir, tmp_path / "a"

    def begun_before(folder):
        monkeypatch.setattr(Path, "iterdir", real)
        run_sweep(path)
        return real(folder)

    monkeypatch.setattr(Path, "iterdir", begun_before)
    assert run_sweep(path).finished


@pytest.mark.parametrize("size", [10, None])
def test_a_manifest_that_appears_in_the_same_instant(tmp_path, monkeypatch, size):
    """Another process writes its manifest after this one has checked that there is none."""
    real, path = os.link, tmp_path / "a"

    def overtaken(old, new):
        monkeypatch.setattr(os, "link", real)
        run_sweep(path, shard_size=20)
        real(old, new)

    monkeypatch.setattr(os, "link", overtaken)
    if size is None:
        assert run_sweep(path, shard_size=None).finished
    else:
        with pytest.raises(OtherSweepError, match="started with shards of 20 members"):
            run_sweep(path, shard_size=size)
    assert read_folder(path).manifest.shard_size == 20


def test_a_shard_of_another_manifest_is_not_read(tmp_path):
    """The plan is the same, and the members are, but not the versions."""
    for name in "ab":
        run_sweep(tmp_path / name)
    a, b = (read_folder(tmp_path / name) for name in "ab")
    assert a.id == b.id
    manifest = (tmp_path / "b" / "manifest.json").read_text()
    changed = b.manifest.model_copy(update={"versions": {**b.manifest.versions, "numpy": "0"}})
    (tmp_path / "b" / "manifest.json").unlink()
    write_document(tmp_path / "b" / "manifest.json", changed.data)
    assert (tmp_path / "b" / "manifest.json").read_text() != manifest
    assert shard_inventory(read_folder(tmp_path / "b")).damaged == [0, 1, 2, 3, 4, 5]
    shutil.copy(a.shard_file(1), a.shard_file(2))
    assert shard_inventory(a).damaged == [2]


@pytest.mark.skipif(sys.platform == "win32", reason="its locks are not those of files there")
@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks(tmp_path, monkeypatch, number):
    def refuse(*_):
        raise OSError(number, os.strerror(number))

    path, plan = tmp_path / "a", plan_of()
    monkeypatch.setattr("fcntl.flock", refuse)
    with open_folder(path, plan, 10), open_folder(path, plan, 10, alone=True):
        assert run_sweep(path, plan).finished


def test_a_part_that_fails_fast_stops_itself_alone(tmp_path):
    path = tmp_path / "a"
    failing = functools.partial(FakeEngine, failing=(15,))
    done = run_sweep(path, factory=failing, part=Part(2, 3), fail_fast=True)
    assert (done.inventory.first_failed, done.inventory.missing) == (15, [4])
    done = run_sweep(path, factory=failing, part=Part(1, 3), fail_fast=True)
    assert (done.inventory.first_failed, done.inventory.missing) == (None, [])
