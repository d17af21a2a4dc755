"""Protects writing on systems that do not rename or remove open files: Windows, or a fake of it."""

import os
import sys
import threading

import pytest
from support.open_files import keep_open_files

from rbstab.store.disk.atomic import (
    PARTIAL_SUFFIX,
    move_aside,
    remove_all_abandoned,
    write_atomically,
)
from rbstab.store.errors import ResultExistsError


@pytest.fixture(autouse=True)
def system(monkeypatch):
    if sys.platform != "win32":
        keep_open_files(monkeypatch)


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


@pytest.mark.parametrize("hard_links", [True, False], ids=["hard links", "no hard links"])
def test_a_file_is_written_and_replaced(tmp_path, monkeypatch, hard_links):
    if not hard_links:
        monkeypatch.setattr(os, "link", no_link)
    path = tmp_path / "a.h5"
    write_atomically(path, b"old")
    with pytest.raises(ResultExistsError):
        write_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    write_atomically(path, b"new", replace=True)
    assert path.read_bytes() == b"new"
    move_aside(path, tmp_path / "b.h5")
    assert names(tmp_path) == ["b.h5"]
    write_atomically(path, b"3")
    with pytest.raises(ResultExistsError, match=r"b\.h5 exists already"):
        move_aside(path, tmp_path / "b.h5")
    assert (path.read_bytes(), (tmp_path / "b.h5").read_bytes()) == (b"3", b"new")


def no_link(*paths, **options):
    raise OSError("no hard links")


def test_a_reader_keeps_its_file(tmp_path):
    """It is an error, and the old content stays."""
    path = tmp_path / "a.h5"
    write_atomically(path, b"old")
    with path.open("rb"), pytest.raises(PermissionError):
        write_atomically(path, b"new", replace=True)
    assert path.read_bytes() == b"old"
    assert names(tmp_path) == ["a.h5"]


def test_a_file_is_replaced_when_its_reader_has_ended(tmp_path):
    """Virus scanners and other commands read a file for an instant."""
    path = tmp_path / "a.h5"
    write_atomically(path, b"old")
    reader = path.open("rb")
    ends = threading.Timer(0.1, reader.close)
    ends.start()
    write_atomically(path, b"new", replace=True)
    ends.join()
    assert path.read_bytes() == b"new"
    assert names(tmp_path) == ["a.h5"]


def test_an_open_partial_file_stays(tmp_path):
    kept, left = (tmp_path / f".{name}{PARTIAL_SUFFIX}" for name in "ab")
    left.touch()
    with kept.open("wb"):
        remove_all_abandoned(tmp_path)
    assert names(tmp_path) == [kept.name]
    remove_all_abandoned(tmp_path)
    assert names(tmp_path) == []
