"""Protects the messages of files that the system cannot open: the path and the system's reason."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.results import result

from rbstab.store.disk.regular_file import open_regular, read_regular
from rbstab.store.document import read_document, write_document
from rbstab.store.errors import StoreError
from rbstab.store.motions import Motions
from rbstab.store.motions_file import read_motions, write_motions
from rbstab.store.run_file import open_result, write_result
from rbstab.store.table import Column
from rbstab.store.table_file import SHARD, read_table, write_table
from rbstab.store.variables import Variable

LAYOUT = {"steps": Column((), "i4", "1", "steps")}
STEPS = {"run": np.arange(2), "steps": np.array([1, 2], "i4")}
MOTIONS = Motions({"run": Variable(("run",), np.array([0]), "1", "number")}, {})

READERS: dict[str, Callable[[Path], object]] = {
    "bytes": read_regular,
    "file": open_regular,
    "document": read_document,
    "motions": read_motions,
    "run": open_result,
    "table": lambda path: read_table(path, SHARD),
}

WRITERS: dict[str, Callable[[Path], object]] = {
    "document": lambda path: write_document(path, {}),
    "motions": lambda path: write_motions(path, MOTIONS),
    "run": lambda path: write_result(path, result(), replace=True),
    "table": lambda path: write_table(path, SHARD, LAYOUT, STEPS, {}),
}


@pytest.mark.parametrize("name", READERS)
def test_a_file_that_is_not_there(tmp_path, name):
    path = tmp_path / "none"
    with pytest.raises(StoreError) as caught:
        READERS[name](path)
    assert str(caught.value) == f"{path} cannot be read: No such file or directory"


@pytest.mark.parametrize("name", WRITERS)
def test_a_folder_in_place_of_a_file(tmp_path, name):
    path = tmp_path / "folder"
    path.mkdir()
    with pytest.raises(StoreError) as caught:
        WRITERS[name](path)
    assert str(caught.value) == f"{path} cannot be written: Is a directory"
    assert list(tmp_path.iterdir()) == [path]
    assert not list(path.iterdir())
