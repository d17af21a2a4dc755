"""Tables of runs in netCDF-4 compatible HDF5, described in `results/README.md`."""

import errno
import os
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from rbstab.store.atomic import atomic_path
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.opening import array_of, check_version, opened, plain
from rbstab.store.result import Variable
from rbstab.store.seal import check_seal, seal
from rbstab.store.table import AXES, RUN, Arrays, Column, Head, Table, TableDigest, attributes_of

TABLE_VERSION = 1
"""The version of the format that this program writes, and the newest that it reads."""

TEXT = h5py.string_dtype("utf-8")

ROOM = 1 << 20
"""Bytes that a file needs beside its columns; far more than it does."""

KIND = "sweep"
"""What such a file says that it is."""

_OWN = ("schema_version", "kind")


def write_table(path: Path, head: Head, parts: Iterable[Arrays]) -> None:
    """Writes runs part by part; the file appears whole or not at all.

    Args:
        path: The file; it is replaced, and its folder must exist.
        head: All but the data of the columns.
        parts: These; only one part is in memory at a time.

    Raises:
        StoreError: The operating system refused, or a part cannot be read.
    """
    try:
        needed = head.length * (8 + sum(column.size for column in head.layout.values())) + ROOM
        if shutil.disk_usage(path.parent).free < needed:
            # Before HDF5 meets it, which does not always survive that.
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        with atomic_path(path, replace=True) as partial:
            with h5py.File(partial, "w-", track_order=True, locking=False) as file:
                _write(file, head, parts)
            seal(partial)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def read_table(path: Path, names: Iterable[str] | None = None) -> Table:
    """Reads a sweep.

    Args:
        path: The file.
        names: The columns that are wanted; default all.

    Raises:
        NotAResultError: It is damaged, or no such file.
        NewerSchemaError: It was written by a newer rbstab.
        StoreError: It cannot be opened.
    """
    check_seal(path)
    with opened(path) as file:
        check_version(path, file, TABLE_VERSION)
        attributes = {name: plain(value) for name, value in file.attrs.items()}
        if attributes.get("kind") != KIND:
            raise NotAResultError(f"{path} is a result, but of no sweep")
        layout: dict[str, Column] = {}
        arrays: dict[str, Any] = {RUN: array_of(path, file, RUN)[()]}
        extras: dict[str, Variable] = {}
        for name in file:
            dataset = array_of(path, file, name)
            if dataset.is_scale:
                continue
            dimensions = tuple(str(axis[0].name).rpartition("/")[2] for axis in dataset.dims)
            if dimensions[:1] != (RUN,):
                extras[name] = _extra(dataset, dimensions)
            elif names is None or name in names:
                layout[name] = _column(dataset, dimensions)
                arrays[name] = dataset[()]
        kept = {name: value for name, value in attributes.items() if name not in _OWN}
        return Table(layout, arrays, kept, extras)


def _write(file: h5py.File, head: Head, parts: Iterable[Arrays]) -> None:
    length = head.length
    _scale(file, RUN, np.arange(head.first, head.first + length), "number of the run")
    _scale(file, "axis", np.arange(1, AXES + 1), "component of a vector")
    datasets = {name: _create(file, name, column, length) for name, column in head.layout.items()}
    digest, at = TableDigest(head.layout), 0
    for part in parts:
        stop = at + len(next(iter(part.values())))
        for name, dataset in datasets.items():
            dataset[at:stop] = part[name]
        digest.add(part)
        at = stop
    assert at == length, f"{at} runs where {length} were promised"
    for name, extra in head.extras.items():
        _put_extra(file, name, extra)
    own = {"schema_version": TABLE_VERSION, "kind": KIND, "arrays_digest": digest.result()}
    for name, value in (dict(head.attributes) | own).items():
        file.attrs[name] = value


def _scale(file: h5py.File, name: str, data: Any, long_name: str) -> None:
    dataset = file.create_dataset(name, data=data, track_order=True)
    dataset.attrs["units"] = "1"
    dataset.attrs["long_name"] = long_name
    dataset.make_scale(name)


def _create(file: h5py.File, name: str, column: Column, length: int) -> h5py.Dataset:
    shape = (length, *column.shape)
    dataset = file.create_dataset(name, shape, dtype=column.dtype, track_order=True)
    for key, value in attributes_of(column).items():
        dataset.attrs[key] = value
    for index, dimension in enumerate((RUN, *column.dimensions)):
        dataset.dims[index].attach_scale(file[dimension])
    return dataset


def _put_extra(file: h5py.File, name: str, extra: Variable) -> None:
    is_text = extra.data.dtype.kind in "OUT"
    data = extra.data.astype(object) if is_text else extra.data
    dataset = file.create_dataset(
        name, data=data, dtype=TEXT if is_text else None, track_order=True
    )
    dataset.attrs["units"] = extra.unit
    dataset.attrs["long_name"] = extra.long_name
    for index, dimension in enumerate(extra.dimensions):
        if dimension not in file:
            _scale(file, dimension, np.arange(1, len(data) + 1), f"number of the {dimension}")
        dataset.dims[index].attach_scale(file[dimension])


def _column(dataset: h5py.Dataset, dimensions: tuple[str, ...]) -> Column:
    attributes = dataset.attrs
    meanings = str(attributes.get("flag_meanings", ""))
    flags = tuple(word.replace("_", " ") for word in meanings.split(" "))
    return Column(
        dimensions[1:],
        dataset.dtype.str.lstrip("<|=>"),
        str(attributes["units"]),
        str(attributes["long_name"]),
        flags if "flag_meanings" in attributes else (),
    )


def _extra(dataset: h5py.Dataset, dimensions: tuple[str, ...]) -> Variable:
    is_text = h5py.check_string_dtype(dataset.dtype) is not None
    data = np.asarray(dataset.asstr()[()] if is_text else dataset[()])
    unit, long_name = (str(dataset.attrs[key]) for key in ("units", "long_name"))
    return Variable(dimensions, data, unit, long_name)
