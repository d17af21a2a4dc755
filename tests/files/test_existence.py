"""Protects files on disks that report errors: they do not count as absent, in any version of
Python, so that nothing is written in their place.
"""

import errno
import os

import pytest

from rbstab.experiment.robust.cache import all_bodies
from rbstab.files.existence import exists
from rbstab.report.reading.untrusted import file_of
from rbstab.store.disk.existence import check_folder, path_exists
from rbstab.store.errors import StoreError

TOO_LONG = "a" * 300

POSIX = pytest.mark.skipif(os.name != "posix", reason="other systems say something else")


def failing(number):
    def fail(*arguments, **options):
        raise OSError(number, os.strerror(number))

    return fail


def test_what_exists(tmp_path):
    file = tmp_path / "a"
    file.write_text("")
    assert exists(tmp_path)
    assert exists(file)


@pytest.mark.parametrize("name", ["missing", "missing/b", "file/b", "null\0"])
def test_what_does_not_exist(tmp_path, name):
    (tmp_path / "file").write_text("")
    assert not exists(tmp_path / name)


@POSIX
@pytest.mark.parametrize("target", ["nowhere", "link"])
def test_a_link_that_leads_nowhere_does_not_exist(tmp_path, target):
    link = tmp_path / "link"
    link.symlink_to(tmp_path / target)
    assert not exists(link)


@pytest.mark.parametrize("number", [errno.EACCES, errno.EIO, errno.ESTALE])
def test_an_error_of_the_disk_is_raised(tmp_path, monkeypatch, number):
    with monkeypatch.context() as patch:
        patch.setattr(os, "stat", failing(number))
        with pytest.raises(OSError, match=os.strerror(number)):
            exists(tmp_path)
        with pytest.raises(StoreError, match=f"cannot be read: {os.strerror(number)}"):
            path_exists(tmp_path)


@POSIX
def test_a_name_that_is_too_long(tmp_path):
    with pytest.raises(OSError, match="File name too long"):
        exists(tmp_path / TOO_LONG)
    with pytest.raises(StoreError, match="cannot be written: File name too long"):
        check_folder(tmp_path / TOO_LONG)


def test_a_sweep_that_cannot_be_tested_is_not_called_another_folder(tmp_path, monkeypatch):
    stat = os.stat

    def no_answer_inside(path, *arguments, **options):
        if os.fspath(path) != os.fspath(tmp_path):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        return stat(path, *arguments, **options)

    with monkeypatch.context() as patch:
        patch.setattr(os, "stat", no_answer_inside)
        with pytest.raises(StoreError, match="cannot be read: Permission denied"):
            file_of(tmp_path)


def test_proofs_that_cannot_be_listed_are_not_absent(tmp_path, monkeypatch):
    assert all_bodies(tmp_path) == []
    (tmp_path / "proofs").mkdir()
    with monkeypatch.context() as patch:
        for name in ("listdir", "scandir"):
            patch.setattr(os, name, failing(errno.EIO))
        with pytest.raises(StoreError, match="cannot be read"):
            all_bodies(tmp_path)
