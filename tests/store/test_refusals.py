"""Protects the errors of the store: one sentence for each file that cannot be read or written."""

import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from support.results import result

from rbstab.store.errors import NewerSchemaError, NotAResultError, ResultExistsError, StoreError
from rbstab.store.run_file import open_result, write_result


@pytest.fixture
def stored(tmp_path):
    path = tmp_path / "a.h5"
    write_result(path, result())
    return path


def refused(path, kind):
    with pytest.raises(StoreError) as caught:
        open_result(path)
    assert caught.type is kind
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_kinds_of_errors():
    """One base class catches them all; none is an OSError, which h5py uses for everything."""
    for kind in (NotAResultError, NewerSchemaError, ResultExistsError):
        assert issubclass(kind, StoreError)
    assert not issubclass(StoreError, OSError | ValueError)


def test_missing(tmp_path):
    path = tmp_path / "no.h5"
    assert refused(path, StoreError) == f"{path} cannot be read: No such file or directory"


def test_directory(tmp_path):
    assert refused(tmp_path, StoreError) == f"{tmp_path} cannot be read: Is a directory"


def test_below_a_file(stored):
    path = stored / "b.h5"
    assert refused(path, StoreError) == f"{path} cannot be read: Not a directory"


@pytest.mark.parametrize("content", [b"", b"time: 1\n", b"\x89HDF\r\n\x1a\n", b"\0" * 10_000])
def test_no_hdf5(tmp_path, content):
    path = tmp_path / "a.h5"
    path.write_bytes(content)
    assert refused(path, NotAResultError) == f"{path} is damaged or is not HDF5"


def test_hdf5_of_others(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["x"] = [1, 2, 3]
    assert refused(path, NotAResultError) == f"{path} is HDF5, but not a result of rbstab"


@pytest.mark.parametrize("version", ["1", 1.0, b"1", [1], True])
def test_schema_version_of_the_wrong_kind(stored, version):
    with h5py.File(stored, "r+") as file:
        file.attrs["schema_version"] = version
    assert refused(stored, NotAResultError).endswith("is HDF5, but not a result of rbstab")


@pytest.mark.parametrize("version", [2, 3, 2**40])
def test_newer_schema(stored, version):
    with h5py.File(stored, "r+") as file:
        file.attrs["schema_version"] = version
        del file["config"]  # The newer version is reported before any other defect.
    message = refused(stored, NewerSchemaError)
    assert f"(schema version {version}, this one reads up to 1)" in message
    assert message.endswith("update rbstab")


@pytest.mark.parametrize("kind", [np.int8, np.int32, np.uint64])
def test_any_integer_may_hold_the_schema_version(stored, kind):
    with h5py.File(stored, "r+") as file:
        file.attrs["schema_version"] = kind(1)
    assert open_result(stored).status == "completed"


@pytest.mark.parametrize("name", ["title", "status", "run_id", "engine", "digest"])
def test_attribute_missing(stored, name):
    with h5py.File(stored, "r+") as file:
        del file.attrs[name]
    assert refused(stored, NotAResultError) == f"{stored} is damaged: {name} is missing"


def test_config_missing(stored):
    with h5py.File(stored, "r+") as file:
        del file["config"]
    assert refused(stored, NotAResultError) == f"{stored} is damaged: config is missing"


def test_several_missing(stored):
    with h5py.File(stored, "r+") as file:
        del file.attrs["status"], file.attrs["title"]
    assert refused(stored, NotAResultError) == f"{stored} is damaged: title, status is missing"


def test_array_without_named_dimensions(stored):
    with h5py.File(stored, "r+") as file:
        file["more"] = [1.0, 2.0]
    assert "is damaged" in refused(stored, NotAResultError)


def test_config_that_is_no_text(stored):
    with h5py.File(stored, "r+") as file:
        del file["config"]
        file["config"] = 1.0
    assert "is damaged" in refused(stored, NotAResultError)


def test_text_that_is_no_utf_8(stored):
    with h5py.File(stored, "r+") as file:
        del file["config"]
        file.create_dataset("config", data=b"\xff\xfe", dtype=h5py.string_dtype())
    assert "is damaged" in refused(stored, NotAResultError)


@pytest.mark.parametrize("kind", ["group", "type"])
def test_config_that_is_no_array(stored, kind):
    with h5py.File(stored, "r+") as file:
        del file["config"]
        if kind == "group":
            file.create_group("config")
        else:
            file["config"] = np.dtype("f8")
    refused(stored, NotAResultError)


def test_an_array_larger_than_any_memory(stored):
    """A file of a few kilobytes may declare such an array."""
    with h5py.File(stored, "r+") as file:
        dataset = file.create_dataset("x", shape=(10**13, 3), dtype="f8", chunks=(1000, 3))
        dataset.dims[0].attach_scale(file["time"])
        dataset.dims[1].attach_scale(file["axis"])
    refused(stored, NotAResultError)


@pytest.mark.parametrize("version", [0, -1])
def test_schema_versions_that_never_were(stored, version):
    with h5py.File(stored, "r+") as file:
        file.attrs["schema_version"] = version
    refused(stored, NotAResultError)


def refused_to_write(path, **options):
    with pytest.raises(StoreError) as caught:
        write_result(path, result(), **options)
    return str(caught.value)


def test_folder_below_a_file(stored):
    path = stored / "b" / "c.h5"
    assert refused_to_write(path) == f"{path} cannot be written: Not a directory"


def test_file_below_a_file(stored):
    """The message has the path and the reason of the operating system."""
    path = stored / "b.h5"
    assert re.fullmatch(f"{re.escape(str(path))} cannot be written: .+", refused_to_write(path))


def test_file_below_a_file_is_told_as_such(stored):
    assert refused_to_write(stored / "b.h5").endswith("Not a directory")


def test_name_too_long(tmp_path):
    assert refused_to_write(tmp_path / ("x" * 300)).endswith(
        "cannot be written: File name too long"
    )


def test_a_folder_is_not_replaced(tmp_path):
    path = tmp_path / "a.h5"
    path.mkdir()
    assert refused_to_write(path) == f"{path} exists already"
    assert refused_to_write(path, replace=True) == f"{path} cannot be written: Is a directory"
    assert list(tmp_path.iterdir()) == [path]
    assert list(path.iterdir()) == []


def test_a_file_system_without_write_access():
    """In /proc not even root can create a file."""
    if not Path("/proc/self").exists():
        pytest.skip("no such file system here")
    assert refused_to_write(Path("/proc/1.h5")).startswith("/proc/1.h5 cannot be written: ")
