"""A config is a regular file: pipes, devices and sockets are refused without waiting for them."""

import os
import socket
import sys
from pathlib import Path

import pytest
from support.configs import VISCO_ELASTIC
from support.hang_guard import time_limit

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.files import regular_file

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no such files there")


def refused(path):
    with time_limit(30), pytest.raises(ConfigError) as caught:
        load_config(path)
    return str(caught.value)


def test_a_pipe_without_a_writer(tmp_path):
    path = tmp_path / "pipe.yaml"
    os.mkfifo(path)
    expected = f"{path}:1:1: cannot be read: it is a pipe, not a file (expected a YAML file)"
    assert refused(path) == expected


def test_a_link_to_a_pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link.yaml").symlink_to("pipe")
    assert "it is a pipe, not a file" in refused(tmp_path / "link.yaml")


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/null"])
def test_a_device(device):
    assert refused(device) == (
        f"{device}:1:1: cannot be read: it is a device or a socket, not a file "
        "(expected a YAML file)"
    )


def test_a_socket(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("s.yaml")
        assert "it is a device or a socket, not a file" in refused("s.yaml")


def test_a_link_to_a_file(tmp_path):
    (tmp_path / "case.yaml").write_text(VISCO_ELASTIC)
    (tmp_path / "link.yaml").symlink_to("case.yaml")
    assert load_config(tmp_path / "link.yaml").body.mass == 41.0


@pytest.mark.parametrize("swap", ["pipe", "folder"])
def test_a_file_that_is_replaced_before_it_is_opened(tmp_path, monkeypatch, swap):
    """Another process may put a pipe in the place of a file that was just tested."""
    path = tmp_path / "case.yaml"
    path.write_text(VISCO_ELASTIC)
    opened = []

    def replace_and_open(target, flags):
        Path(target).unlink()
        if swap == "pipe":
            os.mkfifo(target)
        else:
            Path(target).mkdir()
        opened.append(os.open(target, flags))
        return opened[-1]

    monkeypatch.setattr(regular_file, "os", _OsWith(open=replace_and_open))
    with time_limit(30), pytest.raises(OSError, match=r"it is a pipe|Is a directory"):
        regular_file.open_regular(path)
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(opened[0])


class _OsWith:
    """The module os with some functions replaced, for one other module."""

    def __init__(self, **functions):
        self.__dict__.update(functions)

    def __getattr__(self, name):
        return getattr(os, name)
