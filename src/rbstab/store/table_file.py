"""Reading tables of runs, which `table_writer` wrote."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from rbstab.store.digest import digest_of_table
from rbstab.store.disk.identity import Identity, identity_of, is_old
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.held_files import check_unchanged
from rbstab.store.reading.hdf5_reader import Hdf5Reader
from rbstab.store.reading.opening import open_hdf5
from rbstab.store.table import (
    AXES,
    RUN,
    Column,
    Layout,
    Table,
    TableDigest,
    TableHeader,
    check_column,
    check_columns,
)
from rbstab.store.table_writer import KIND, TABLE_VERSION
from rbstab.store.variables import Variable

ARRAYS_DIGEST = "arrays_digest"
"""The attribute with the digest of the columns."""

DIGEST = "digest"
"""The attribute with the digest of the whole table. Older files have none."""

_BLOCK = 1 << 20

_verified: set[Identity] = set()
"""The files that this process has compared with their digests."""


def read_table(path: Path, names: Iterable[str] | None = None) -> Table:
    """Read the table of a sweep. Its whole content is compared with its digests.

    Args:
        path: The file.
        names: The columns to read; default all.

    Raises:
        NotAResultError: The file is damaged, or is not the table of a sweep.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened.
    """
    identity = _identity(path)
    if identity not in _verified:
        check_unchanged(path)
    with open_hdf5(path) as file:
        header, digests = _header(file)
        if identity not in _verified:
            _check_digests(file, header, digests)
            if is_old(path.stat()):
                _verified.add(identity)
        wanted = [name for name in header.layout if names is None or name in names]
        layout = {name: header.layout[name] for name in wanted}
        arrays = {name: file.whole(file.array(name)) for name in (RUN, *wanted)}
        try:
            check_columns(layout, arrays)
        except ValueError as error:
            raise NotAResultError(f"{path} is damaged: {error}") from error
        return Table(layout, arrays, dict(header.attributes) | digests, header.extras)


class CheckedTable(NamedTuple):
    """A table whose content was checked.

    Attributes:
        layout: Its columns.
        identity: For `count_as_checked`; None if the file is so new that it may change unnoticed.
    """

    layout: Layout
    identity: Identity | None


def check_table(path: Path) -> CheckedTable:
    """Check the table of a sweep and all of its columns, one after the other, and keep none.

    Raises:
        NotAResultError, NewerSchemaError, StoreError: As `read_table`.
    """
    check_unchanged(path)
    with open_hdf5(path) as file:
        # Of the file that is read: another one may get its name meanwhile.
        found = os.fstat(file.raw_arrays.raw.fileno())
        header, digests = _header(file)
        _check_digests(file, header, digests)
        for name, column in header.layout.items():
            try:
                check_column(name, column, file.whole(file.array(name)), header.length)
            except ValueError as error:
                raise NotAResultError(f"{path} is damaged: {error}") from error
    return CheckedTable(header.layout, identity_of(found) if is_old(found) else None)


def count_as_checked(identity: Identity) -> None:
    """Do not compare a file with its digests again, because another process has done so."""
    _verified.add(identity)


def count_flags(path: Path, names: Iterable[str]) -> dict[str, dict[str, int]]:
    """Count the words of columns of flags; nothing else of the table is read.

    So the file is not compared with its digests: a list of many sweeps takes no time for that.

    Args:
        path: The file.
        names: The columns; those that the table lacks are left out.

    Returns:
        By column: how many runs have each word, without words that none has.

    Raises:
        NotAResultError: The file is not the table of a sweep, or such a column is damaged.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened.
    """
    with open_hdf5(path) as file:
        file.check_version(TABLE_VERSION)
        if file.attributes().get("kind") != KIND:
            raise NotAResultError(f"{path} is a result, but not of a sweep")
        present = set(file.names())
        return {name: _words(file, name) for name in names if name in present}


def _words(file: Hdf5Reader, name: str) -> dict[str, int]:
    dataset = file.array(name)
    words = file.flags(dataset)
    if dataset.dtype != np.dtype("i1") or dataset.ndim != 1:
        raise NotAResultError(f"{file.path} is damaged: {name} has a wrong type or shape")
    codes = dataset[()]
    if codes.size and not 0 <= codes.min() <= codes.max() < len(words):
        raise NotAResultError(f"{file.path} is damaged: {name} has a flag without a meaning")
    counts = np.bincount(codes, minlength=len(words)).tolist()
    return {word: count for word, count in zip(words, counts, strict=True) if count}


def _identity(path: Path) -> Identity:
    try:
        found = os.stat(path)  # noqa: PTH116
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
    return identity_of(found)


def _header(file: Hdf5Reader) -> tuple[TableHeader, dict[str, str]]:
    """Return the header of a table, and its digests by the names of their attributes."""
    path = file.path
    file.check_version(TABLE_VERSION)
    attributes = file.attributes()
    if attributes.pop("kind", None) != KIND:
        raise NotAResultError(f"{path} is a result, but not of a sweep")
    digests = {
        name: str(attributes.pop(name)) for name in (ARRAYS_DIGEST, DIGEST) if name in attributes
    }
    length = len(file.array(RUN))
    layout: dict[str, Column] = {}
    extras: dict[str, Variable] = {}
    for name in file.names():
        dataset = file.array(name)
        if dataset.is_scale:
            continue
        dimensions = file.dimensions(name)
        if dimensions[:1] != (RUN,):
            extras[name] = file.variable(name)
        elif dataset.shape[0] != length:
            raise NotAResultError(f"{path} is damaged: {name} has a wrong length")
        else:
            layout[name] = _column(file, dataset, dimensions)
    numbers = file.array(RUN)[()]
    if not length or not np.array_equal(numbers, numbers.flat[0] + np.arange(length)):
        raise NotAResultError(f"{path} is damaged: its runs are not numbered in order")
    return TableHeader(layout, int(numbers[0]), length, attributes, extras), digests


def _column(file: Hdf5Reader, dataset: h5py.Dataset, dimensions: tuple[str, ...]) -> Column:
    lengths = tuple(dataset.shape[1:])
    return Column(
        dimensions[1:],
        dataset.dtype.str.lstrip("<|=>"),
        *file.description(dataset),
        file.flags(dataset),
        () if all(length == AXES for length in lengths) else lengths,
    )


def _check_digests(file: Hdf5Reader, header: TableHeader, digests: dict[str, str]) -> None:
    """Compare the content of the file with its digests.

    Raises:
        NotAResultError: They differ.
    """
    found = TableDigest(header.layout)
    for name, column in header.layout.items():
        file.raw_arrays.raw.seek(file.array(name).id.get_offset())
        left = header.length * column.size
        while left > 0:
            block = file.raw_arrays.raw.read(min(_BLOCK, left))
            found.add(name, block)
            left -= len(block) or left
    arrays_digest = found.result()
    expected = {ARRAYS_DIGEST: arrays_digest, DIGEST: digest_of_table(header, arrays_digest)}
    if ARRAYS_DIGEST not in digests or any(expected[name] != digests[name] for name in digests):
        raise NotAResultError(
            f"{file.path} is damaged: its content does not match its digest. Run `rbstab gather` "
            "on its folder to make it again from the shards"
        )
