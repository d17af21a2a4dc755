"""Protects atomic writes: a file is absent, unchanged or complete, even if writing fails.

Partial files of living writers stay, and those that others left are removed.
"""

import errno
import gc
import os
import signal
import stat
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from support.open_files import open_descriptors
from support.results import result

from rbstab.store.disk import atomic, lock
from rbstab.store.disk.atomic import (
    PARTIAL_SUFFIX,
    atomic_file,
    remove_all_abandoned,
    write_all,
    write_atomically,
)
from rbstab.store.disk.lock import try_lock
from rbstab.store.errors import ResultExistsError
from rbstab.store.result import write_result

NEW = b"new" * 100_000
OLD = b"old" * 50_000


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def failing(number):
    return raising(OSError(number, os.strerror(number)))


def raising(error):
    def fail(*arguments, **options):
        raise error

    return fail


@pytest.fixture(params=["new file", "existing file"])
def path(request, tmp_path):
    """A path to write, absent or with old content; a test that fails to write leaves it so."""
    path = tmp_path / "a.h5"
    if request.param == "existing file":
        path.write_bytes(OLD)
    before = {entry: entry.read_bytes() for entry in tmp_path.iterdir()}
    descriptors = open_descriptors()
    yield path
    assert {entry: entry.read_bytes() for entry in tmp_path.iterdir()} == before
    assert open_descriptors() == descriptors


FULL = OSError(errno.ENOSPC, "No space left")


@pytest.mark.parametrize(
    ("module", "name", "error"),
    [
        (os, "fsync", FULL),
        (os, "fsync", KeyboardInterrupt()),
        (os, "fsync", MemoryError()),
        (os, "fsync", SystemExit()),
        (atomic, "try_lock", KeyboardInterrupt()),
    ],
)
def test_an_error_leaves_nothing_behind(path, monkeypatch, module, name, error):
    """A full disk is often not reported before fsync."""
    monkeypatch.setattr(module, name, raising(error))
    with pytest.raises(type(error)):
        write_atomically(path, NEW, replace=True)


@pytest.mark.skipif(sys.platform == "win32", reason="it has no limit of file sizes")
def test_the_disk_takes_only_a_part(path):
    """The limit of file sizes cuts a real write short, as a full disk does."""
    import resource

    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(NEW) // 2, old[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            write_atomically(path, NEW, replace=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
        signal.signal(signal.SIGXFSZ, handler)


@pytest.mark.parametrize("stage", ["replace", "link"])
def test_the_name_cannot_be_given(tmp_path, stage, monkeypatch):
    path = tmp_path / "a.h5"
    monkeypatch.setattr(os, stage, failing(errno.EIO))
    monkeypatch.setattr(os, "rename", failing(errno.EIO))
    with pytest.raises(OSError, match="Input/output error"):
        write_atomically(path, NEW, replace=stage == "replace")
    assert names(tmp_path) == []


@pytest.mark.parametrize("content", [NEW, b"less than a buffer"])
@pytest.mark.parametrize("replace", [False, True])
def test_content_is_on_the_disk_before_the_name(tmp_path, replace, content, monkeypatch):
    """Otherwise a power cut leaves a name without content. Then the folder is synced too."""
    path, seen = tmp_path / "a.h5", []
    fsync = os.fsync

    def watched(descriptor):
        status = os.fstat(descriptor)
        kind = "folder" if stat.S_ISDIR(status.st_mode) else f"file of {status.st_size}"
        seen.append((kind, path.exists()))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", watched)
    # Workers of other tests have descriptors until they are collected.
    gc.collect()
    before = open_descriptors()
    write_atomically(path, content, replace=replace)
    assert open_descriptors() == before
    assert seen == [(f"file of {len(content)}", False), ("folder", True)]


@pytest.mark.parametrize(
    ("number", "is_reported"), [(errno.EINVAL, False), (errno.EIO, True), (errno.ENOSPC, True)]
)
def test_a_folder_that_fails_to_sync(tmp_path, monkeypatch, number, is_reported):
    """Some file systems refuse it. On a failure a power cut may take the name of the whole file."""
    fsync = os.fsync

    def only_files(descriptor):
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(number, os.strerror(number))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", only_files)
    message = ""
    try:
        write_atomically(tmp_path / "a.h5", NEW)
    except OSError as error:
        message = str(error)
    assert (os.strerror(number) in message) == is_reported
    assert (tmp_path / "a.h5").read_bytes() == NEW
    assert names(tmp_path) == ["a.h5"]


@pytest.mark.parametrize("kind", ["file", "link that leads nowhere"])
def test_an_existing_name_is_not_overwritten(tmp_path, kind):
    """The target of the link may be on a disk that is not mounted now."""
    path = tmp_path / "a.h5"
    if kind == "file":
        path.write_bytes(OLD)
    else:
        path.symlink_to(tmp_path / "elsewhere" / "b.h5")
    before = path.lstat()
    with pytest.raises(ResultExistsError, match=r"a\.h5 exists already"):
        write_atomically(path, NEW)
    after = path.lstat()
    assert (after.st_ino, after.st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert names(tmp_path) == ["a.h5"]


@pytest.mark.parametrize("number", [errno.EPERM, errno.EOPNOTSUPP, errno.EMLINK])
def test_without_hard_links(tmp_path, monkeypatch, number):
    """exFAT and some network file systems have none."""
    monkeypatch.setattr(os, "link", failing(number))
    path = tmp_path / "a.h5"
    write_atomically(path, OLD)
    with pytest.raises(ResultExistsError, match=r"a\.h5 exists already"):
        write_atomically(path, NEW)
    assert path.read_bytes() == OLD
    write_atomically(path, NEW, replace=True)
    assert path.read_bytes() == NEW
    assert names(tmp_path) == ["a.h5"]


def test_permissions_follow_the_mask(tmp_path, umask):
    for mask in (0o022, 0o027, 0o077, 0o002):
        umask(mask)
        path = tmp_path / f"{mask:o}.h5"
        write_result(path, result())
        assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~mask


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EIO])
def test_without_locks(tmp_path, monkeypatch, number):
    """A lock only protects the partial file from other writers; without one nothing is lost."""
    monkeypatch.setattr(atomic, "try_lock", failing(number))
    write_atomically(tmp_path / "a.h5", NEW)
    assert (tmp_path / "a.h5").read_bytes() == NEW
    assert names(tmp_path) == ["a.h5"]


@pytest.mark.parametrize("letter", ["a", "€"])
def test_a_name_as_long_as_the_file_system_allows(tmp_path, letter):
    path = tmp_path / f"{letter * (250 // len(letter.encode()))}.h5"
    write_atomically(path, NEW)
    assert names(tmp_path) == [path.name]


@pytest.mark.parametrize("remove", [failing(errno.EIO), lambda *_, **__: None])
def test_a_partial_name_that_stays_is_not_written_to_again(tmp_path, monkeypatch, remove):
    """A process that is killed in between, too, leaves both names of one file."""
    path = tmp_path / "a.h5"
    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", remove)
        write_atomically(path, OLD)
    assert path.stat().st_nlink == len(names(tmp_path)) == 2
    with pytest.raises(ResultExistsError):
        write_atomically(path, NEW)
    assert path.read_bytes() == OLD
    write_atomically(path, NEW, replace=True)
    assert names(tmp_path) == ["a.h5"]


def test_the_next_writer_removes_what_a_killed_one_left(tmp_path):
    (tmp_path / f".a.h5{PARTIAL_SUFFIX}").write_bytes(b"half")
    write_atomically(tmp_path / "a.h5", NEW)
    assert (tmp_path / "a.h5").read_bytes() == NEW
    assert names(tmp_path) == ["a.h5"]


def test_a_living_writer_keeps_its_partial_file(tmp_path):
    path = tmp_path / "a.h5"
    with atomic_file(path, replace=True) as first:
        write_all(first, b"first")
        with atomic_file(path, replace=True) as second:
            write_all(second, b"second")
            assert len(names(tmp_path)) == 2
        assert path.read_bytes() == b"second"
    assert path.read_bytes() == b"first"
    assert names(tmp_path) == ["a.h5"]


@pytest.mark.skipif(sys.platform == "win32", reason="there a writer may remove the file of another")
def test_many_threads_write_one_file(tmp_path):
    """Each may take the partial file of another for one that was left, in its first instant."""
    path = tmp_path / "a.h5"

    def write(letter):
        for _ in range(30):
            write_atomically(path, letter * 1000, replace=True)

    with ThreadPoolExecutor(8) as pool:
        for done in [pool.submit(write, bytes([97 + k])) for k in range(8)]:
            done.result()
    assert path.read_bytes() in [bytes([97 + k]) * 1000 for k in range(8)]
    assert names(tmp_path) == ["a.h5"]


@pytest.mark.skipif(sys.platform == "win32", reason="it keeps files that are open")
def test_a_new_partial_file_that_another_writer_removes_is_made_again(tmp_path, monkeypatch):
    """The other writer has tested the lock in the instant before it was taken."""
    others = [1, 2]

    def remove_first(file):
        if others:
            others.pop()
            Path(file.name).unlink()
        return try_lock(file)

    monkeypatch.setattr(atomic, "try_lock", remove_first)
    before = open_descriptors()
    # A file that is not closed is an error: see filterwarnings in pyproject.toml.
    write_atomically(tmp_path / "a.h5", NEW)
    assert others == []
    assert (tmp_path / "a.h5").read_bytes() == NEW
    assert names(tmp_path) == ["a.h5"]
    assert open_descriptors() == before


def test_what_killed_writers_left_in_a_folder_is_removed(tmp_path):
    (tmp_path / ".other").touch()
    (tmp_path / f".a.0123{PARTIAL_SUFFIX}").touch()
    with atomic_file(tmp_path / "b"):
        remove_all_abandoned(tmp_path)
        assert names(tmp_path) == [f".b{PARTIAL_SUFFIX}", ".other"]


@pytest.mark.skipif(os.name == "nt", reason="no folder with an open file is moved there")
def test_the_lock_of_a_folder_that_was_just_moved_is_not_that_of_the_new_one(tmp_path, monkeypatch):
    folder, real = tmp_path / "a", lock.try_lock
    folder.mkdir()

    def moved_before(file, *, shared=False):
        folder.rename(tmp_path / "aside")
        folder.mkdir()
        return real(file, shared=shared)

    with monkeypatch.context() as patch:
        patch.setattr(lock, "try_lock", moved_before)
        with pytest.raises(lock.FolderInUseError, match="just moved"), lock.locked(folder):
            pass
    with lock.locked(folder):
        assert lock.is_locked(folder)
