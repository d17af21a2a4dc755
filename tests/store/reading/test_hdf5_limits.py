"""Protects the limits of HDF5 files: what is just allowed is read, one more is refused."""

from dataclasses import replace
from io import BytesIO

import h5py
import numpy as np
import pytest

from rbstab.store.errors import NotAResultError
from rbstab.store.reading.opening import open_hdf5

TEXT = h5py.string_dtype("utf-8")
MEBIBYTE = 1 << 20


@pytest.fixture
def read(tmp_path):
    """A function that makes a file, and returns what a reader finds in it."""
    path = tmp_path / "a.h5"

    def read(make, look):
        with h5py.File(path, "w") as file:
            file.attrs["schema_version"] = 1
            make(file)
        with open_hdf5(path) as reader:
            return look(reader)

    return read


@pytest.mark.parametrize("count", [0, 1, 199])
def test_up_to_200_attributes(read, count):
    """The schema version is one of them, but is not returned."""

    def make(file):
        for number in range(count):
            file.attrs[f"a{number}"] = number

    assert read(make, lambda reader: reader.attributes()) == {f"a{n}": n for n in range(count)}


def test_more_attributes_are_refused(read):
    def make(file):
        for number in range(200):
            file.attrs[f"a{number}"] = number

    with pytest.raises(NotAResultError, match="more attributes than a result of rbstab"):
        read(make, lambda reader: reader.attributes())


@pytest.mark.parametrize(
    "value", [np.zeros(3), np.zeros((0,)), h5py.Empty("f8"), 1j, True, np.array(["a", "b"], object)]
)
def test_an_attribute_that_is_no_number_and_no_text(read, value):
    def make(file):
        file.attrs["odd"] = value

    with pytest.raises(NotAResultError, match="attribute odd is neither a number nor a text"):
        read(make, lambda reader: reader.attributes())


@pytest.mark.parametrize("value", ["", "text", 3, -1, 0.5, float("inf")])
def test_attributes_of_plain_types(read, value):
    def make(file):
        file.attrs["a"] = value

    found = read(make, lambda reader: reader.attributes())
    assert found == {"a": value}
    assert type(found["a"]) is type(value)


def arrays(count, in_group):
    def make(file):
        for number in range(count):
            file[f"x{number}"] = number
        for number in range(in_group):
            file[f"group/y{number}"] = number

    return make


def test_names_of_arrays_in_the_file_and_in_groups(read):
    def make(file):
        arrays(2, 3)(file)
        file.create_group("empty")

    names = read(make, lambda reader: reader.names())
    assert sorted(names) == ["empty", "group/y0", "group/y1", "group/y2", "x0", "x1"]


@pytest.mark.parametrize(("count", "in_group"), [(2000, 0), (999, 1000), (0, 1999)])
def test_up_to_2000_arrays(read, count, in_group):
    """A group counts as one."""
    assert count + in_group + bool(in_group) == 2000
    names = read(arrays(count, in_group), lambda reader: reader.names())
    assert len(names) == count + in_group


@pytest.mark.parametrize(("count", "in_group"), [(2001, 0), (1000, 1000), (0, 2000)])
def test_more_arrays_are_refused(read, count, in_group):
    with pytest.raises(NotAResultError, match="more arrays than a result of rbstab"):
        read(arrays(count, in_group), lambda reader: reader.names())


def one_text(size, copies=1):
    def make(file):
        dataset = file.create_dataset("text", data=["x" * size] * copies, dtype=TEXT)
        dataset.make_scale("text")

    return make


def test_texts_of_up_to_16_mebibytes(read):
    found = read(one_text(16 * MEBIBYTE), lambda reader: reader.variable("text"))
    assert found.data.tolist() == ["x" * 16 * MEBIBYTE]


@pytest.mark.parametrize(("size", "copies"), [(16 * MEBIBYTE + 1, 1), (8 * MEBIBYTE + 1, 2)])
def test_longer_texts_are_refused(read, size, copies):
    with pytest.raises(NotAResultError, match=r"text has 16\.8 MB of text, more than rbstab"):
        read(one_text(size, copies), lambda reader: reader.variable("text"))


@pytest.mark.parametrize(
    "options", [{"chunks": (2,)}, {"maxshape": (None,)}, {"compression": "gzip"}], ids=str
)
def test_arrays_that_are_not_in_one_piece_are_refused(read, options):
    def make(file):
        file.create_dataset("x", data=np.arange(4.0), **options)

    with pytest.raises(NotAResultError, match="x is stored in chunks or with a filter"):
        read(make, lambda reader: reader.array("x"))


@pytest.mark.parametrize("kind", ["f8", "f4", "i1", "u8", "S3"])
def test_arrays_of_plain_types(read, kind):
    def make(file):
        file.create_dataset("x", data=np.arange(4).astype(kind))

    assert read(make, lambda reader: reader.array("x")[()].dtype) == np.dtype(kind)


@pytest.mark.parametrize("kind", ["c16", "?", [("a", "f8")], h5py.ref_dtype], ids=str)
def test_arrays_of_other_types_are_refused(read, kind):
    def make(file):
        file.create_dataset("x", shape=(4,), dtype=kind)

    with pytest.raises(NotAResultError, match="x holds neither numbers nor texts"):
        read(make, lambda reader: reader.array("x"))


def test_an_array_that_was_never_written_is_larger_than_the_file(read):
    """HDF5 takes space for an array when it is first written; until then it invents the entries."""

    def make(file):
        file.create_dataset("x", shape=(4,), dtype="f8")

    with pytest.raises(NotAResultError, match="array x is larger than the file"):
        read(make, lambda reader: reader.array("x"))


def test_a_file_that_becomes_shorter_while_it_is_read_gives_no_numbers(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["x"] = np.ones(1000)
    with open_hdf5(path) as reader:
        raw_arrays = reader.raw_arrays._replace(raw=BytesIO(path.read_bytes()[:4000]))
        short = replace(reader, raw_arrays=raw_arrays)
        with pytest.raises(NotAResultError, match="became shorter while it was read"):
            short.variable("x")
