"""Undisturbed commands, which tests of kills and full disks compare with, and started processes."""

import functools

import pytest
from faults.disturbed_commands import Undisturbed
from faults.hostile.reader import Reader
from support.forked_commands import CommandServer


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory):
    """A function that returns the undisturbed run of a case; each case runs once."""
    with CommandServer(tmp_path_factory.mktemp("server")) as server:

        @functools.cache
        def run(name):
            return Undisturbed(name, server, tmp_path_factory.mktemp("undisturbed"))

        yield run


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """A server that starts commands."""
    with CommandServer(tmp_path_factory.mktemp("server")) as started:
        yield started


@pytest.fixture(scope="module")
def reader():
    """A process that reads hostile files."""
    started = Reader()
    try:
        yield started
    finally:
        started.close()
