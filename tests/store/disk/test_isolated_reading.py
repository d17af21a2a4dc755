"""Protects against files on which a library hangs, crashes or fills the memory."""

import os
import sys
import time

import pytest
from support.isolated_calls import crash_on, crash_once, fill_memory_on, hang_on, is_in_worker

from rbstab.processes.workers import WorkerDiedError
from rbstab.store.disk import isolated_reading
from rbstab.store.disk.isolated_reading import IsolatedReader, read_limits
from rbstab.store.errors import NotAResultError, StoreError


def test_the_file_is_read_in_one_worker(tmp_path):
    read = IsolatedReader(is_in_worker)
    workers = {read(tmp_path / "a"), read(tmp_path / "b")}
    assert len(workers) == 1
    assert os.getpid() not in workers


def test_hang_is_an_error_of_the_store(tmp_path, monkeypatch):
    monkeypatch.setattr(isolated_reading, "MIN_DEADLINE", 0.2)
    start = time.monotonic()
    with pytest.raises(NotAResultError, match="a is damaged: HDF5 did not read it within"):
        IsolatedReader(hang_on)(tmp_path / "a")
    assert time.monotonic() - start < 60


def test_crash_is_an_error_of_the_store(tmp_path):
    with pytest.raises(NotAResultError, match="a is damaged: HDF5 crashed"):
        IsolatedReader(crash_on)(tmp_path / "a")


def test_one_crash_is_not_blamed_on_the_file(tmp_path):
    """The system may have killed the worker, for want of memory."""
    assert IsolatedReader(crash_once)(tmp_path / "a") == "read"


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux enforces a memory limit")
def test_want_of_memory_is_an_error_of_the_store(tmp_path):
    with pytest.raises(StoreError, match="needs more than 200 MB of memory"):
        IsolatedReader(fill_memory_on)(tmp_path / "a")


def test_limits_grow_with_the_file(tmp_path):
    (tmp_path / "a").write_bytes(bytes(4_000_000))
    assert read_limits(tmp_path / "a") == (5.2, 216_000_000)
    assert read_limits(tmp_path / "missing") == (5.0, 200_000_000)


def test_without_workers_the_file_is_read_here(tmp_path, monkeypatch):
    def no_worker(*_):
        raise WorkerDiedError("no process")

    monkeypatch.setattr("rbstab.processes.isolated.Worker", no_worker)
    assert IsolatedReader(is_in_worker)(tmp_path / "a") == os.getpid()
