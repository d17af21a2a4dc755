"""Protects files from arrays that do not fit their dimensions; HDF5 and numpy stretch some."""

import numpy as np
import pytest

from rbstab.store.errors import StoreError
from rbstab.store.result import Result
from rbstab.store.run_file import write_result
from rbstab.store.shard_file import write_shard
from rbstab.store.table import Column, TableHeader
from rbstab.store.table_writer import write_table
from rbstab.store.variables import Variable

ATTRIBUTES = {"title": "a", "status": "completed", "run_id": "0" * 32, "engine": "scipy"}


def run(states):
    """A run of five samples with own states along `axis`, which has three entries."""
    variables = {
        "time": Variable(("time",), np.arange(5.0), "s", "time"),
        "axis": Variable(("axis",), np.arange(1, 4), "1", "component"),
        "connector_state": Variable(("time", "axis"), states, "m", "own state"),
    }
    return Result(variables, dict(ATTRIBUTES), "title: a\n")


@pytest.mark.parametrize("shape", [(5, 2), (5, 1), (4, 3), (5,), (1, 3)])
def test_a_run_with_an_array_of_another_shape_is_refused(tmp_path, shape):
    with pytest.raises(StoreError, match=r"connector_state has the shape .*\(expected \(5, 3\)\)"):
        write_result(tmp_path / "a.h5", run(np.zeros(shape)))
    assert not list(tmp_path.iterdir())


def test_a_run_whose_arrays_fit_is_written(tmp_path):
    write_result(tmp_path / "a.h5", run(np.zeros((5, 3))))
    assert (tmp_path / "a.h5").exists()


LAYOUT = {"end": Column(("axis",), "f8", "m", "E at the end")}


@pytest.mark.parametrize("shape", [(4, 2), (4, 1), (4,), (1, 3), (3,)])
def test_a_shard_with_a_column_of_another_shape_is_refused(tmp_path, shape):
    with pytest.raises(ValueError, match="end has the shape"):
        write_shard(tmp_path / "0.npy", TableHeader(LAYOUT, 0, 4, {}), {"end": np.zeros(shape)})
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("shape", [(4, 2), (4, 1), (4,)])
def test_a_table_with_a_column_of_another_shape_is_refused(tmp_path, shape):
    with pytest.raises(StoreError, match="end has the shape"):
        write_table(tmp_path / "a.h5", TableHeader(LAYOUT, 0, 4, {}), [{"end": np.zeros(shape)}])
    assert not list(tmp_path.iterdir())


def test_a_column_of_another_length_has_it_in_its_digest():
    """Columns of three entries are described as ever, or older digests would be void."""
    column = LAYOUT["end"]
    assert column.digest_text == (
        "Column(dimensions=('axis',), dtype='f8', unit='m', long_name='E at the end', flags=())"
    )
    longer = column._replace(dimensions=("two",), lengths=(2,))
    assert (longer.shape, longer.size) == ((2,), 16)
    assert "lengths=(2,)" in longer.digest_text
