"""Protects tables of unusual sizes: one member, no vectors, or vectors of any length."""

import numpy as np
import pytest

from rbstab.store.table import Column, TableHeader
from rbstab.store.table_file import read_table
from rbstab.store.table_writer import write_table

COLUMNS = {
    "status": Column((), "i1", "1", "how it ended"),
    "steps": Column((), "i4", "1", "steps"),
    "end": Column(("axis",), "f8", "m", "X at the end"),
    "states": Column(("two",), "f8", "m", "own states", lengths=(2,)),
    "matrix": Column(("axis", "two"), "f4", "1", "a matrix", lengths=(3, 2)),
}


def comes_back(path, names, length):
    layout = {name: COLUMNS[name] for name in names}
    rng = np.random.default_rng(1)
    arrays = {
        name: rng.integers(0, 100, (length, *column.shape)).astype(column.dtype)
        for name, column in layout.items()
    }
    write_table(path, TableHeader(layout, 3, length, {}), [arrays])
    table = read_table(path)
    assert dict(table.layout) == layout
    assert table["run"].tolist() == list(range(3, 3 + length))
    assert not table.extras
    for name, data in arrays.items():
        assert table[name].dtype == data.dtype
        np.testing.assert_array_equal(table[name], data)


@pytest.mark.parametrize("length", [1, 2, 5])
@pytest.mark.parametrize("name", COLUMNS)
def test_one_column(tmp_path, name, length):
    comes_back(tmp_path / "a.h5", [name], length)


@pytest.mark.parametrize("length", [1, 2, 5])
def test_all_columns(tmp_path, length):
    comes_back(tmp_path / "a.h5", list(COLUMNS), length)


def test_more_bytes_than_are_read_at_once(tmp_path):
    comes_back(tmp_path / "a.h5", ["status", "end"], 1_200_001)
