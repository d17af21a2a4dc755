"""Protects the memory of compared tables: an old file is compared once, a young one every time."""

import os

import numpy as np
import pytest

from rbstab.store import table_file
from rbstab.store.disk.seal import check_seal
from rbstab.store.errors import NotAResultError
from rbstab.store.table import Column, TableHeader
from rbstab.store.table_file import read_table
from rbstab.store.table_writer import write_table

LAYOUT = {"steps": Column((), "i4", "1", "steps")}


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "a.h5"
    write_table(path, TableHeader(LAYOUT, 0, 3, {}), [{"steps": np.array([4, 5, 6], "i4")}])
    return path


@pytest.fixture
def compared(monkeypatch):
    """The files that were compared with their seals, in order."""
    paths = []

    def check(path):
        paths.append(path)
        check_seal(path)

    monkeypatch.setattr(table_file, "check_unchanged", check)
    return paths


def test_an_old_file_is_compared_once(table, compared):
    os.utime(table, (1, 1))
    for _ in range(3):
        assert read_table(table)["steps"].tolist() == [4, 5, 6]
    assert compared == [table]


def test_a_file_of_this_second_is_compared_every_time(table, compared):
    for _ in range(3):
        read_table(table)
    assert compared == [table] * 3


def test_a_change_that_the_time_stamp_does_not_show_is_noticed(table, monkeypatch):
    """Some file systems keep times to 2 s."""
    exact = table_file._identity
    monkeypatch.setattr(table_file, "_identity", lambda path: exact(path)[:3])
    read_table(table)
    content = table.read_bytes()
    numbers = np.array([4, 5, 6], "<i4").tobytes()
    assert content.count(numbers) == 1
    table.write_bytes(content.replace(numbers, np.array([4, 5, 7], "<i4").tobytes()))
    with pytest.raises(NotAResultError):
        read_table(table)
