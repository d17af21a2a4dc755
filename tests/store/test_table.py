"""Protects tables of runs and the folder lock: a table is read as it was written, or refused."""

import numpy as np
import pytest

from rbstab.store.dataset_file import write_dataset
from rbstab.store.disk.lock import FolderInUseError, is_locked, locked
from rbstab.store.errors import NotAResultError
from rbstab.store.table import Column, Table, columns_from, read_table
from rbstab.store.variables import Variable

SHARD = "a test"

LAYOUT = {
    "run_id": Column((), "S32", "1", "identity"),
    "status": Column((), "i1", "1", "how it ended", ("completed", "range left")),
    "final_position": Column(("axis",), "f8", "m", "X at the end"),
    "steps": Column((), "i4", "1", "steps"),
}
EXTRAS = {
    "grid_axis": Variable(("grid_axis_number",), np.array(["a", "b"], object), "", "names"),
    "grid_length": Variable(("grid_axis_number",), np.array([3, 4]), "1", "lengths"),
    "plan": Variable((), np.array("title: ö\n", object), "", "plan, YAML"),
}


def arrays_of(start, stop):
    n = np.arange(start, stop)
    return {
        "run": n,
        "run_id": np.array([f"{i:032x}".encode() for i in n], dtype="S32"),
        "status": (n % 2).astype("i1"),
        "final_position": np.array([[i, -i / 3, np.nan] for i in n]).reshape(-1, 3),
        "steps": n.astype("i4"),
    }


def write(path, arrays, attributes=None, extras=None):
    variables = columns_from(LAYOUT, arrays) | (extras or {})
    write_dataset(path, Table(variables, attributes or {}, kind=SHARD))


def same(actual, expected):
    for name, data in expected.items():
        assert actual[name].dtype == data.dtype
        assert actual[name].tobytes() == data.tobytes()


@pytest.fixture
def segment(tmp_path):
    """A file with seven consecutive members of a sweep."""
    path = tmp_path / "a.h5"
    write(path, arrays_of(5, 12), {"plan_id": "x", "size": 7})
    return path


@pytest.fixture
def sweep(tmp_path):
    """A file with all members of a sweep, and what is not along them."""
    path = tmp_path / "s.h5"
    write(path, arrays_of(0, 12), {"plan_id": "x"}, EXTRAS)
    return path


def test_a_part_comes_back(segment):
    table = read_table(segment, SHARD)
    same(table, arrays_of(5, 12))
    assert table["run"].tolist() == list(range(5, 12))
    assert all(column.describes(table.variables[name]) for name, column in LAYOUT.items())
    assert table.attributes.items() >= {"plan_id": "x", "size": 7}.items()
    assert table.words("status").tolist()[:2] == ["range left", "completed"]


def test_a_sweep_comes_back(sweep):
    table = read_table(sweep, SHARD)
    same(table, arrays_of(0, 12))
    assert table["plan"].item() == "title: ö\n"
    assert table["grid_axis"].tolist() == ["a", "b"]
    assert table.shaped("final_position").shape == (3, 4, 3)
    assert table.shaped("steps")[2, 1] == 9
    assert set(read_table(sweep, SHARD, ["steps"])) == {"run", "steps", *EXTRAS}


def test_no_status_without_a_meaning_is_read(tmp_path):
    arrays = arrays_of(0, 4) | {"status": np.array([0, 1, 2, 0], "i1")}
    write(tmp_path / "t.h5", arrays)
    with pytest.raises(NotAResultError, match="status has a flag without a meaning"):
        read_table(tmp_path / "t.h5", SHARD)
    assert read_table(tmp_path / "t.h5", SHARD, ["steps"])["steps"].tolist() == [0, 1, 2, 3]


def test_a_column_is_known_by_its_declaration_also_if_words_were_added_since():
    status = LAYOUT["status"]
    assert status.describes(status._replace(flags=status.flags[:1]).of([0, 0]))
    for change in ({"flags": ()}, {"flags": ("late",)}, {"unit": "s"}, {"dtype": "i4"}):
        assert not status.describes(status._replace(**change).of([0, 0]))
    assert not status.describes(LAYOUT["final_position"].of(np.zeros((2, 3))))


def test_the_lock(tmp_path):
    """An open file has its lock, also where one process opens it twice."""
    assert not is_locked(tmp_path)
    with locked(tmp_path):
        assert is_locked(tmp_path)
        with pytest.raises(FolderInUseError, match="in use"), locked(tmp_path):
            pass
    assert not is_locked(tmp_path)
    with locked(tmp_path, shared=True), locked(tmp_path, shared=True):
        assert is_locked(tmp_path)
