"""One file for all results: a dataset in netCDF-4 compatible HDF5, sealed.

HDF5 lays a file out in memory (`hdf5_layout`): its own writes lose errors, and may end the process
on a full disk. The bytes are then written by `atomic_file`, and their digest is the seal. The index
in front of the seal says which array is where, so that rbstab itself reads a file without HDF5,
which may hang on a damaged file. `results/README.md` describes the files.
"""

import math
import re
from collections.abc import Container, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple, TypeVar

import numpy as np

from rbstab.store.dataset import Dataset
from rbstab.store.disk.atomic import atomic_file
from rbstab.store.disk.paths import opened, store_errors
from rbstab.store.disk.seal import FORMAT, checked_seal, read_index, read_seal, write_sealed
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.variables import RUN, Variable

if TYPE_CHECKING:
    from rbstab.store.hdf5_layout import Layout

_TYPES = re.compile(r"[<|][fiuS][1-9][0-9]{0,3}")
"""The types of arrays of numbers, and of short texts."""

D = TypeVar("D", bound=Dataset)


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
    with store_errors(path, "written"):
        layout, arrays = _laid_out(dataset)
        content = (
            memoryview(piece) if isinstance(piece, bytes) else _bytes_of(arrays[piece])
            for piece in layout.pieces
        )
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except FileExistsError as error:  # a file has the name of a folder
            raise StoreError(f"{path} cannot be written: Not a directory") from error
        with atomic_file(path, replace=replace) as file:
            return Checksum(*write_sealed(file, content, _index(dataset, arrays, layout)))


def _bytes_of(variable: Variable) -> memoryview:
    return np.ascontiguousarray(variable.data).reshape(-1).view(np.uint8).data


_last: "dict[str, Layout]" = {}
"""The last layout, by all that determines it: the files of a sweep differ only in their numbers,
and to lay one out takes longer than to write it."""


def _laid_out(dataset: Dataset) -> "tuple[Layout, dict[str, Variable]]":
    """Return the layout of a file, and its arrays in the byte order of the file."""
    from rbstab.store.hdf5_layout import layout_of  # imported late: many commands only read

    arrays = {
        name: v
        if v.is_text
        else v._replace(data=v.data.astype(v.data.dtype.newbyteorder("<"), copy=False))
        for name, v in dataset.variables.items()
    }
    described = [
        (name, v.dimensions, v.data.shape, v.data.dtype.str, *v[2:]) for name, v in arrays.items()
    ]
    texts = [v.data.tolist() for v in arrays.values() if v.is_text]
    # As a text: the numbers 1 and 1.0 are equal, but are stored differently.
    key = repr((dataset.kind, list(dataset.attributes.items()), described, texts))
    layout = _last.get(key)
    if layout is None:
        layout = layout_of(Dataset(arrays, dataset.attributes, kind=dataset.kind), FORMAT)
        _last.clear()  # several threads may write
        _last[key] = layout
    return layout, arrays


def _index(dataset: Dataset, arrays: Mapping[str, Variable], layout: "Layout") -> dict[str, Any]:
    """Return what a file contains, and where."""
    entries = {}
    for name, v in arrays.items():
        entry: dict[str, Any] = {"dimensions": v.dimensions, "shape": v.data.shape}
        entry |= {"unit": v.unit, "long_name": v.long_name, "flags": v.flags}
        if v.is_text:
            entry["texts"] = v.data.ravel().tolist()
        else:
            entry |= {"type": v.data.dtype.str, "offset": layout.offsets[name]}
        entries[name] = entry
    return {"kind": dataset.kind, "attributes": dict(dataset.attributes), "arrays": entries}


def read_dataset(
    path: Path,
    kind: str,
    names: Iterable[str] | None = None,
    *,
    row: int | None = None,
    form: type[D] = Dataset,  # type: ignore[assignment]
) -> D:
    """Read a file.

    Args:
        path: The file.
        kind: What it must be.
        names: The arrays along `run` to read, beside all others; default all.
        row: The only run to read; its arrays lose the dimension `run`. Default all runs.
        form: The class of the dataset.

    Raises:
        NotAResultError: The file is damaged, or is not of this kind.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be read.
    """
    wanted = None if names is None else set(names)
    with opened(path) as file:
        digest = checked_seal(path, file)
        index, size = read_index(path, file)
        try:
            stored_kind, attributes, arrays = (
                index[key] for key in ("kind", "attributes", "arrays")
            )
            if not all(isinstance(value, str | int | float) for value in attributes.values()):
                raise TypeError("an attribute is no text and no number")
            variables = {
                str(name): _variable(file, size, entry, row)
                for name, entry in arrays.items()
                if _is_wanted(name, entry, wanted)
            }
        except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
            raise NotAResultError(f"{path} is damaged: its index is wrong ({error})") from error
    if stored_kind != kind:
        raise NotAResultError(f"{path} is {stored_kind}, not {kind}")
    return form(variables, attributes, kind=kind, digest=digest)


def _is_wanted(name: str, entry: Mapping[str, Any], names: Container[str] | None) -> bool:
    return names is None or name in names or name == RUN or entry["dimensions"][:1] != [RUN]


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


def checksum_of(path: Path, *, check: bool = False) -> Checksum:
    """Return the digest in the seal of a file, and its size.

    Args:
        path: The file.
        check: Whether the whole file is read and compared with its seal.

    Raises:
        NotAResultError, NewerSchemaError, StoreError: As `read_dataset`.
    """
    with opened(path) as file:
        digest = checked_seal(path, file) if check else read_seal(path, file)
        return Checksum(digest, file.seek(0, 2))
