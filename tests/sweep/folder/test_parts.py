"""Parts of a sweep: what belongs to each, who may share a folder, and how they are joined."""

import errno
import functools
import os
import shutil
import sys
import time
from pathlib import Path

import pytest
from support.sweeps import FakeEngine, plan_of, shard_files

from rbstab.store.errors import NotAResultError, ResultExistsError
from rbstab.store.lock import FolderInUseError, locked
from rbstab.store.table_file import read_table
from rbstab.sweep.execution.events import Gathering, ShardDone, Started
from rbstab.sweep.folder.open_folder import MAX_WRITE_TIME, open_for_part, open_for_sweep
from rbstab.sweep.folder.parts import Part, part_of, parts_missing, running_parts
from rbstab.sweep.folder.sweep_folder import read_folder
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import gather_folder, sweep_to_folder


def swept(path, plan=None, factory=FakeEngine, on_event=lambda _: None, **options):
    options = SweepOptions(factory, **{"shard_size": 10, "threads": 1, **options})
    return sweep_to_folder(plan or plan_of(), path, options, on_event)


def digest_of(path):
    return read_table(path / "sweep.h5").attributes["arrays_digest"]


@pytest.mark.parametrize("parts", [1, 2, 7, 64, 1000])
@pytest.mark.parametrize("shards", [0, 1, 6, 71])
def test_parts_have_all_shards_once_and_equally_many(parts, shards):
    of = [list(Part(number, parts).of(shards)) for number in range(1, parts + 1)]
    assert sorted(sum(of, [])) == list(range(shards))  # noqa: RUF017
    assert max(map(len, of)) - min(map(len, of)) <= 1


def test_what_names_a_part():
    assert part_of("3/8") == Part(3, 8)
    assert str(part_of("08/8")) == "8/8"
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
            part_of(wrong)


def test_the_parts_of_a_sweep_one_after_the_other(tmp_path):
    path, plan = tmp_path / "a", plan_of(60)
    for number in (3, 1, 4, 2):
        done = swept(path, plan, part=Part(number, 4))
        assert (done.finished, done.inventory.missing, done.comparison) == (False, [], None)
        assert not (path / "sweep.h5").exists()
    gathered = gather_folder(path)
    assert gathered.finished
    swept(tmp_path / "b", plan)
    assert shard_files(path) == shard_files(tmp_path / "b")
    assert digest_of(path) == digest_of(tmp_path / "b")
    assert not list(path.glob(".lock.*"))


def test_a_part_computes_what_is_missing_of_it(tmp_path):
    path = tmp_path / "a"
    events = []
    swept(path, part=Part(2, 3))
    assert [Path(name).stem for name in shard_files(path)] == ["00000001", "00000004"]
    read_folder(path).shard_file(4).write_bytes(b"damaged")
    swept(path, part=Part(2, 3), on_event=events.append)
    assert [event.number for event in events if isinstance(event, ShardDone)] == [4]
    (started,) = [event for event in events if isinstance(event, Started)]
    assert started.members == 20


def test_a_part_without_shards(tmp_path):
    done = swept(tmp_path / "a", part=Part(50, 50))
    assert (done.inventory.members, done.inventory.missing, done.finished) == (0, [], False)


def test_gathering_where_shards_are_missing(tmp_path):
    path = tmp_path / "a"
    for number in (1, 3):
        swept(path, part=Part(number, 3))
    read_folder(path).shard_file(0).write_bytes(b"damaged")
    done = gather_folder(path)
    assert (done.finished, done.inventory.missing) == (False, [0, 1, 4])
    assert done.folder.ranges(done.inventory.missing) == [(0, 20), (40, 50)]
    assert parts_missing(path, done.inventory.missing) == [Part(1, 3), Part(2, 3)]
    assert not (path / "sweep.h5").exists()
    assert parts_missing(tmp_path, [1]) == []


def test_gathering_needs_nothing_but_the_folder(tmp_path):
    swept(tmp_path / "a")
    digest = digest_of(tmp_path / "a")
    moved = tmp_path / "elsewhere" / "b"
    shutil.move(tmp_path / "a", moved)
    again = []
    assert gather_folder(moved, again.append).finished
    assert not any(isinstance(event, Gathering) for event in again)
    (moved / "sweep.h5").unlink()
    anew = []
    assert gather_folder(moved, anew.append).finished
    assert any(isinstance(event, Gathering) for event in anew)
    assert digest_of(moved) == digest


@pytest.mark.parametrize("content", [None, "title: 1", "\0", "other"])
def test_gathering_with_a_plan_that_is_not_that_of_the_folder(tmp_path, content):
    swept(tmp_path / "a", part=Part(1, 1))
    plan = tmp_path / "a" / "plan.yaml"
    if content is None:
        plan.unlink()
    elif content == "other":
        swept(tmp_path / "b", plan_of(61))
        shutil.copy(tmp_path / "b" / "plan.yaml", plan)
    else:
        plan.write_text(content)
    with pytest.raises(NotAResultError, match=r"plan\.yaml"):
        gather_folder(tmp_path / "a")


def test_gathering_what_is_no_sweep(tmp_path):
    with pytest.raises(NotAResultError, match="not the folder of a sweep"):
        gather_folder(tmp_path / "a")
    assert not (tmp_path / "a").exists()


def test_who_may_be_in_a_folder_together(tmp_path):
    path, plan = tmp_path / "a", plan_of()
    with open_for_part(path, plan, 10, Part(1, 3)), open_for_part(path, plan, 10, Part(3, 3)):
        assert running_parts(path) == [Part(1, 3), Part(3, 3)]
        with pytest.raises(FolderInUseError, match=r"running: part 1/3, 3/3"):
            swept(path)
        with pytest.raises(FolderInUseError, match=r"running: part 1/3, 3/3"):
            swept(path, part=Part(3, 3))
        with pytest.raises(FolderInUseError, match="running"):
            swept(path, plan_of(59), force=True)
        with pytest.raises(FolderInUseError):
            gather_folder(path)
        swept(path, part=Part(2, 3))
    assert running_parts(path) == []
    with locked(path), pytest.raises(FolderInUseError, match="in use by another process"):
        swept(path, part=Part(1, 3))


def test_another_plan_or_shard_size_is_refused(tmp_path):
    path = tmp_path / "a"
    swept(path, part=Part(1, 3))
    before = shard_files(path)
    with pytest.raises(ResultExistsError, match="begun with shards of 10 members"):
        swept(path, part=Part(2, 3), shard_size=20)
    with pytest.raises(ResultExistsError, match="holds another sweep"):
        swept(path, plan_of(59), part=Part(2, 3))
    swept(path, part=Part(2, 3), shard_size=None)  # that of the folder
    assert before.items() <= shard_files(path).items()
    assert read_folder(path).manifest.shard_size == 10


def test_a_manifest_that_appears_in_the_same_instant(tmp_path, monkeypatch):
    """Another process is faster between the look at the folder and the writing of the manifest."""
    real, path = os.link, tmp_path / "a"

    def overtaken(size):
        def link(old, new):
            monkeypatch.setattr(os, "link", real)
            with open_for_part(path, plan_of(), size, Part(2, 2)):
                pass
            real(old, new)

        return link

    monkeypatch.setattr(os, "link", overtaken(20))
    with pytest.raises(ResultExistsError, match="begun with shards of 20 members, by another"):
        swept(path, part=Part(1, 2))
    shutil.rmtree(path)
    monkeypatch.setattr(os, "link", overtaken(20))
    swept(path, part=Part(1, 2), shard_size=None)
    assert read_folder(path).manifest.shard_size == 20


def remains(path, age):
    file = path / "shards" / f".00000007.{age}.part"
    file.write_bytes(b"half")
    os.utime(file, (time.time() - age, time.time() - age))
    return file


def test_what_another_part_is_writing_stays(tmp_path):
    path = tmp_path / "a"
    swept(path, part=Part(1, 3))
    fresh, old = remains(path, 5), remains(path, 2 * MAX_WRITE_TIME)
    swept(path, part=Part(2, 3))
    assert fresh.exists()
    assert old.exists()
    # A lock may be known on its own machine only.
    swept(path)
    assert fresh.exists()
    assert not old.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="its locks are not those of files there")
@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks(tmp_path, monkeypatch, number):
    def unknown(*_):
        raise OSError(number, os.strerror(number))

    path, plan = tmp_path / "a", plan_of()
    monkeypatch.setattr("fcntl.flock", unknown)
    with open_for_sweep(path, plan, 10):
        fresh = remains(path, 5)
        with open_for_sweep(path, plan, 10):
            assert fresh.exists()
    with open_for_part(path, plan, 10, Part(1, 2)), open_for_part(path, plan, 10, Part(1, 2)):
        assert running_parts(path) == []
        fresh = remains(path, 5)
        with open_for_sweep(path, plan, 10):
            assert fresh.exists()
        swept(path, plan)
    assert gather_folder(path).finished


def test_a_part_that_fails_fast_stops_itself_alone(tmp_path):
    path = tmp_path / "a"
    failing = functools.partial(FakeEngine, failing=(15,))
    done = swept(path, factory=failing, part=Part(2, 3), fail_fast=True)
    assert (done.inventory.first_failed, done.inventory.missing) == (15, [4])
    done = swept(path, factory=failing, part=Part(1, 3), fail_fast=True)
    assert (done.inventory.first_failed, done.inventory.missing) == (None, [])
