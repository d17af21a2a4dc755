"""Writing tables of runs in netCDF-4 compatible HDF5, described in `results/README.md`.

A table may be larger than the memory. HDF5 lays out the file in memory (`hdf5_layout`), and this
module writes the columns in batches of runs. The digests in the file are those of the batches in
memory. At the end the file is read back, compared with them, and sealed.
"""

import errno
import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
from numpy.typing import NDArray

from rbstab.store.digest import digest_of_table
from rbstab.store.disk.atomic import atomic_file, write_at
from rbstab.store.disk.seal import format_seal
from rbstab.store.errors import StoreError
from rbstab.store.hdf5_layout import Layout, Piece, array_bytes
from rbstab.store.table import (
    RUN,
    Arrays,
    Column,
    TableDigest,
    TableHeader,
    attributes_of,
    dimensions_of,
)
from rbstab.store.variables import Variable, check_shape

TABLE_VERSION = 1
"""The format version that this program writes, and the newest that it reads."""

KIND = "sweep"
"""The attribute `kind` of these files."""

_TEXT = h5py.string_dtype("utf-8")

_BLOCK = 1 << 20

_OTHER_BYTES = "the disk returned other bytes than were written"

_NUMBERS = Column((), "<i8", "1", "number of the run")
"""The column `run`."""


def write_table(path: Path, header: TableHeader, batches: Iterable[Arrays]) -> None:
    """Write a table atomically, in batches of runs.

    Args:
        path: The file; it is replaced, and its folder must exist.
        header: The header of the table.
        batches: The data of the columns; only one batch is in memory at a time.

    Raises:
        StoreError: The file cannot be written, or a batch cannot be read.
    """
    try:
        with atomic_file(path, replace=True) as file:
            _write(file, header, batches)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreError(f"{path} cannot be written: {reason}") from error


def _write(file: BinaryIO, header: TableHeader, batches: Iterable[Arrays]) -> None:
    layout = _lay_out(header, "0" * 64)
    digest, start = TableDigest(header.layout), 0
    for batch in batches:
        stop = start + len(next(iter(batch.values())))
        for name, column in header.layout.items():
            # Otherwise numpy would silently broadcast a single number along an axis.
            check_shape(name, batch[name], (stop - start, *column.shape))
            content = array_bytes(batch[name].astype(_stored_type(column), copy=False))
            digest.add(name, content)
            write_at(file, layout.offset(name) + start * column.size, content)
        write_at(file, layout.offset(RUN) + start * _NUMBERS.size, _numbers(header, start, stop))
        start = stop
    assert start == header.length, f"{start} runs instead of {header.length}"
    final = _lay_out(header, digest.result())
    assert final.has_same_places(layout), "the digests have moved the columns"
    for piece in final.pieces():
        if piece.array is None:
            write_at(file, piece.offset, piece.content)
    seal = format_seal(_verify(file, final, header, digest.result()))
    write_at(file, final.size, seal)
    file.seek(final.size)
    if _read(file, len(seal) + 1) != seal:
        raise OSError(errno.EIO, _OTHER_BYTES)


def _verify(file: BinaryIO, layout: Layout, header: TableHeader, meant: str) -> str:
    """Compare the file with what was meant, and return the SHA-256 of its content.

    Raises:
        OSError: The file has other bytes than were written.
    """
    whole, found = hashlib.sha256(), TableDigest(header.layout)
    intact = True
    for piece in layout.pieces():
        for begin, block in _blocks(file, piece):
            whole.update(block)
            if piece.array is None:
                intact &= block == piece.content[begin : begin + len(block)]
            elif piece.array == RUN:
                stop = (begin + len(block)) // _NUMBERS.size
                intact &= block == _numbers(header, begin // _NUMBERS.size, stop)
            else:
                found.add(piece.array, block)
    if not intact or found.result() != meant:
        raise OSError(errno.EIO, _OTHER_BYTES)
    return whole.hexdigest()


def _blocks(file: BinaryIO, piece: Piece) -> Iterator[tuple[int, bytes]]:
    """Read a piece in blocks; yield the offset of each block in the piece, and the block."""
    file.seek(piece.offset)
    begin = 0
    while begin < piece.size:
        size = min(_BLOCK, piece.size - begin)
        block = _read(file, size)
        if len(block) < size:
            raise OSError(errno.EIO, _OTHER_BYTES)
        yield begin, block
        begin += len(block)


def _read(file: BinaryIO, size: int) -> bytes:
    """Read this many bytes, or those up to the end; one call may return only some of them."""
    content = b""
    while len(content) < size and (more := file.read(size - len(content))):
        content += more
    return content


def _numbers(header: TableHeader, start: int, stop: int) -> memoryview:
    return array_bytes(np.arange(header.first + start, header.first + stop, dtype=_NUMBERS.dtype))


def _lay_out(header: TableHeader, arrays_digest: str) -> Layout:
    """Lay out the file, without the data of its columns."""
    layout = Layout()
    with layout.file() as file:
        run = layout.reserve(file, RUN, (header.length,), _stored_type(_NUMBERS))
        _make_scale(run, RUN, _NUMBERS.long_name)
        for dimension, size in dimensions_of(header.layout).items():
            _add_scale(file, dimension, np.arange(1, size + 1), "component of a vector")
        for name, column in header.layout.items():
            shape = (header.length, *column.shape)
            dataset = layout.reserve(file, name, shape, _stored_type(column))
            for key, value in attributes_of(column).items():
                dataset.attrs[key] = value
            for index, dimension in enumerate((RUN, *column.dimensions)):
                dataset.dims[index].attach_scale(file[dimension])
        for name, extra in header.extras.items():
            _add_extra(file, name, extra)
        format_attributes = {
            "schema_version": TABLE_VERSION,
            "kind": KIND,
            "arrays_digest": arrays_digest,
            "digest": digest_of_table(header, arrays_digest),
        }
        for name, value in (dict(header.attributes) | format_attributes).items():
            file.attrs[name] = value
    return layout


def _stored_type(column: Column) -> np.dtype[Any]:
    return np.dtype(column.dtype).newbyteorder("<")


def _add_scale(file: h5py.File, name: str, data: NDArray[Any], long_name: str) -> None:
    _make_scale(file.create_dataset(name, data=data, track_order=True), name, long_name)


def _make_scale(dataset: h5py.Dataset, name: str, long_name: str) -> None:
    dataset.attrs["units"] = "1"
    dataset.attrs["long_name"] = long_name
    dataset.make_scale(name)


def _add_extra(file: h5py.File, name: str, extra: Variable) -> None:
    data = extra.data.astype(object) if extra.is_text else extra.data
    dataset = file.create_dataset(
        name, data=data, dtype=_TEXT if extra.is_text else None, track_order=True
    )
    dataset.attrs["units"] = extra.unit
    dataset.attrs["long_name"] = extra.long_name
    for index, dimension in enumerate(extra.dimensions):
        if dimension not in file:
            _add_scale(file, dimension, np.arange(1, len(data) + 1), f"number of the {dimension}")
        dataset.dims[index].attach_scale(file[dimension])
