"""Protects the reader of a result from links: to other files, or to itself by another name."""

import h5py
import numpy as np
import pytest
from support.results import result

from rbstab.store.errors import NotAResultError
from rbstab.store.run_file import open_result, write_result

SECRET = b"secret" * 10


@pytest.fixture
def file(tmp_path):
    """A valid result, open for changes, beside another result and a text file."""
    write_result(tmp_path / "other.h5", result(1))
    (tmp_path / "secret.txt").write_bytes(SECRET)
    write_result(tmp_path / "a.h5", result())
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        yield file


def refused(file, name):
    path = file.filename
    file.close()
    with pytest.raises(NotAResultError) as caught:
        open_result(path)
    assert str(caught.value) == f"{path}: {name} is not an array of this file"


def external_link(file, name):
    file[name] = h5py.ExternalLink("other.h5", "/config" if name == "config" else "/time")


def soft_link(file, name):
    file[name] = h5py.SoftLink("/part" if name == "config" else "/time")


def dangling_link(file, name):
    file[name] = h5py.SoftLink("/nothing")


def virtual(file, name):
    text = h5py.string_dtype()
    shape, dtype, origin = ((), text, "config") if name == "config" else ((5,), "f8", "time")
    layout = h5py.VirtualLayout(shape=shape, dtype=dtype)
    layout[...] = h5py.VirtualSource("other.h5", origin, shape=shape, dtype=dtype)
    file.create_virtual_dataset(name, layout)


def external_storage(file, name):
    folder = file.filename.removesuffix("a.h5")
    shape, dtype = ((1,), "S40") if name == "config" else ((5,), "f8")
    made = file.create_dataset(
        name, shape=shape, dtype=dtype, external=[(f"{folder}secret.txt", 0, 40)]
    )
    assert made.external


def group(file, name):
    file.create_group(name)


def named_type(file, name):
    file[name] = np.dtype("f8")


MAKERS = [external_link, soft_link, dangling_link, virtual, external_storage, group, named_type]


@pytest.mark.parametrize("make", MAKERS)
def test_as_one_more_array(file, make):
    make(file, "x")
    refused(file, "x")


@pytest.mark.parametrize("make", MAKERS)
def test_in_place_of_an_array(file, make):
    """A link in place of an array is refused like an additional one."""
    del file["lyapunov"]
    make(file, "lyapunov")
    refused(file, "lyapunov")


@pytest.mark.parametrize("make", [external_link, soft_link, virtual, external_storage])
def test_in_place_of_the_config(file, make):
    del file["config"]
    make(file, "config")
    refused(file, "config")


def test_an_array_that_was_added_later_is_not_what_was_written(file):
    """This holds even for a hard link to an array of the same file."""
    file["again"] = file["lyapunov"]
    path = file.filename
    file.close()
    with pytest.raises(NotAResultError, match="does not match its digest"):
        open_result(path)
