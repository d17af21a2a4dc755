"""Protects against pipes, devices and folders in place of results: they are refused at once."""

import os
import socket
from pathlib import Path

import pytest
from support.hang_guard import within

from rbstab.store.dataset_file import checksum_of
from rbstab.store.disk.paths import read_regular
from rbstab.store.errors import StoreError
from rbstab.store.result import open_result

READERS = [open_result, checksum_of, read_regular]


POSIX_KINDS = ["pipe", "socket", "device", "endless device", "terminal"]

KINDS = ["folder", *(POSIX_KINDS if os.name == "posix" else [])]


@pytest.fixture(params=KINDS)
def path(request, tmp_path, monkeypatch):
    """Something that is not a regular file."""
    path = tmp_path / "a.h5"
    if request.param == "pipe":
        os.mkfifo(path)
    elif request.param == "socket":
        with socket.socket(socket.AF_UNIX) as server:
            # The path of a socket is short: macOS allows 104 bytes.
            monkeypatch.chdir(tmp_path)
            server.bind(path.name)
    elif request.param == "folder":
        path.mkdir()
    else:
        devices = {"device": "/dev/null", "endless device": "/dev/zero", "terminal": "/dev/ptmx"}
        return Path(devices[request.param])
    return path


@pytest.mark.parametrize("read", READERS)
def test_it_is_refused_at_once(path, read):
    with pytest.raises(StoreError, match="cannot be read"):
        within(20, read, path)


def test_a_file_above_the_limit_is_refused(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"12345")
    assert read_regular(path, 5) == b"12345"
    with pytest.raises(StoreError, match="more than rbstab"):
        read_regular(path, 4)
