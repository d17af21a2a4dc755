"""Files of motions in netCDF-4 compatible HDF5, described in `results/README.md`.

These files are large and many. HDF5 only writes the metadata and reserves space for the arrays.
This module writes the data into that space block by block, and hashes them at the same time. So no
data are copied or read again, other threads do not wait for HDF5, the disk starts writing early,
and a full disk raises an error here and not inside HDF5.
"""

import errno
import hashlib
import os
import shutil
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import BinaryIO, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from rbstab.store.atomic import atomic_path
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.existence import path_exists
from rbstab.store.motions import Motions, coordinates_of
from rbstab.store.opening import check_version, get_array, open_hdf5, to_python
from rbstab.store.result import Variable
from rbstab.store.seal import check_seal, format_seal, read_seal
from rbstab.store.table import RUN

MOTIONS_VERSION = 1
"""The format version that this program writes, and the newest that it reads."""

KIND = "traces"
"""The attribute `kind` of these files."""

METADATA_BYTES = 1 << 16
"""Bytes reserved for the metadata of a file, far more than it needs."""

_BLOCK = 1 << 20

_FORMAT_ATTRIBUTES = ("schema_version", "kind")


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
    try:
        size = sum(variable.data.nbytes for variable in motions.variables.values())
        if shutil.disk_usage(path.parent).free < size + METADATA_BYTES:
            # Checked first, because HDF5 may crash on a full disk.
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        with atomic_path(path, replace=True) as partial:
            arrays = _write_metadata(partial, motions)
            with partial.open("r+b", buffering=0) as file:
                return _write_data(file, arrays)
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
    check_seal(path)
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
        check_version(path, file, MOTIONS_VERSION)
        attributes = {name: to_python(value) for name, value in file.attrs.items()}
        if attributes.get("kind") != KIND:
            raise NotAResultError(f"{path} is a result, but has no traces")
        variables = {name: _variable(get_array(path, file, name), name, row) for name in file}
    others = {name: value for name, value in attributes.items() if name not in _FORMAT_ATTRIBUTES}
    return Motions(variables, others)


def _variable(dataset: h5py.Dataset, name: str, row: int | None) -> Variable:
    names = [str(axis[0].name).rpartition("/")[2] for axis in dataset.dims if len(axis)]
    dimensions = (name,) if dataset.is_scale else tuple(names)
    one_run = row is not None and dimensions[0] == RUN
    unit, long_name = (str(dataset.attrs[key]) for key in ("units", "long_name"))
    data = np.asarray(dataset[row] if one_run else dataset[()])
    return Variable(dimensions[1:] if one_run else dimensions, data, unit, long_name)


def _write_metadata(path: Path, motions: Motions) -> list[tuple[int, NDArray[np.float64]]]:
    """Write the file without the data of its arrays; return the offset and data of each."""
    arrays = []
    with h5py.File(path, "w-", track_order=True, locking=False) as file:
        for name in coordinates_of(motions.variables):
            variable = motions.variables[name]
            scale = file.create_dataset(name, data=variable.data, track_order=True)
            _describe(scale, variable)
            scale.make_scale(name)
        for name, variable in _data_variables(motions.variables):
            data = np.ascontiguousarray(variable.data, dtype="<f8")
            dataset = _reserve_array(file, name, data.shape)
            _describe(dataset, variable)
            for index, dimension in enumerate(variable.dimensions):
                dataset.dims[index].attach_scale(file[dimension])
            arrays.append((dataset.id.get_offset(), data))
        format_attributes = {"schema_version": MOTIONS_VERSION, "kind": KIND}
        for name, value in (dict(motions.attributes) | format_attributes).items():
            file.attrs[name] = value
    return sorted(arrays, key=lambda entry: entry[0])


def _data_variables(variables: Mapping[str, Variable]) -> Iterator[tuple[str, Variable]]:
    coordinates = coordinates_of(variables)
    return (item for item in variables.items() if item[0] not in coordinates)


def _reserve_array(file: h5py.File, name: str, shape: tuple[int, ...]) -> h5py.Dataset:
    """Create an array whose space in the file is reserved but not written."""
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_layout(h5py.h5d.CONTIGUOUS)
    properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    properties.set_obj_track_times(False)
    properties.set_attr_creation_order(h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED)
    space = h5py.h5s.create_simple(shape)
    return h5py.Dataset(
        h5py.h5d.create(file.id, name.encode(), h5py.h5t.IEEE_F64LE, space, properties)
    )


def _describe(dataset: h5py.Dataset, variable: Variable) -> None:
    dataset.attrs["units"] = variable.unit
    dataset.attrs["long_name"] = variable.long_name


def _write_data(file: BinaryIO, arrays: list[tuple[int, NDArray[np.float64]]]) -> FileChecksum:
    """Write the data at their offsets, in ascending order, then the seal, in one pass."""
    digest, end = hashlib.sha256(), file.seek(0, 2)
    file.seek(0)
    # One thread hashes the blocks in order while this one writes; neither waits for the other.
    with ThreadPoolExecutor(1) as hashing:
        for offset, data in arrays:
            _hash_existing(file, offset - file.tell(), digest, hashing)
            view = data.data.cast("B")
            for begin in range(0, len(view), _BLOCK):
                block = view[begin : begin + _BLOCK]
                hashing.submit(digest.update, block)
                _write(file, block)
            _start_writeback(file, offset, len(view))
        _hash_existing(file, end - file.tell(), digest, hashing)
    _write(file, memoryview(format_seal(digest.hexdigest())))
    return FileChecksum(digest.hexdigest(), file.tell())


def _hash_existing(
    file: BinaryIO, size: int, digest: "hashlib._Hash", hashing: ThreadPoolExecutor
) -> None:
    """Hash the next bytes of the file, which are already written."""
    while size > 0:
        block = file.read(min(size, _BLOCK))
        if not block:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        hashing.submit(digest.update, block)
        size -= len(block)


def _start_writeback(file: BinaryIO, offset: int, size: int) -> None:
    """Start to write some bytes from the system's cache to disk, without waiting."""
    if hasattr(os, "posix_fadvise"):
        # With this advice the system starts to write the bytes that are not on disk yet.
        os.posix_fadvise(file.fileno(), offset, size, os.POSIX_FADV_DONTNEED)


def _write(file: BinaryIO, block: memoryview) -> None:
    while block:
        # On a nearly full disk one call writes only a part of a block, and the next call fails.
        block = block[file.write(block) :]
