"""Protects against files of another kind, and wrong columns: the message says which it is."""

import h5py
import numpy as np
import pytest
from support.results import result

from rbstab.store.disk.seal import SEAL_SIZE, add_seal
from rbstab.store.errors import NotAResultError
from rbstab.store.motions import Motions
from rbstab.store.motions_file import read_motions, write_motions
from rbstab.store.run_file import write_result
from rbstab.store.table import Column, TableHeader
from rbstab.store.table_file import read_table
from rbstab.store.table_writer import write_table
from rbstab.store.variables import Variable

LAYOUT = {"steps": Column((), "i4", "1", "steps"), "more": Column((), "i4", "1", "more")}


def write_small_table(path):
    arrays = {name: np.arange(3, dtype="i4") for name in LAYOUT}
    write_table(path, TableHeader(LAYOUT, 0, 3, {}), [arrays])


def write_small_motions(path):
    variables = {
        "run": Variable(("run",), np.array([0, 1, 2]), "1", "number"),
        "energy": Variable(("run",), np.arange(3.0), "J", "energy"),
    }
    write_motions(path, Motions(variables, {}))


def write_run(path):
    write_result(path, result())


@pytest.mark.parametrize(
    ("write", "read", "reason"),
    [
        (write_run, read_table, "is a result, but not of a sweep"),
        (write_small_motions, read_table, "is a result, but not of a sweep"),
        (write_run, read_motions, "is a result, but has no traces"),
        (write_small_table, read_motions, "is a result, but has no traces"),
    ],
)
def test_a_whole_file_of_another_kind(tmp_path, write, read, reason):
    path = tmp_path / "a.h5"
    write(path)
    with pytest.raises(NotAResultError) as caught:
        read(path)
    assert str(caught.value) == f"{path} {reason}"


@pytest.fixture
def change(tmp_path):
    """A function that changes a table through h5py, and seals it again."""
    path = tmp_path / "a.h5"

    def change(edit):
        write_small_table(path)
        path.write_bytes(path.read_bytes()[:-SEAL_SIZE])
        with h5py.File(path, "r+") as file:
            edit(file)
        path.write_bytes(add_seal(path.read_bytes()))
        return path

    return change


@pytest.mark.parametrize("length", [2, 4])
def test_a_column_that_is_longer_or_shorter_than_the_others(change, length):
    def edit(file):
        del file["more"]
        column = file.create_dataset("more", data=np.arange(length, dtype="<i4"))
        column.dims[0].attach_scale(file["run"])

    path = change(edit)
    for names in (None, ["steps"]):
        with pytest.raises(NotAResultError) as caught:
            read_table(path, names)
        assert str(caught.value) == f"{path} is damaged: more has a wrong length"


@pytest.mark.parametrize("numbers", [[0, 1, 3], [2, 1, 0], [1, 1, 1]])
def test_members_that_are_not_in_order(change, numbers):
    def edit(file):
        file["run"][...] = numbers

    path = change(edit)
    with pytest.raises(NotAResultError) as caught:
        read_table(path)
    assert str(caught.value) == f"{path} is damaged: its runs are not numbered in order"


def test_a_table_without_the_digest_of_its_columns(change):
    """The digest of the whole is younger; tables of older versions have none."""

    def without(*names):
        def edit(file):
            for name in names:
                del file.attrs[name]

        return edit

    assert read_table(change(without("digest")))["steps"].tolist() == [0, 1, 2]
    for names in (["arrays_digest"], ["arrays_digest", "digest"]):
        with pytest.raises(NotAResultError, match="does not match its digest"):
            read_table(change(without(*names)))
