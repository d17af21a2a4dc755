"""Protects files that HDF5 lays out in memory: their pieces, and the memory itself."""

import io
import itertools
import tracemalloc

import h5py
import numpy as np
import pytest

from rbstab.store.hdf5_layout import Layout, _SparseMemory, meant_bytes

DOUBLE = np.dtype("<f8")


def lay_out(**shapes):
    layout = Layout()
    with layout.file() as file:
        file.attrs["title"] = "a title"
        for name, shape in shapes.items():
            layout.reserve(file, name, shape, DOUBLE)
    return layout


SHAPES = [
    {},
    {"a": (3,)},
    {"a": (3,), "b": (2, 3), "c": (1000, 3)},
    {"empty": (0, 3), "a": (5,)},
    {"b": (5,), "a": (5,)},
]


@pytest.mark.parametrize("shapes", SHAPES, ids=str)
def test_pieces_fill_the_file_without_gaps(shapes):
    layout = lay_out(**shapes)
    pieces = list(layout.pieces())
    assert pieces[0].offset == 0
    assert all(piece.size > 0 for piece in pieces)
    for before, after in itertools.pairwise(pieces):
        assert after.offset == before.offset + before.size
    assert pieces[-1].offset + pieces[-1].size == layout.size
    held = {piece.array: piece.size for piece in pieces if piece.array is not None}
    assert held == {name: 8 * np.prod(shape) for name, shape in shapes.items() if np.prod(shape)}
    assert all(len(piece.content) == piece.size for piece in pieces if piece.array is None)


@pytest.mark.parametrize("shapes", SHAPES, ids=str)
def test_hdf5_reads_what_was_meant(shapes):
    rng = np.random.default_rng(1)
    arrays = {name: rng.normal(size=shape) for name, shape in shapes.items()}
    whole = b"".join(meant_bytes(lay_out(**shapes), arrays))
    with h5py.File(io.BytesIO(whole)) as file:
        assert file.attrs["title"] == "a title"
        assert list(file) == list(shapes)
        for name, data in arrays.items():
            np.testing.assert_array_equal(file[name][()], data)


def test_arrays_without_the_time_of_their_creation():
    """With it, the same data would make other bytes one second later."""
    layout = Layout()
    with layout.file() as file:
        array = layout.reserve(file, "a", (3,), DOUBLE)
        assert not array.id.get_create_plist().get_obj_track_times()


def test_an_array_larger_than_the_memory_takes_no_memory():
    tracemalloc.start()
    try:
        layout = lay_out(a=(10**12,))
        assert layout.size > 8 * 10**12
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


def test_places_are_the_same_only_if_all_are():
    one = lay_out(a=(3,), b=(4,))
    assert one.has_same_places(lay_out(a=(3,), b=(4,)))
    assert not one.has_same_places(lay_out(a=(3,), b=(5,)))
    assert not one.has_same_places(lay_out(b=(3,), a=(4,)))


def test_the_memory_behaves_like_a_file(rng):
    """Each operation has the outcome that it has on a file of Python."""
    memory, file = _SparseMemory(), io.BytesIO()
    assert memory.read(5) == b""
    for _ in range(400):
        offset, size = (int(number) for number in rng.integers(0, 20_000, 2))
        whence = int(rng.integers(0, 3))
        back = min(offset, file.tell() if whence == 1 else len(file.getvalue()))
        place = offset if whence == 0 else -back
        assert memory.seek(place, whence) == file.seek(place, whence)
        if rng.random() < 0.5:
            content = rng.bytes(size)
            assert memory.write(content) == file.write(content)
            assert memory.size == len(file.getvalue())
        else:
            assert memory.read(size) == file.read(size)
        assert memory.tell() == file.tell()
    assert memory.content(0, memory.size) == file.getvalue()


def test_the_memory_can_be_made_longer():
    memory = _SparseMemory()
    memory.write(b"123")
    assert memory.truncate(10_000) == memory.size == 10_000
    assert memory.content(0, 10_000) == b"123" + bytes(9997)
    memory.seek(2)
    assert memory.truncate() == memory.size == 2
