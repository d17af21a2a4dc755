"""Protects the parts of a sweep: their shards, and who may share a folder."""

import errno
import functools
import os
import shutil
import sys
import time
from pathlib import Path

import pytest
from support import sweeping
from support.sweeping import Listener, digest_of
from support.sweeps import FakeEngine, plan_of, shard_files

from rbstab.store.disk.lock import FolderInUseError, locked
from rbstab.store.errors import ResultExistsError
from rbstab.sweep.execution.events import Finishing, Started
from rbstab.sweep.folder.open_folder import MAX_WRITE_TIME, open_for_part, open_for_sweep
from rbstab.sweep.folder.parts import Part, parse_part, parts_with_missing, running_parts
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
    for wrong in (
        "0/8",
        "9/8",
        "-1/8",
        "1/0",
        "1",
        "1/",
        "/8",
        "1/8/2",
        "a/b",
        "",
        "1.0/2",
        "1 /2",
    ):
        with pytest.raises(ValueError, match="part"):
            parse_part(wrong)


def test_the_parts_of_a_sweep_one_after_the_other(tmp_path):
    path, plan = tmp_path / "a", plan_of(60)
    for number in (3, 1, 4, 2):
        done = run_sweep(path, plan, part=Part(number, 4))
        assert (done.finished, done.inventory.missing, done.comparison) == (False, [], None)
        assert not (path / "members.h5").exists()
    assert run_sweep(path, plan).finished
    run_sweep(tmp_path / "b", plan)
    assert shard_files(path) == shard_files(tmp_path / "b")
    assert digest_of(path) == digest_of(tmp_path / "b")
    assert not list(path.glob(".lock.*"))


def test_a_part_computes_what_is_missing_of_it(tmp_path):
    path = tmp_path / "a"
    listener = Listener()
    run_sweep(path, part=Part(2, 3))
    assert [Path(name).stem for name in shard_files(path)] == ["00000001", "00000004"]
    read_folder(path).shard_file(4).write_bytes(b"damaged")
    run_sweep(path, listener=listener, part=Part(2, 3))
    assert listener.computed == [4]
    (started,) = listener.of(Started)
    assert started.members == 20


def test_a_part_without_shards(tmp_path):
    done = run_sweep(tmp_path / "a", part=Part(50, 50))
    assert (done.inventory.members, done.inventory.missing, done.finished) == (0, [], False)


def test_the_parts_of_missing_shards(tmp_path):
    path = tmp_path / "a"
    for number in (1, 3):
        run_sweep(path, part=Part(number, 3))
    read_folder(path).shard_file(0).write_bytes(b"damaged")
    found = shard_inventory(read_folder(path))
    assert found.missing == [0, 1, 4]
    assert read_folder(path).ranges(found.missing) == [(0, 20), (40, 50)]
    assert parts_with_missing(path, found.missing) == [Part(1, 3), Part(2, 3)]
    assert not (path / "members.h5").exists()
    assert parts_with_missing(tmp_path, [1]) == []


def test_a_folder_that_was_moved_is_finished_there(tmp_path):
    run_sweep(tmp_path / "a")
    digest = digest_of(tmp_path / "a")
    moved = tmp_path / "elsewhere" / "b"
    shutil.move(tmp_path / "a", moved)
    for lost in (False, True):
        if lost:
            (moved / "members.h5").unlink()
        listener = Listener()
        assert run_sweep(moved, listener=listener).finished
        assert bool(listener.of(Finishing)) == lost
        assert digest_of(moved) == digest


def test_who_may_be_in_a_folder_together(tmp_path):
    path, plan = tmp_path / "a", plan_of()
    with open_for_part(path, plan, 10, Part(1, 3)), open_for_part(path, plan, 10, Part(3, 3)):
        assert running_parts(path) == [Part(1, 3), Part(3, 3)]
        with pytest.raises(FolderInUseError, match=r"running: part 1/3, 3/3"):
            run_sweep(path)
        with pytest.raises(FolderInUseError, match=r"running: part 1/3, 3/3"):
            run_sweep(path, part=Part(3, 3))
        with pytest.raises(FolderInUseError, match="running"):
            run_sweep(path, plan_of(59), force=True)
        run_sweep(path, part=Part(2, 3))
    assert running_parts(path) == []
    with locked(path), pytest.raises(FolderInUseError, match="in use by another process"):
        run_sweep(path, part=Part(1, 3))


def test_another_plan_or_shard_size_is_refused(tmp_path):
    path = tmp_path / "a"
    run_sweep(path, part=Part(1, 3))
    before = shard_files(path)
    with pytest.raises(ResultExistsError, match="started with shards of 10 members"):
        run_sweep(path, part=Part(2, 3), shard_size=20)
    with pytest.raises(ResultExistsError, match="holds another sweep"):
        run_sweep(path, plan_of(59), part=Part(2, 3))
    run_sweep(path, part=Part(2, 3), shard_size=None)  # the size is that of the folder
    assert before.items() <= shard_files(path).items()
    assert read_folder(path).manifest.shard_size == 10


def test_a_manifest_that_appears_in_the_same_instant(tmp_path, monkeypatch):
    """Another process writes its manifest after this one has checked that there is none."""
    real, path = os.link, tmp_path / "a"

    def overtaken(size):
        def link(old, new):
            monkeypatch.setattr(os, "link", real)
            with open_for_part(path, plan_of(), size, Part(2, 2)):
                pass
            real(old, new)

        return link

    monkeypatch.setattr(os, "link", overtaken(20))
    with pytest.raises(ResultExistsError, match="started with shards of 20 members, by another"):
        run_sweep(path, part=Part(1, 2))
    shutil.rmtree(path)
    monkeypatch.setattr(os, "link", overtaken(20))
    run_sweep(path, part=Part(1, 2), shard_size=None)
    assert read_folder(path).manifest.shard_size == 20


def partial_file(path, age):
    """Write a half-written shard of some age, s, and return its path."""
    file = path / "shards" / f".00000007.{age}.part"
    file.write_bytes(b"half")
    os.utime(file, (time.time() - age, time.time() - age))
    return file


def test_what_another_part_is_writing_stays(tmp_path):
    path = tmp_path / "a"
    run_sweep(path, part=Part(1, 3))
    fresh, old = partial_file(path, 5), partial_file(path, 2 * MAX_WRITE_TIME)
    run_sweep(path, part=Part(2, 3))
    assert fresh.exists()
    assert old.exists()
    # Locks of other machines may be invisible, so recent partial files are kept.
    run_sweep(path)
    assert fresh.exists()
    assert not old.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="its locks are not those of files there")
@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks(tmp_path, monkeypatch, number):
    def refuse(*_):
        raise OSError(number, os.strerror(number))

    path, plan = tmp_path / "a", plan_of()
    monkeypatch.setattr("fcntl.flock", refuse)
    with open_for_sweep(path, plan, 10):
        fresh = partial_file(path, 5)
        with open_for_sweep(path, plan, 10):
            assert fresh.exists()
    with open_for_part(path, plan, 10, Part(1, 2)), open_for_part(path, plan, 10, Part(1, 2)):
        assert running_parts(path) == []
        fresh = partial_file(path, 5)
        with open_for_sweep(path, plan, 10):
            assert fresh.exists()
        run_sweep(path, plan)
    assert run_sweep(path, plan).finished


def test_a_part_that_fails_fast_stops_itself_alone(tmp_path):
    path = tmp_path / "a"
    failing = functools.partial(FakeEngine, failing=(15,))
    done = run_sweep(path, factory=failing, part=Part(2, 3), fail_fast=True)
    assert (done.inventory.first_failed, done.inventory.missing) == (15, [4])
    done = run_sweep(path, factory=failing, part=Part(1, 3), fail_fast=True)
    assert (done.inventory.first_failed, done.inventory.missing) == (None, [])
