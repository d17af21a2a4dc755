"""Protects results on a disk that fails: a failed read is named, and never taken for damage."""

import errno
import gc
import io
import os
import weakref

import pytest
from support.results import assert_equal, result

from rbstab.store.disk import lock
from rbstab.store.disk.checked_reads import CheckedReads
from rbstab.store.errors import StoreError
from rbstab.store.reading import known_places, opening
from rbstab.store.run_file import open_result, write_result

REASON = os.strerror(errno.EIO)


class FailingFile(io.BufferedReader):
    """A file whose n-th read fails; the others succeed."""

    def __init__(self, path, nth):
        super().__init__(io.FileIO(path))
        self.reads = 0
        self.nth = nth

    def readinto(self, buffer):
        self.count()
        return super().readinto(buffer)

    def read(self, size=-1):
        self.count()
        return super().read(size)

    def count(self):
        self.reads += 1
        if self.reads == self.nth:
            raise OSError(errno.EIO, REASON)


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "a.h5"
    write_result(path, result())
    return path


@pytest.mark.parametrize("known", [True, False])
def test_each_failed_read_is_named_as_such(path, monkeypatch, known):
    """HDF5 drops the errors of some reads, and reports others as damage."""
    monkeypatch.setattr(known_places, "_known", {} if known else None)
    open_result(path)
    assert bool(known_places._known) is known

    def opened(path, nth):
        files = [FailingFile(path, nth)]
        monkeypatch.setattr(opening, "open_regular", lambda _: files[0])
        return files[0]

    file = opened(path, 0)
    assert_equal(open_result(path), result())
    assert file.reads > 10
    for nth in range(1, file.reads + 1):
        opened(path, nth)
        with pytest.raises(StoreError) as caught:
            open_result(path)
        assert (nth, str(caught.value)) == (nth, f"{path} cannot be read: {REASON}")


def test_a_file_is_freed_after_a_failed_read(path, monkeypatch):
    """Otherwise HDF5 would free it after the end of the interpreter, and crash."""
    files = []

    def checked(file):
        found = CheckedReads(file)
        files.append(weakref.ref(found))
        return found

    monkeypatch.setattr(opening, "CheckedReads", checked)
    monkeypatch.setattr(opening, "open_regular", lambda path: FailingFile(path, 1))
    with pytest.raises(StoreError):
        open_result(path)
    gc.collect()
    assert [file() for file in files] == [None]


def test_a_folder_that_cannot_be_locked(tmp_path, monkeypatch):
    def fail(*_arguments, **_options):
        raise OSError(errno.EIO, REASON)

    monkeypatch.setattr(lock, "try_lock", fail)
    with (
        pytest.raises(StoreError, match=f"{tmp_path} cannot be locked: {REASON}"),
        lock.locked(tmp_path),
    ):
        pass
