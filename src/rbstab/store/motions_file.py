"""Files of motions: netCDF-4 compatible HDF5, described in `results/README.md`.

They are large and many. So a file is laid out by HDF5, which writes nothing but what describes the
arrays, and their data go straight to their places, block by block, each block hashed while it is
written: nothing is copied, nothing is read again, no other thread waits for HDF5, the disk begins
before the last block is there, and a disk that is full is an error of ours and not one inside HDF5.
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
from rbstab.store.motions import COORDINATES, Motions
from rbstab.store.opening import array_of, check_version, opened, plain
from rbstab.store.presence import path_exists
from rbstab.store.result import Variable
from rbstab.store.seal import check_seal, seal_line, stated_seal
from rbstab.store.table import RUN

MOTIONS_VERSION = 1
"""The version of the format that this program writes, and the newest that it reads."""

KIND = "traces"

ROOM = 1 << 16
"""Bytes that a file needs beside its arrays; far more than it does."""

_BLOCK = 1 << 20

_OWN = ("schema_version", "kind")


class Stamp(NamedTuple):
    """What a file of motions is known by: its SHA-256, as in its seal, and its size in bytes."""

    digest: str
    size: int


def write_motions(path: Path, motions: Motions) -> Stamp:
    """Writes motions in place of what stood there; the file appears whole or not at all.

    Args:
        path: The file; its folder must exist.
        motions: Arrays of floats along run, time and axis, and these coordinates.

    Raises:
        StoreError: The operating system refused.
    """
    try:
        size = sum(variable.data.nbytes for variable in motions.variables.values())
        if shutil.disk_usage(path.parent).free < size + ROOM:
            # Before HDF5 meets it, which does not always survive that.
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        with atomic_path(path, replace=True) as partial:
            places = _laid_out(partial, motions)
            with partial.open("r+b", buffering=0) as file:
                return _filled(file, places)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def stamp_of(path: Path) -> Stamp | None:
    """What a file says to be, by its end and its size alone: it is not read.

    None where it is absent, or does not end as one that was written to its end.

    Raises:
        StoreError: It cannot be read.
    """
    if not path_exists(path):
        return None
    digest = stated_seal(path)
    return Stamp(digest, path.stat().st_size) if digest is not None else None


def check_motions(path: Path, stamp: Stamp) -> None:
    """Reads a whole file of motions, and makes sure that it is the one that was written.

    Raises:
        NotAResultError: It is damaged, or another one.
        StoreError: It cannot be read.
    """
    check_seal(path)
    if stamp_of(path) != stamp:
        raise NotAResultError(f"{path} is damaged: it is not what was written (by its digest)")


def read_motions(path: Path, row: int | None = None) -> Motions:
    """Reads motions, without a look at the seal.

    Args:
        path: The file.
        row: Where the one run stands that is wanted; default all runs.

    Raises:
        NotAResultError: It is damaged, or no such file.
        NewerSchemaError: It was written by a newer rbstab.
        StoreError: It cannot be opened.
    """
    with opened(path) as file:
        check_version(path, file, MOTIONS_VERSION)
        attributes = {name: plain(value) for name, value in file.attrs.items()}
        if attributes.get("kind") != KIND:
            raise NotAResultError(f"{path} is a result, but has no traces")
        variables = {name: _variable(array_of(path, file, name), name, row) for name in file}
    kept = {name: value for name, value in attributes.items() if name not in _OWN}
    return Motions(variables, kept)


def _variable(dataset: h5py.Dataset, name: str, row: int | None) -> Variable:
    own = [str(axis[0].name).rpartition("/")[2] for axis in dataset.dims if len(axis)]
    dimensions = (name,) if dataset.is_scale else tuple(own)
    chosen = row is not None and dimensions[0] == RUN
    unit, long_name = (str(dataset.attrs[key]) for key in ("units", "long_name"))
    data = np.asarray(dataset[row] if chosen else dataset[()])
    return Variable(dimensions[1:] if chosen else dimensions, data, unit, long_name)


def _laid_out(path: Path, motions: Motions) -> list[tuple[int, NDArray[np.float64]]]:
    """Writes the file without the data of its arrays; returns their places, and what belongs."""
    places = []
    with h5py.File(path, "w-", track_order=True, locking=False) as file:
        for name in COORDINATES:
            variable = motions.variables[name]
            scale = file.create_dataset(name, data=variable.data, track_order=True)
            _describe(scale, variable)
            scale.make_scale(name)
        for name, variable in _data_of(motions.variables):
            data = np.ascontiguousarray(variable.data, dtype="<f8")
            dataset = _reserved(file, name, data.shape)
            _describe(dataset, variable)
            for index, dimension in enumerate(variable.dimensions):
                dataset.dims[index].attach_scale(file[dimension])
            places.append((dataset.id.get_offset(), data))
        own = {"schema_version": MOTIONS_VERSION, "kind": KIND}
        for name, value in (dict(motions.attributes) | own).items():
            file.attrs[name] = value
    return sorted(places, key=lambda place: place[0])


def _data_of(variables: Mapping[str, Variable]) -> Iterator[tuple[str, Variable]]:
    return ((name, v) for name, v in variables.items() if name not in COORDINATES)


def _reserved(file: h5py.File, name: str, shape: tuple[int, ...]) -> h5py.Dataset:
    """An array that has its place in the file, where nothing is written."""
    how = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    how.set_layout(h5py.h5d.CONTIGUOUS)
    how.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    how.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    how.set_obj_track_times(False)
    how.set_attr_creation_order(h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED)
    space = h5py.h5s.create_simple(shape)
    return h5py.Dataset(h5py.h5d.create(file.id, name.encode(), h5py.h5t.IEEE_F64LE, space, how))


def _describe(dataset: h5py.Dataset, variable: Variable) -> None:
    dataset.attrs["units"] = variable.unit
    dataset.attrs["long_name"] = variable.long_name


def _filled(file: BinaryIO, places: list[tuple[int, NDArray[np.float64]]]) -> Stamp:
    """Puts data into their places, ascending, and the seal behind all, in one pass."""
    digest, end = hashlib.sha256(), file.seek(0, 2)
    file.seek(0)
    # One thread takes the blocks in their order; neither a hash nor a write holds up the other.
    with ThreadPoolExecutor(1) as hashing:
        for offset, data in places:
            _hash(file, offset - file.tell(), digest, hashing)
            view = data.data.cast("B")
            for begin in range(0, len(view), _BLOCK):
                block = view[begin : begin + _BLOCK]
                hashing.submit(digest.update, block)
                _write(file, block)
            _begin_to_store(file, offset, len(view))
        _hash(file, end - file.tell(), digest, hashing)
    _write(file, memoryview(seal_line(digest.hexdigest())))
    return Stamp(digest.hexdigest(), file.tell())


def _hash(file: BinaryIO, size: int, digest: "hashlib._Hash", hashing: ThreadPoolExecutor) -> None:
    """Takes the next bytes, which stand there already."""
    while size > 0:
        block = file.read(min(size, _BLOCK))
        if not block:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        hashing.submit(digest.update, block)
        size -= len(block)


def _begin_to_store(file: BinaryIO, offset: int, size: int) -> None:
    """Lets the system begin to put bytes onto the disk; at the end it is waited for as ever."""
    if hasattr(os, "posix_fadvise"):
        # What this advice does to bytes that are not stored yet.
        os.posix_fadvise(file.fileno(), offset, size, os.POSIX_FADV_DONTNEED)


def _write(file: BinaryIO, block: memoryview) -> None:
    while block:
        # A disk that is nearly full takes a part first, and refuses the rest.
        block = block[file.write(block) :]
