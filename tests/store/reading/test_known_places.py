"""Protects the reading of many alike files: each is read as if it were the only one."""

import dataclasses
from io import BytesIO

import h5py
import numpy as np
import pytest
from support.results import assert_equal, result

from rbstab.store import run_file
from rbstab.store.errors import NotAResultError
from rbstab.store.reading import known_places
from rbstab.store.reading.hdf5_reader import Hdf5Reader
from rbstab.store.result import Result
from rbstab.store.run_file import open_result, write_result


@pytest.fixture(autouse=True)
def nothing_known(monkeypatch):
    """Let each test begin as a process that uses known places and knows none."""
    monkeypatch.setattr(known_places, "_known", None)
    known_places.use_known_places()


def changed(**variables):
    """Return a result with other arrays; None removes one."""
    base = result(1)
    found = {name: v for name, v in (base.variables | variables).items() if v is not None}
    return dataclasses.replace(base, variables=found)


def described(**attributes):
    """Return a result with other attributes; None removes one."""
    base = result(1)
    found = {name: v for name, v in (base.attributes | attributes).items() if v is not None}
    return dataclasses.replace(base, attributes=found)


ORIGINAL = result().variables

OTHERS = {
    "other numbers": result(1),
    "other texts": changed(part=ORIGINAL["part"]._replace(data=np.array(list("abc"), object))),
    "a text that ends": changed(
        part=ORIGINAL["part"]._replace(data=np.array(["", "x" * 99, "µ"], object))
    ),
    "another unit": changed(lyapunov=ORIGINAL["lyapunov"]._replace(unit="K")),
    "another meaning": changed(lyapunov=ORIGINAL["lyapunov"]._replace(long_name="w: ∫v'dt")),
    "other dimensions": changed(
        orientation=ORIGINAL["orientation"]._replace(dimensions=("time", "part"))
    ),
    "another type": changed(
        lyapunov=ORIGINAL["lyapunov"]._replace(data=np.arange(5, dtype=np.int64))
    ),
    "another name": changed(lyapunov=None, lyapunow=ORIGINAL["lyapunov"]),
    "two names exchanged": changed(
        lyapunov=ORIGINAL["time"]._replace(dimensions=("time",)), time=ORIGINAL["lyapunov"]
    ),
    "one array less": changed(lyapunov=None),
    "another text": described(title="µ" * 99),
    "a text in place of a number": described(steps="12 steps"),
    "a number in place of a text": described(title=1.5),
    "a fraction in place of a whole number": described(steps=12.0),
    "one attribute more": described(more=7),
    "one attribute less": described(steps=None),
    "another config": dataclasses.replace(result(1), config="title: other\n"),
}


@pytest.fixture
def read_second(tmp_path, monkeypatch):
    """A function that reads a result after another one, as if their files had the same size."""
    monkeypatch.setattr(Hdf5Reader, "size", 10**6)

    def read_second(content: Result) -> Result:
        for name, stored in (("first", result()), ("second", content)):
            write_result(tmp_path / f"{name}.h5", stored)
        open_result(tmp_path / "first.h5")
        assert known_places._known
        return open_result(tmp_path / "second.h5")

    return read_second


@pytest.mark.parametrize("name", OTHERS)
def test_a_file_is_read_as_if_it_were_the_only_one(read_second, name):
    assert_equal(read_second(OTHERS[name]), OTHERS[name])


def test_an_attribute_with_several_values_is_refused_before_it_is_read(read_second, monkeypatch):
    """HDF5 would write those after the first into memory that has another use."""
    make = run_file._file_bytes

    def with_odd_attribute(content):
        image = BytesIO(make(content))
        if content.attributes.get("odd"):
            with h5py.File(image, "r+") as file:
                file.attrs.create("steps", np.arange(8, dtype="i1"))
        return image.getvalue()

    monkeypatch.setattr(run_file, "_file_bytes", with_odd_attribute)
    with pytest.raises(NotAResultError, match="attribute steps is neither a number nor a text"):
        read_second(described(odd=1))


def test_the_arrays_of_an_alike_file_are_not_looked_for(read_second, monkeypatch):
    read = Hdf5Reader.variable
    calls = []

    def variable(self, name):
        calls.append(name)
        return read(self, name)

    monkeypatch.setattr(Hdf5Reader, "variable", variable)
    assert_equal(read_second(result(1)), result(1))
    assert calls == [*ORIGINAL, "config"]


def test_not_too_many_places_are_remembered(tmp_path, monkeypatch):
    monkeypatch.setattr(known_places, "MAX_SIZES", 2)
    for samples in (2, 3, 4, 5):
        path = tmp_path / f"{samples}.h5"
        write_result(path, result(samples=samples))
        assert_equal(open_result(path), result(samples=samples))
    assert known_places._known is not None
    assert len(known_places._known) == 2


def test_a_file_without_a_seal_is_never_read_from_known_places(tmp_path):
    """An array that was removed from it may still have its numbers in the file."""
    path = tmp_path / "a.h5"
    write_result(path, result())
    open_result(path)
    content = path.read_bytes()
    path.write_bytes(content[: content.rindex(b"\nrbstab sha256 ")])
    assert known_places._known is not None
    known_places._known.clear()
    assert_equal(open_result(path), result())
    assert not known_places._known


def test_a_process_that_was_not_asked_remembers_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(known_places, "_known", None)
    path = tmp_path / "a.h5"
    write_result(path, result())
    assert_equal(open_result(path), result())
    assert known_places._known is None
    # What is known stays when a process is asked again.
    known_places.use_known_places()
    open_result(path)
    known_places.use_known_places()
    assert known_places._known
