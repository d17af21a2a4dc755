"""A finished sweep in a folder that cannot be written: nothing needs to be written, so no command
fails; a sweep that is not finished fails before it computes.
"""

import errno
import os
from pathlib import Path

import pytest
from support.configs import VISCO_ELASTIC, plain
from support.sweeps import SHORT, FakeEngine, plan_of

from rbstab.store.disk.lock import LOCK_FILE, FolderInUseError, locked
from rbstab.store.errors import StoreError
from rbstab.sweep.folder.open_folder import Part
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import sweep_to_folder

BASE = plain(VISCO_ELASTIC) | {"integration": {**SHORT, "engine": "heyoka"}}

PLAN = plan_of(40, base=BASE)
OPTIONS = SweepOptions(factory=FakeEngine, threads=1, shard_size=10)


@pytest.fixture(params=[errno.EROFS, errno.EACCES], ids=["file system", "permission"])
def read_only(request, monkeypatch):
    """A function that makes all files read-only for this process, also for the superuser."""

    def refuse(*_arguments, **_options):
        raise OSError(request.param, os.strerror(request.param))

    def protect():
        open_path, access = Path.open, os.access

        def open_for_reading(self, mode="r", *arguments, **options):
            return open_path(self, mode, *arguments, **options) if mode in ("r", "rb") else refuse()

        monkeypatch.setattr(Path, "open", open_for_reading)
        for name in ("unlink", "rename", "link", "replace", "truncate"):
            monkeypatch.setattr(os, name, refuse)
        monkeypatch.setattr(os, "access", lambda p, mode: mode & os.W_OK == 0 and access(p, mode))

    return protect


def content(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("lock_file", [True, False], ids=["", "copied without its lock file"])
def test_a_finished_sweep(tmp_path, read_only, lock_file):
    sweep_to_folder(PLAN, tmp_path, OPTIONS)
    if not lock_file:
        (tmp_path / LOCK_FILE).unlink()
    before = content(tmp_path)
    read_only()
    again = sweep_to_folder(PLAN, tmp_path, OPTIONS)
    assert again.finished
    assert again.inventory.members == PLAN.members
    assert again.comparison is not None
    assert content(tmp_path) == before


@pytest.mark.parametrize("part", [None, Part(1, 2)])
def test_missing_shards(tmp_path, read_only, part, monkeypatch):
    sweep_to_folder(PLAN, tmp_path, OPTIONS)
    (tmp_path / "shards" / "00000000.h5").unlink()
    (tmp_path / "members.h5").unlink()
    monkeypatch.setattr(FakeEngine, "compute", lambda *_: pytest.fail("a member was computed"))
    read_only()
    options = SweepOptions(factory=FakeEngine, threads=1, shard_size=10, part=part)
    with pytest.raises(StoreError, match="cannot be written"):
        sweep_to_folder(PLAN, tmp_path, options)


def test_a_sweep_that_is_not_finished(tmp_path, read_only, monkeypatch):
    sweep_to_folder(PLAN, tmp_path, OPTIONS)
    (tmp_path / "members.h5").unlink()
    monkeypatch.setattr(
        "rbstab.sweep.sweep.compare_with_scipy", lambda *_: pytest.fail("members were compared")
    )
    read_only()
    with pytest.raises(StoreError, match=r"members\.h5 cannot be written"):
        sweep_to_folder(PLAN, tmp_path, OPTIONS)


def test_the_lock_of_another_process_is_still_seen(tmp_path, read_only):
    sweep_to_folder(PLAN, tmp_path, OPTIONS)
    with locked(tmp_path):
        read_only()
        with pytest.raises(FolderInUseError):
            sweep_to_folder(PLAN, tmp_path, OPTIONS)
