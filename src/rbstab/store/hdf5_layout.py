"""Lay out an HDF5 file in memory, so that HDF5 itself never writes to a disk.

h5py drops the errors of writes that HDF5 makes while it closes an object, and HDF5 may end the
process if a disk fills. So HDF5 writes into memory: all metadata and small arrays. For large arrays
it only reserves space. The caller writes everything to the disk, and sees every error.
"""

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

TEXT = h5py.string_dtype("utf-8")

_PAGE = 4096


class Piece(NamedTuple):
    """A piece of a file, from `Layout.pieces`.

    Args:
        offset: Its first byte in the file.
        size: Its number of bytes.
        array: The name of the array that it holds.
        content: Its bytes, if it holds no array but what HDF5 wrote.
    """

    offset: int
    size: int
    array: str | None
    content: bytes


class Layout:
    """The layout of an HDF5 file: what HDF5 wrote, and the space that it reserved for arrays."""

    def __init__(self) -> None:
        self._memory = _SparseMemory()
        self._arrays: dict[str, tuple[int, int]] = {}

    @contextmanager
    def file(self) -> Iterator[h5py.File]:
        """Return a context that yields the new file. Its content stays in memory."""
        with h5py.File(self._memory, "w", track_order=True) as file:
            yield file

    def reserve(
        self, file: h5py.File, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]
    ) -> h5py.Dataset:
        """Create an array whose data the caller will write.

        Args:
            file: The open file.
            name: The name of the array.
            shape: Its shape.
            dtype: The type of its numbers, in the byte order of the file.
        """
        properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        properties.set_layout(h5py.h5d.CONTIGUOUS)
        properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        properties.set_obj_track_times(False)
        properties.set_attr_creation_order(h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED)
        kind, space = h5py.h5t.py_create(dtype), h5py.h5s.create_simple(shape)
        dataset = h5py.h5d.create(file.id, name.encode(), kind, space, properties)
        size = int(np.prod(shape, dtype=int)) * dtype.itemsize
        if size:
            self._arrays[name] = dataset.get_offset(), size
        return h5py.Dataset(dataset)

    @property
    def size(self) -> int:
        """The size of the file, bytes; known when the file is closed."""
        return self._memory.size

    def offset(self, name: str) -> int:
        """Return the offset of a reserved array in the file; 0 if it is empty."""
        return self._arrays.get(name, (0, 0))[0]

    def pieces(self) -> Iterator[Piece]:
        """Yield all pieces of the file, ascending and without gaps."""
        end = 0
        for name, (offset, size) in sorted(self._arrays.items(), key=lambda item: item[1]):
            yield from self._written(end, offset)
            yield Piece(offset, size, name, b"")
            end = offset + size
        yield from self._written(end, self.size)

    def _written(self, start: int, stop: int) -> Iterator[Piece]:
        if stop > start:
            yield Piece(start, stop - start, None, self._memory.content(start, stop))


def array_bytes(data: NDArray[Any]) -> memoryview:
    """Return the bytes of an array, as they stand in a file."""
    return np.ascontiguousarray(data).reshape(-1).view(np.uint8).data


def meant_bytes(layout: Layout, arrays: Mapping[str, NDArray[Any]]) -> Iterator[memoryview]:
    """Yield the bytes of a file in ascending order.

    Args:
        layout: The layout.
        arrays: The data of the reserved arrays by name, in the byte order of the file.
    """
    for piece in layout.pieces():
        name = piece.array
        yield memoryview(piece.content) if name is None else array_bytes(arrays[name])


class _SparseMemory(io.RawIOBase):
    """A file in memory that only keeps the pages that were written; all others are zero."""

    def __init__(self) -> None:
        super().__init__()
        self.size = 0
        self._position = 0
        self._pages: dict[int, bytearray] = {}

    def seek(self, offset: int, whence: int = 0) -> int:
        self._position = offset + {0: 0, 1: self._position, 2: self.size}[whence]
        return self._position

    def write(self, content: Any) -> int:
        for page, begin, end, done in self._parts(self._position, len(content)):
            memory = self._pages.setdefault(page, bytearray(_PAGE))
            memory[begin:end] = content[done : done + end - begin]
        self._position += len(content)
        self.size = max(self.size, self._position)
        return len(content)

    def readinto(self, target: Any) -> int:
        size = max(0, min(len(target), self.size - self._position))
        target[:size] = self.content(self._position, self._position + size)
        self._position += size
        return size

    def truncate(self, size: int | None = None) -> int:
        self.size = self._position if size is None else size
        return self.size

    def content(self, start: int, stop: int) -> bytes:
        zeros = bytes(_PAGE)
        return b"".join(
            self._pages.get(page, zeros)[begin:end]
            for page, begin, end, _ in self._parts(start, stop - start)
        )

    def _parts(self, start: int, size: int) -> Iterator[tuple[int, int, int, int]]:
        """Yield page, first and last byte in it, and bytes before, for a range of bytes."""
        done = 0
        while done < size:
            page, begin = divmod(start + done, _PAGE)
            end = min(_PAGE, begin + size - done)
            yield page, begin, end, done
            done += end - begin
