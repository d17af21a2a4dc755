"""Protects against damaged heaps of texts, on which HDF5 loops for ever."""

import os

import h5py
import numpy as np
import pytest

from rbstab.store.errors import NotAResultError
from rbstab.store.reading import text_heaps
from rbstab.store.reading.opening import open_hdf5
from rbstab.store.reading.text_heaps import find_texts

HEADER = 16


@pytest.fixture(params=[1, 5, 400], ids="{} texts".format)
def content(request, tmp_path):
    """The bytes of an HDF5 file with texts of many lengths, in one heap or several."""
    path = tmp_path / "texts.h5"
    with h5py.File(path, "w") as file:
        texts = ["x" * (37 * number % 200) for number in range(1, request.param + 1)]
        file.create_dataset("texts", data=texts, dtype=h5py.string_dtype())
        file.attrs["title"] = "a title"
    return path.read_bytes()


def is_whole(tmp_path, content):
    path = tmp_path / "changed.h5"
    path.write_bytes(content)
    with path.open("rb") as file:
        return find_texts(file) is not None


def free_spaces(content):
    """Return where the last entries of all heaps begin."""
    found, start = [], content.find(b"GCOL")
    while start >= 0:
        end, at = start + int.from_bytes(content[start + 8 : start + 16], "little"), start + HEADER
        while content[at : at + 2] != b"\0\0":
            at += HEADER + -(-int.from_bytes(content[at + 8 : at + 16], "little") // 8) * 8
        found.append(at)
        start = content.find(b"GCOL", end)
    return found


def test_heaps_of_hdf5_are_whole(tmp_path, content):
    assert free_spaces(content)
    assert is_whole(tmp_path, content)
    assert is_whole(tmp_path, np.arange(1000.0).tobytes())


def test_a_file_is_searched_once_until_it_changes(tmp_path, content, monkeypatch):
    """One that has just been written may change again with the same time stamp."""
    path, searches = tmp_path / "texts.h5", []
    search = text_heaps._searched
    monkeypatch.setattr(text_heaps, "_known", {})

    def counted(file):
        searches.append(1)
        return search(file)

    monkeypatch.setattr(text_heaps, "_searched", counted)

    def found():
        with path.open("rb") as file:
            return find_texts(file)

    def age(seconds):
        os.utime(path, (path.stat().st_atime, path.stat().st_mtime - seconds))

    path.write_bytes(content)
    assert found() == found()
    assert len(searches) == 2
    age(60)
    assert found() == found()
    assert len(searches) == 3
    # The same size and the same times, but another file.
    other = tmp_path / "other.h5"
    other.write_bytes(content[: free_spaces(content)[0]].ljust(len(content), b"\1"))
    os.utime(other, (path.stat().st_atime, path.stat().st_mtime))
    other.replace(path)
    assert found() is None
    assert len(searches) == 4


@pytest.mark.parametrize("size", [0, 1, 8, 2**63])
def test_wrong_size_of_the_free_space(tmp_path, content, size):
    at = free_spaces(content)[-1]
    changed = content[: at + 8] + size.to_bytes(8, "little") + content[at + 16 :]
    assert not is_whole(tmp_path, changed)


@pytest.mark.parametrize("size", [5000, 2**40, 2**64 - 1])
def test_wrong_size_of_a_text(tmp_path, content, size):
    at = content.find(b"GCOL") + HEADER
    changed = content[: at + 8] + size.to_bytes(8, "little") + content[at + 16 :]
    assert not is_whole(tmp_path, changed)


@pytest.mark.parametrize("size", [0, 20, 4000, 2**40])
def test_wrong_size_of_a_heap(tmp_path, content, size):
    at = content.find(b"GCOL") + 8
    changed = content[:at] + size.to_bytes(8, "little") + content[at + 8 :]
    assert not is_whole(tmp_path, changed)


def test_a_file_with_a_damaged_heap_is_not_given_to_hdf5(tmp_path, content):
    at = content.find(b"GCOL") + 8
    path = tmp_path / "damaged.h5"
    path.write_bytes(content[:at] + bytes(8) + content[at + 8 :])
    with pytest.raises(NotAResultError) as caught, open_hdf5(path):
        pass
    assert str(caught.value) == f"{path} is damaged: its texts are not as HDF5 stores them"
