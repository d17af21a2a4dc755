"""Protects files on disks that report errors: they do not count as absent, in any version of
Python, so that nothing is written in their place.
"""

import errno
import os
import re
from pathlib import Path

import pytest

from rbstab.config.errors import ConfigError
from rbstab.experiment.robust.bodies import all_bodies
from rbstab.files.paths import exists, is_dir, is_file
from rbstab.report.reading.kinds import kind_of
from rbstab.store.disk.paths import check_folder, path_exists, path_is_dir, path_is_file
from rbstab.store.errors import StoreError
from rbstab.sweep.plan.load import load_plan
from rbstab_cli.results import results_among

ROOT = Path(__file__).parents[2]

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
    assert (is_dir(tmp_path), is_dir(file)) == (True, False)
    assert (is_file(tmp_path), is_file(file)) == (False, True)


@pytest.mark.parametrize("name", ["missing", "missing/b", "file/b", "null\0"])
def test_what_does_not_exist(tmp_path, name):
    (tmp_path / "file").write_text("")
    for test in (exists, is_file, is_dir, path_exists, path_is_file, path_is_dir):
        assert not test(tmp_path / name)


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
        for test in (exists, is_file, is_dir):
            with pytest.raises(OSError, match=os.strerror(number)):
                test(tmp_path)
        for question in (path_exists, path_is_file, path_is_dir, kind_of):
            with pytest.raises(StoreError, match=f"cannot be read: {os.strerror(number)}"):
                question(tmp_path)


@POSIX
def test_a_name_that_is_too_long(tmp_path):
    with pytest.raises(OSError, match="File name too long"):
        exists(tmp_path / TOO_LONG)
    with pytest.raises(StoreError, match="cannot be written: File name too long"):
        check_folder(tmp_path / TOO_LONG)


def test_proofs_that_cannot_be_listed_are_not_absent(tmp_path, monkeypatch):
    assert all_bodies(tmp_path) == []
    (tmp_path / "proofs").mkdir()
    with monkeypatch.context() as patch:
        for name in ("listdir", "scandir"):
            patch.setattr(os, name, failing(errno.EIO))
        with pytest.raises(StoreError, match="cannot be read"):
            all_bodies(tmp_path)


PROGRAM_FILES = {"src/rbstab/packaged/examples.py", "src/rbstab/experiment/provenance.py"}
"""These test files of the program itself."""


def test_no_path_of_a_user_is_tested_without_the_errors_of_its_disk():
    tests = re.compile(r"\.(is_file|is_dir|exists)\(\)|os\.path\.(exists|isfile|isdir)\(")
    files = {
        file.relative_to(ROOT).as_posix()
        for folder in ("src", "cli")
        for file in (ROOT / folder).rglob("*.py")
        if tests.search(file.read_text(encoding="utf-8"))
    }
    assert files == PROGRAM_FILES


def test_what_a_disk_cannot_tell_is_neither_missing_nor_left_out(tmp_path, monkeypatch):
    """What reads a base says what is wrong with it; here it can be read."""
    stat = os.stat
    (tmp_path / "base.yaml").write_text("title: t\n")
    plan = tmp_path / "plan.yaml"
    plan.write_text("base: base.yaml\nvary: {body.mass: {values: [40, 41]}}\n")
    results = (tmp_path / "a.h5", tmp_path / "b.html")
    for path in results:
        path.write_text("")
    assert results_among(results) == results[:1]

    def failing_there(path, *arguments, **options):
        if os.fspath(path).endswith(("base.yaml", "b.html")):
            raise OSError(errno.EIO, os.strerror(errno.EIO), os.fspath(path))
        return stat(path, *arguments, **options)

    with monkeypatch.context() as patch:
        patch.setattr(os, "stat", failing_there)
        assert results_among(results) == results
        with pytest.raises(ConfigError) as caught:
            load_plan(plan)
    assert "which is not a file" not in str(caught.value)
