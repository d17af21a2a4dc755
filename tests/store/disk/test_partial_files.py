"""Protects partial files: those of living writers stay, those that others left are removed."""

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from support.open_files import open_descriptors

from rbstab.store.disk import atomic
from rbstab.store.disk.atomic import (
    PARTIAL_SUFFIX,
    atomic_file,
    remove_all_abandoned,
    write_all,
    write_atomically,
)
from rbstab.store.disk.lock import try_lock
from rbstab.store.errors import ResultExistsError

NEW = b"new" * 100_000
OLD = b"old" * 50_000


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def test_what_a_killed_process_left_behind_is_not_reused(tmp_path, monkeypatch):
    """A process killed between naming its file and removing the temporary name leaves both names.

    A process that wrote to the temporary name again would change the result.
    """
    path = tmp_path / "a.h5"

    def do_nothing(path, **options):
        pass

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", do_nothing)
        write_atomically(path, OLD)
    assert len(names(tmp_path)) == 2
    assert path.stat().st_nlink == 2
    with pytest.raises(ResultExistsError):
        write_atomically(path, NEW)
    assert path.read_bytes() == OLD


def test_the_next_writer_removes_what_a_killed_one_left(tmp_path):
    """A killed writer may leave a part, or a second name of the result itself."""
    path = tmp_path / "a.h5"
    write_atomically(path, OLD)
    partial = tmp_path / f".a.h5{PARTIAL_SUFFIX}"
    os.link(path, partial)
    write_atomically(path, NEW, replace=True)
    assert path.read_bytes() == NEW
    assert names(tmp_path) == ["a.h5"]
    partial.write_bytes(b"half")
    write_atomically(path, OLD, replace=True)
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
