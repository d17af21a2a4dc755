"""Files of motions in netCDF-4 compatible HDF5, described in `results/README.md`.

These files are large and many. HDF5 only lays them out in memory (`hdf5_layout`). This module
writes them block by block, and hashes what it writes at the same time. So the seal is the digest of
the motions in memory, no data are copied or read again, other threads do not wait for HDF5, and the
disk starts writing early.
"""

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from rbstab.store.disk.atomic import atomic_file, write_all
from rbstab.store.disk.existence import path_exists
from rbstab.store.disk.seal import format_seal, read_seal
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.hdf5_layout import Layout, meant_bytes
from rbstab.store.held_files import check_unchanged
from rbstab.store.motions import Motions, coordinates_of
from rbstab.store.reading.hdf5_reader import Hdf5Reader
from rbstab.store.reading.opening import open_hdf5
from rbstab.store.table import RUN
from rbstab.store.variables import Variable

MOTIONS_VERSION = 1
"""The format version that this program writes, and the newest that it reads."""

KIND = "traces"
"""The attribute `kind` of these files."""

_BLOCK = 1 << 20


class FileChecksum(NamedTuple):
    """The SHA-256 of a file of motions, as in its seal, and its size in bytes."""

    digest: str
    size: int


def write_motions(path: Path, motions: Motions) -> FileChecksum:
    """Write motions to a file atomically.

    Args:
        path: The file; it is replaced, and its folder must exist.
        motions: Arrays of floats along run, time and further dimensions, and their coordinates.

    Returns:
        The checksum of the file.

    Raises:
        StoreError: The file cannot be written.
    """
    layout, arrays = _lay_out(motions)
    try:
        with atomic_file(path, replace=True) as file:
            return _write(file, meant_bytes(layout, arrays))
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def read_checksum(path: Path) -> FileChecksum | None:
    """Return the checksum in the seal of a file, without reading the data.

    Returns:
        The checksum, or None if the file is missing or has no complete seal.

    Raises:
        StoreError: The file cannot be read.
    """
    if not path_exists(path):
        return None
    digest = read_seal(path)
    return FileChecksum(digest, path.stat().st_size) if digest is not None else None


def check_motions(path: Path, checksum: FileChecksum) -> None:
    """Read a whole file of motions and check its content.

    Args:
        path: The file.
        checksum: The expected checksum.

    Raises:
        NotAResultError: The file is damaged, or is a different file.
        StoreError: The file cannot be read.
    """
    check_unchanged(path)
    if read_checksum(path) != checksum:
        raise NotAResultError(f"{path} is damaged: its content does not match its digest")


def read_motions(path: Path, row: int | None = None) -> Motions:
    """Read motions without checking the seal.

    Args:
        path: The file.
        row: The index of the only run to read; default all runs.

    Raises:
        NotAResultError: The file is damaged, or has no motions.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened.
    """
    with open_hdf5(path) as file:
        file.check_version(MOTIONS_VERSION)
        attributes = file.attributes()
        if attributes.pop("kind", None) != KIND:
            raise NotAResultError(f"{path} is a result, but has no traces")
        return Motions({name: _variable(file, name, row) for name in file.names()}, attributes)


def _variable(file: Hdf5Reader, name: str, row: int | None) -> Variable:
    if row is None or file.dimensions(name)[:1] != (RUN,):
        return file.variable(name)
    one_run = file.variable(name, row)
    return one_run._replace(dimensions=one_run.dimensions[1:])


def _lay_out(motions: Motions) -> tuple[Layout, dict[str, NDArray[Any]]]:
    """Lay out the file, without the data of its arrays, and return these by name.

    The files of a sweep differ only in these data. So the last layout is kept: to make one takes a
    fifth of the time of a file.
    """
    key = _layout_key(motions)
    layout = _last_layout.get(key)
    if layout is None:
        layout = _new_layout(motions)
        _last_layout.clear()
        _last_layout[key] = layout
    arrays = {
        name: variable.data.astype("<f8", copy=False)
        for name, variable in _data_variables(motions.variables)
    }
    if RUN in motions.variables:
        arrays[RUN] = motions.variables[RUN].data
    return layout, arrays


_last_layout: dict[tuple[object, ...], Layout] = {}
"""The last layout, by all that determines it."""


def _layout_key(motions: Motions) -> tuple[object, ...]:
    """Return all that determines the layout of a file: everything but the data that are left out.

    The attributes are a text, because the numbers 1 and 1.0 are equal, but are stored differently.
    """
    described = [
        (name, tuple(v.dimensions), v.data.shape, v.data.dtype.str, v.unit, v.long_name)
        for name, v in motions.variables.items()
    ]
    written = [name for name in coordinates_of(motions.variables) if name != RUN]
    contents = [motions.variables[name].data.tobytes() for name in written]
    return (*described, *contents, repr(list(motions.attributes.items())))


def _new_layout(motions: Motions) -> Layout:
    layout = Layout()
    with layout.file() as file:
        for name in coordinates_of(motions.variables):
            variable = motions.variables[name]
            scale = file.create_dataset(name, data=variable.data, track_order=True)
            _describe(scale, variable)
            scale.make_scale(name)
            if name == RUN:
                layout.take_over(scale, name)
        for name, variable in _data_variables(motions.variables):
            dataset = layout.reserve(file, name, variable.data.shape, np.dtype("<f8"))
            _describe(dataset, variable)
            for index, dimension in enumerate(variable.dimensions):
                dataset.dims[index].attach_scale(file[dimension])
        format_attributes = {"schema_version": MOTIONS_VERSION, "kind": KIND}
        for name, value in (dict(motions.attributes) | format_attributes).items():
            file.attrs[name] = value
    return layout


def _data_variables(variables: Mapping[str, Variable]) -> Iterator[tuple[str, Variable]]:
    coordinates = coordinates_of(variables)
    return (item for item in variables.items() if item[0] not in coordinates)


def _describe(dataset: h5py.Dataset, variable: Variable) -> None:
    dataset.attrs["units"] = variable.unit
    dataset.attrs["long_name"] = variable.long_name


def _write(file: BinaryIO, content: Iterable[memoryview]) -> FileChecksum:
    """Write the bytes of a file, in ascending order, then the seal."""
    digest, size = hashlib.sha256(), 0
    # One thread hashes the blocks in order while this one writes; neither waits for the other.
    with ThreadPoolExecutor(1) as hashing:
        for piece in content:
            for begin in range(0, len(piece), _BLOCK):
                block = piece[begin : begin + _BLOCK]
                hashing.submit(digest.update, block)
                write_all(file, block)
            _start_writeback(file, size, len(piece))
            size += len(piece)
    seal = format_seal(digest.hexdigest())
    write_all(file, seal)
    return FileChecksum(digest.hexdigest(), size + len(seal))


def _start_writeback(file: BinaryIO, offset: int, size: int) -> None:
    """Start to write some bytes from the system's cache to disk, without waiting."""
    if hasattr(os, "posix_fadvise"):
        # With this advice the system starts to write the bytes that are not on disk yet.
        os.posix_fadvise(file.fileno(), offset, size, os.POSIX_FADV_DONTNEED)
