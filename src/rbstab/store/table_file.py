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
from rbstab.store.opening import check_version, get_array, open_hdf5, to_python
from rbstab.store.result import Variable
from rbstab.store.seal import check_seal, seal_file
from rbstab.store.table import (
    AXES,
    RUN,
    Arrays,
    Column,
    Table,
    TableDigest,
    TableHeader,
    attributes_of,
    check_shape,
    dimensions_of,
)

TABLE_VERSION = 1
"""The format version that this program writes, and the newest that it reads."""

TEXT = h5py.string_dtype("utf-8")

METADATA_BYTES = 1 << 20
"""Bytes reserved for the metadata of a file, far more than it needs."""

KIND = "sweep"
"""The attribute `kind` of these files."""

_FORMAT_ATTRIBUTES = ("schema_version", "kind")


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
        row_size = 8 + sum(column.size for column in header.layout.values())
        needed = header.length * row_size + METADATA_BYTES
        if shutil.disk_usage(path.parent).free < needed:
            # Checked first, because HDF5 may crash on a full disk.
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        with atomic_path(path, replace=True) as partial:
            with h5py.File(partial, "w-", track_order=True, locking=False) as file:
                _write(file, header, batches)
            seal_file(partial)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreError(f"{path} cannot be written: {reason}") from error


def read_table(path: Path, names: Iterable[str] | None = None) -> Table:
    """Read the table of a sweep.

    Args:
        path: The file.
        names: The columns to read; default all.

    Raises:
        NotAResultError: The file is damaged, or is not the table of a sweep.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened.
    """
    check_seal(path)
    with open_hdf5(path) as file:
        check_version(path, file, TABLE_VERSION)
        attributes = {name: to_python(value) for name, value in file.attrs.items()}
        if attributes.get("kind") != KIND:
            raise NotAResultError(f"{path} is a result, but not of a sweep")
        layout: dict[str, Column] = {}
        arrays: dict[str, Any] = {RUN: get_array(path, file, RUN)[()]}
        extras: dict[str, Variable] = {}
        for name in file:
            dataset = get_array(path, file, name)
            if dataset.is_scale:
                continue
            dimensions = tuple(str(axis[0].name).rpartition("/")[2] for axis in dataset.dims)
            if dimensions[:1] != (RUN,):
                extras[name] = _extra(dataset, dimensions)
            elif names is None or name in names:
                layout[name] = _column(dataset, dimensions)
                arrays[name] = dataset[()]
        others = {
            name: value for name, value in attributes.items() if name not in _FORMAT_ATTRIBUTES
        }
        return Table(layout, arrays, others, extras)


def _write(file: h5py.File, header: TableHeader, batches: Iterable[Arrays]) -> None:
    length = header.length
    _scale(file, RUN, np.arange(header.first, header.first + length), "number of the run")
    for dimension, size in dimensions_of(header.layout).items():
        _scale(file, dimension, np.arange(1, size + 1), "component of a vector")
    datasets = {name: _create(file, name, column, length) for name, column in header.layout.items()}
    digest, start = TableDigest(header.layout), 0
    for batch in batches:
        stop = start + len(next(iter(batch.values())))
        for name, dataset in datasets.items():
            # Otherwise HDF5 would silently broadcast a single number along an axis.
            check_shape(name, batch[name], (stop - start, *header.layout[name].shape))
            dataset[start:stop] = batch[name]
        digest.add(batch)
        start = stop
    assert start == length, f"{start} runs instead of {length}"
    for name, extra in header.extras.items():
        _write_extra(file, name, extra)
    format_attributes = {
        "schema_version": TABLE_VERSION,
        "kind": KIND,
        "arrays_digest": digest.result(),
    }
    for name, value in (dict(header.attributes) | format_attributes).items():
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


def _write_extra(file: h5py.File, name: str, extra: Variable) -> None:
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
    lengths = tuple(dataset.shape[1:])
    return Column(
        dimensions[1:],
        dataset.dtype.str.lstrip("<|=>"),
        str(attributes["units"]),
        str(attributes["long_name"]),
        flags if "flag_meanings" in attributes else (),
        () if all(length == AXES for length in lengths) else lengths,
    )


def _extra(dataset: h5py.Dataset, dimensions: tuple[str, ...]) -> Variable:
    is_text = h5py.check_string_dtype(dataset.dtype) is not None
    data = np.asarray(dataset.asstr()[()] if is_text else dataset[()])
    unit, long_name = (str(dataset.attrs[key]) for key in ("units", "long_name"))
    return Variable(dimensions, data, unit, long_name)
