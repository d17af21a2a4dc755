"""One file for all results: named arrays and attributes in netCDF-4 compatible HDF5, sealed.

HDF5 lays a file out in memory (`hdf5_layout`): its own writes lose errors, and may end the process
on a full disk. The bytes are then written by `atomic_file`, and their digest is the seal. The index
in front of the seal says which array is where, so that rbstab itself reads a file without HDF5,
which may hang on a damaged file. `results/README.md` describes the files.
"""

import hashlib
import math
import os
import re
from _thread import start_new_thread
from collections.abc import Container, Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbstab.store.disk.atomic import atomic_file, write_all
from rbstab.store.disk.identity import Identity, identity_of, is_old
from rbstab.store.disk.regular_file import open_regular
from rbstab.store.disk.seal import (
    FORMAT,
    SEAL_SIZE,
    Sealed,
    check_seal,
    index_line,
    known_seal,
    read_seal,
    seal_line,
)
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.variables import (
    RUN,
    Variable,
    check_shape,
    coordinate_name,
    flag_attributes,
)

if TYPE_CHECKING:
    from rbstab.store.hdf5_layout import Layout

Attributes = Mapping[str, str | int | float]

_TYPES = re.compile(r"[<|][fiuS][1-9][0-9]{0,3}")
"""The types of arrays of numbers, and of short texts."""

_BLOCK = 1 << 20


class Dataset(NamedTuple):
    """The content of a file.

    Attributes:
        kind: What the file is, such as "the result of a run".
        variables: The arrays by name; in a group, the name begins with it: `certificate/verdict`.
        attributes: Texts and numbers by name.
        digest: The digest in the seal of the file that was read.
    """

    kind: str
    variables: Mapping[str, Variable]
    attributes: Attributes
    digest: str = ""


class Checksum(NamedTuple):
    """The digest in the seal of a file, and its size in bytes."""

    digest: str
    size: int


def write_dataset(path: Path, dataset: Dataset, *, replace: bool = False) -> Checksum:
    """Write a file: at any time it is absent, unchanged, or complete.

    Args:
        path: The file. Missing folders are created.
        dataset: Its content.
        replace: Whether an existing file is replaced.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        StoreError: The file cannot be written (full disk, no permission, ...).
    """
    from rbstab.store.hdf5_layout import meant_bytes  # imported late: many commands only read

    try:
        layout, arrays = _laid_out(dataset)
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_file(path, replace=replace) as file:
            return write_pieces(file, meant_bytes(layout, arrays), _index(dataset, layout))
    except FileExistsError as error:
        # mkdir raises this error if a file has the name of a folder.
        raise StoreError(f"{path} cannot be written: Not a directory") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreError(f"{path} cannot be written: {reason}") from error


def read_dataset(
    path: Path,
    kind: str,
    names: Iterable[str] | None = None,
    *,
    row: int | None = None,
    checked: bool = False,
) -> Dataset:
    """Read a file.

    Args:
        path: The file.
        kind: What it must be.
        names: The arrays along `run` to read, beside all others; default all.
        row: The only run to read; its arrays lose the dimension `run`. Default all runs.
        checked: Whether the file was compared with its seal before, or need not be.

    Raises:
        NotAResultError: The file is damaged, or is not of this kind.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be read.
    """
    with _opened(path) as file:
        end = known_seal(path, file) if checked else _checked(path, file)
        found = _content(path, file, end, None if names is None else set(names), row)
        if found.kind != kind:
            raise NotAResultError(f"{path} is {found.kind}, not {kind}")
        return found


def _checked(path: Path, file: BinaryIO) -> Sealed:
    """Compare a file with its seal, but only once if it cannot change unnoticed."""
    found = os.fstat(file.fileno())
    identity = identity_of(found)
    if identity in _unchanged:
        return known_seal(path, file)
    end = check_seal(path, file)
    if is_old(found):
        _unchanged.add(identity)
    return end


_unchanged: set[Identity] = set()
"""The files that this process has compared with their seals."""


def checksum_of(path: Path, *, check: bool = False) -> Checksum:
    """Return the digest in the seal of a file, and its size.

    Args:
        path: The file.
        check: Whether the whole file is read and compared with its seal.

    Raises:
        NotAResultError, NewerSchemaError, StoreError: As `read_dataset`.
    """
    with _opened(path) as file:
        digest = _checked(path, file).digest if check else read_seal(path, file)
        return Checksum(digest, file.seek(0, 2))


@contextmanager
def _opened(path: Path) -> Iterator[BinaryIO]:
    """Return a context with a file open for reading; its errors become store errors."""
    try:
        with open_regular(path) as file:
            yield file
    except MemoryError as error:
        raise StoreError(f"{path} needs more memory than there is") from error
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error


def write_pieces(
    file: BinaryIO, content: Iterable[memoryview], index: Mapping[str, Any]
) -> Checksum:
    """Write the bytes of a file in ascending order, then its index and its seal."""
    size = 0
    # One thread hashes the blocks in order while this one writes; neither waits for the other. It
    # shares no lock of Python with this one: an interrupt may leave such a lock held for ever.
    blocks: SimpleQueue[memoryview | None] = SimpleQueue()
    found: SimpleQueue[str] = SimpleQueue()
    start_new_thread(_hash, (blocks, found))
    try:
        for piece in chain(content, [memoryview(index_line(index))]):
            for begin in range(0, len(piece), _BLOCK):
                block = piece[begin : begin + _BLOCK]
                blocks.put(block)
                write_all(file, block)
            _start_writeback(file, size, len(piece))
            size += len(piece)
    finally:
        blocks.put(None)
    digest = found.get()
    write_all(file, seal_line(digest))
    return Checksum(digest, size + SEAL_SIZE)


def _hash(blocks: "SimpleQueue[memoryview | None]", found: "SimpleQueue[str]") -> None:
    digest = hashlib.sha256()
    while (block := blocks.get()) is not None:
        digest.update(block)
    found.put(digest.hexdigest())


def _start_writeback(file: BinaryIO, offset: int, size: int) -> None:
    """Start to write some bytes from the system's cache to disk, without waiting."""
    if hasattr(os, "posix_fadvise"):
        # With this advice the system starts to write the bytes that are not on disk yet.
        os.posix_fadvise(file.fileno(), offset, size, os.POSIX_FADV_DONTNEED)


_last: "dict[str, Layout]" = {}
"""The last layout, by all that determines it: the files of a sweep differ only in their numbers,
and to lay one out takes longer than to write it."""


def _laid_out(dataset: Dataset) -> "tuple[Layout, dict[str, NDArray[Any]]]":
    """Return the layout of a file, and its arrays of numbers in the byte order of the file."""
    variables = dataset.variables.items()
    described = [
        (name, v.dimensions, v.data.shape, v.data.dtype.str, *v[2:]) for name, v in variables
    ]
    texts = [v.data.tolist() for _, v in variables if v.is_text]
    # As a text: the numbers 1 and 1.0 are equal, but are stored differently.
    key = repr((dataset.kind, list(dataset.attributes.items()), described, texts))
    layout = _last.get(key)
    if layout is None:
        layout = _new_layout(dataset)
        _last.clear()  # several threads may write
        _last[key] = layout
    return layout, {name: _in_file(v.data) for name, v in variables if not v.is_text}


def _in_file(data: NDArray[Any]) -> NDArray[Any]:
    return data.astype(data.dtype.newbyteorder("<"), copy=False)


def _new_layout(dataset: Dataset) -> "Layout":
    from rbstab.store.hdf5_layout import TEXT, Layout

    scales, layout = _scales(dataset), Layout()
    with layout.file() as file:
        for group in dict.fromkeys(name.rpartition("/")[0] for name in dataset.variables):
            if group:
                file.create_group(group, track_order=True)
        # The scales come first, because netCDF readers number dimensions in this order.
        for name, v in {**scales, **dataset.variables}.items():
            if v.is_text:
                data = v.data.astype(object)
                added = file.create_dataset(name, data=data, dtype=TEXT, track_order=True)
            elif name in dataset.variables:
                added = layout.reserve(file, name, v.data.shape, _in_file(v.data).dtype)
            else:
                added = file.create_dataset(name, data=v.data, track_order=True)
            added.attrs.update({"units": v.unit, "long_name": v.long_name})
            if v.flags:
                added.attrs.update(flag_attributes(v.flags, v.data.dtype))
            if name in scales:
                added.make_scale(name.rpartition("/")[2])
                continue
            for axis, dimension in enumerate(v.dimensions):
                added.dims[axis].attach_scale(file[coordinate_name(name, dimension)])
        file.attrs.update({**dataset.attributes, "format": FORMAT, "kind": dataset.kind})
    return layout


def _scales(dataset: Dataset) -> dict[str, Variable]:
    """Return the coordinates of all dimensions; where there is none, the numbers of the entries.

    Raises:
        ValueError: An array has another shape than its coordinates.
    """
    found: dict[str, Variable] = {}
    for name, v in dataset.variables.items():
        if len(v.dimensions) != v.data.ndim:
            raise ValueError(f"{name} has {v.data.ndim} dimensions (expected {len(v.dimensions)})")
        for dimension, length in zip(v.dimensions, v.data.shape, strict=True):
            scale = coordinate_name(name, dimension)
            numbers = Variable(
                (dimension,), np.arange(1, length + 1), "1", f"number of the {dimension}"
            )
            found.setdefault(scale, dataset.variables.get(scale, numbers))
    for name, v in dataset.variables.items():
        lengths = (len(found[coordinate_name(name, one)].data) for one in v.dimensions)
        check_shape(name, v.data, tuple(lengths))
    return found


def _index(dataset: Dataset, layout: "Layout") -> dict[str, Any]:
    """Return what a file contains, and where."""
    arrays = {}
    for name, v in dataset.variables.items():
        entry: dict[str, Any] = {"dimensions": v.dimensions, "shape": v.data.shape}
        entry |= {"unit": v.unit, "long_name": v.long_name, "flags": v.flags}
        if v.is_text:
            entry["texts"] = v.data.ravel().tolist()
        else:
            entry |= {"type": _in_file(v.data).dtype.str, "offset": layout.offset(name)}
        arrays[name] = entry
    return {"kind": dataset.kind, "attributes": dict(dataset.attributes), "arrays": arrays}


def _content(
    path: Path, file: BinaryIO, end: Sealed, names: Container[str] | None, row: int | None
) -> Dataset:
    """Read what an index says."""
    try:
        kind, attributes, arrays = (end.facts[key] for key in ("kind", "attributes", "arrays"))
        if not all(isinstance(value, str | int | float) for value in attributes.values()):
            raise TypeError("an attribute is no text and no number")
        variables = {
            str(name): _variable(file, end.size, entry, row)
            for name, entry in arrays.items()
            if names is None or name in names or entry["dimensions"][:1] != [RUN] or name == RUN
        }
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise NotAResultError(f"{path} is damaged: its index is wrong ({error})") from error
    return Dataset(str(kind), variables, attributes, end.digest)


def _variable(file: BinaryIO, size: int, entry: Mapping[str, Any], row: int | None) -> Variable:
    """Read an array."""
    dimensions, shape = tuple(map(str, entry["dimensions"])), tuple(map(int, entry["shape"]))
    described = str(entry["unit"]), str(entry["long_name"]), tuple(map(str, entry["flags"]))
    if "texts" in entry:
        texts = np.empty(len(entry["texts"]), dtype=object)
        texts[:] = list(map(str, entry["texts"]))
        return Variable(dimensions, texts.reshape(shape), *described)
    if not _TYPES.fullmatch(entry["type"]):
        raise ValueError(f"it has the type {entry['type'][:20]!r}")
    dtype, offset = np.dtype(entry["type"]), int(entry["offset"])
    if offset < 0 or min(shape, default=0) < 0 or offset + math.prod(shape) * dtype.itemsize > size:
        raise ValueError("an array is larger than the file")
    if row is not None and dimensions[:1] == (RUN,):
        dimensions, shape = dimensions[1:], shape[1:]
        offset += row * math.prod(shape) * dtype.itemsize
    data = np.empty(shape, dtype)
    file.seek(offset)
    if file.readinto(data.reshape(-1).view("u1").data) != data.nbytes:  # type: ignore[attr-defined]
        raise ValueError("it became shorter while it was read")
    return Variable(dimensions, data, *described)
