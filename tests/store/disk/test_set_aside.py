"""Protects `move_aside`: a result gets another name only if that name is free."""

import errno
import os

import pytest

from rbstab.store.disk.atomic import move_aside
from rbstab.store.errors import ResultExistsError


@pytest.fixture(params=[True, False], ids=["hard links", "no hard links"])
def _links(request, monkeypatch):
    def refuse(old, new):
        raise OSError(errno.EPERM, "not permitted")

    if not request.param:
        monkeypatch.setattr(os, "link", refuse)


@pytest.mark.usefixtures("_links")
def test_moved(tmp_path):
    (tmp_path / "a").write_bytes(b"1")
    move_aside(tmp_path / "a", tmp_path / "b")
    assert [entry.name for entry in tmp_path.iterdir()] == ["b"]
    assert (tmp_path / "b").read_bytes() == b"1"


@pytest.mark.usefixtures("_links")
def test_the_new_name_is_taken(tmp_path):
    (tmp_path / "a").write_bytes(b"1")
    (tmp_path / "b").write_bytes(b"2")
    with pytest.raises(ResultExistsError, match="b exists already"):
        move_aside(tmp_path / "a", tmp_path / "b")
    assert (tmp_path / "a").read_bytes() == b"1"
    assert (tmp_path / "b").read_bytes() == b"2"


@pytest.mark.usefixtures("_links")
def test_there_is_nothing(tmp_path):
    with pytest.raises(FileNotFoundError):
        move_aside(tmp_path / "a", tmp_path / "b")
    assert list(tmp_path.iterdir()) == []
