"""Protects atomic writes: a file is absent, unchanged or complete, even if writing fails."""

import errno
import gc
import os
import signal
import stat
import sys
from pathlib import Path

import pytest
from support.open_files import open_descriptors
from support.results import result

from rbstab.store.disk import atomic, lock
from rbstab.store.disk.atomic import (
    write_atomically,
)
from rbstab.store.errors import ResultExistsError
from rbstab.store.result import write_result

NEW = b"new" * 100_000
OLD = b"old" * 50_000


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def failing(number):
    def fail(*arguments, **options):
        raise OSError(number, os.strerror(number))

    return fail


@pytest.fixture(params=["new file", "existing file"])
def path(request, tmp_path):
    """A path to write, absent or with old content."""
    path = tmp_path / "a.h5"
    if request.param == "existing file":
        path.write_bytes(OLD)
    return path


@pytest.fixture
def is_unchanged(path):
    """A function: whether the folder is as it was before the test."""
    before = path.read_bytes() if path.exists() else None

    def is_unchanged():
        if before is None:
            return names(path.parent) == []
        return names(path.parent) == [path.name] and path.read_bytes() == before

    return is_unchanged


def test_fsync_fails(path, is_unchanged, monkeypatch):
    """A full disk is often not reported before fsync."""
    monkeypatch.setattr(os, "fsync", failing(errno.ENOSPC))
    with pytest.raises(OSError, match="No space left"):
        write_atomically(path, NEW, replace=True)
    assert is_unchanged()


@pytest.mark.skipif(sys.platform == "win32", reason="it has no limit of file sizes")
def test_the_disk_takes_only_a_part(path, is_unchanged):
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
    assert is_unchanged()


@pytest.mark.parametrize("stage", ["replace", "link"])
def test_the_name_cannot_be_given(tmp_path, stage, monkeypatch):
    path = tmp_path / "a.h5"
    monkeypatch.setattr(os, stage, failing(errno.EIO))
    monkeypatch.setattr(os, "rename", failing(errno.EIO))
    with pytest.raises(OSError, match="Input/output error"):
        write_atomically(path, NEW, replace=stage == "replace")
    assert names(tmp_path) == []


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError, SystemExit])
def test_an_interruption_leaves_nothing(path, is_unchanged, monkeypatch, error):
    def interrupt(descriptor):
        raise error

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(error):
        write_atomically(path, NEW, replace=True)
    assert is_unchanged()


@pytest.mark.parametrize("content", [NEW, b"less than a buffer"])
@pytest.mark.parametrize("replace", [False, True])
def test_content_is_on_the_disk_before_the_name(tmp_path, replace, content, monkeypatch):
    """Otherwise a power cut leaves a name without content. Then the folder is synced too."""
    path, seen = tmp_path / "a.h5", []
    fsync = os.fsync

    def watched(descriptor):
        found = os.fstat(descriptor)
        kind = "folder" if stat.S_ISDIR(found.st_mode) else f"file of {found.st_size}"
        seen.append((kind, path.exists()))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", watched)
    write_atomically(path, content, replace=replace)
    assert seen == [(f"file of {len(content)}", False), ("folder", True)]


def test_no_descriptor_is_left_open(tmp_path):
    # Workers of other tests have descriptors until they are collected.
    gc.collect()
    before = open_descriptors()
    for index in range(5):
        write_atomically(tmp_path / f"{index}.h5", NEW)
    assert open_descriptors() == before


def test_a_folder_that_cannot_be_synced_is_no_failure(tmp_path, monkeypatch):
    """Some file systems refuse it; the file is complete nevertheless."""
    fsync = os.fsync

    def only_files(descriptor):
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", only_files)
    write_atomically(tmp_path / "a.h5", NEW)
    assert (tmp_path / "a.h5").read_bytes() == NEW


def test_an_existing_file_is_not_overwritten(tmp_path):
    path = tmp_path / "a.h5"
    path.write_bytes(OLD)
    before = path.stat()
    with pytest.raises(ResultExistsError, match=r"a\.h5 exists already"):
        write_atomically(path, NEW)
    assert path.read_bytes() == OLD
    assert (path.stat().st_ino, path.stat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert names(tmp_path) == ["a.h5"]


def test_a_link_that_leads_nowhere_is_a_name_that_is_taken(tmp_path):
    """Its target may be on a disk that is not mounted now."""
    path = tmp_path / "a.h5"
    path.symlink_to(tmp_path / "elsewhere" / "b.h5")
    with pytest.raises(ResultExistsError, match="exists already"):
        write_atomically(path, NEW)
    assert path.is_symlink()
    assert names(tmp_path) == ["a.h5"]


@pytest.mark.parametrize("number", [errno.EPERM, errno.EOPNOTSUPP, errno.EMLINK])
def test_without_hard_links(tmp_path, monkeypatch, number):
    """exFAT and some network file systems have none."""
    monkeypatch.setattr(os, "link", failing(number))
    path = tmp_path / "a.h5"
    write_atomically(path, OLD)
    assert path.read_bytes() == OLD
    with pytest.raises(ResultExistsError, match=r"a\.h5 exists already"):
        write_atomically(path, NEW)
    assert path.read_bytes() == OLD
    write_atomically(path, NEW, replace=True)
    assert path.read_bytes() == NEW
    assert names(tmp_path) == ["a.h5"]


@pytest.mark.skipif(sys.platform == "win32", reason="it keeps files that are open")
def test_whoever_has_the_old_file_open_keeps_it(tmp_path):
    path = tmp_path / "a.h5"
    write_atomically(path, OLD)
    with path.open("rb") as file:
        write_atomically(path, NEW, replace=True)
        assert file.read() == OLD
    assert path.read_bytes() == NEW


def test_permissions_follow_the_mask(tmp_path, umask):
    for mask in (0o022, 0o027, 0o077, 0o002):
        umask(mask)
        path = tmp_path / f"{mask:o}.h5"
        write_result(path, result())
        assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~mask


@pytest.mark.parametrize("number", [errno.EIO, errno.ENOSPC])
def test_a_folder_that_fails_to_sync_is_reported(tmp_path, monkeypatch, number):
    """The file is complete, but a power cut may take its name."""
    fsync = os.fsync

    def only_files(descriptor):
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(number, os.strerror(number))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", only_files)
    with pytest.raises(OSError, match=os.strerror(number)):
        write_atomically(tmp_path / "a.h5", NEW)
    assert (tmp_path / "a.h5").read_bytes() == NEW
    assert names(tmp_path) == ["a.h5"]


def test_a_partial_file_that_cannot_be_removed_loses_no_result(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", failing(errno.EIO))
        write_atomically(path, OLD)
    assert path.read_bytes() == OLD
    write_atomically(path, NEW, replace=True)
    assert names(tmp_path) == ["a.h5"]


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


def test_an_interruption_of_the_lock_leaves_nothing(tmp_path, monkeypatch):
    def interrupt(file):
        raise KeyboardInterrupt

    before = open_descriptors()
    monkeypatch.setattr(atomic, "try_lock", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "a.h5", NEW)
    assert (names(tmp_path), open_descriptors()) == ([], before)


def test_without_hard_links_a_file_that_cannot_be_tested_is_not_replaced(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    path.write_bytes(OLD)
    with monkeypatch.context() as patch:

        def no_link_and_then_no_answer(old, new):
            patch.setattr(os, "stat", failing(errno.EIO))
            raise OSError(errno.EPERM, os.strerror(errno.EPERM))

        patch.setattr(os, "link", no_link_and_then_no_answer)
        with pytest.raises(OSError, match=os.strerror(errno.EIO)):
            write_atomically(path, NEW)
    assert path.read_bytes() == OLD


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
