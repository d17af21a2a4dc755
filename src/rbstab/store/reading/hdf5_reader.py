"""An open HDF5 file: its names, arrays and attributes."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from rbstab.store.errors import NewerSchemaError, NotAResultError
from rbstab.store.reading.attributes import Attribute, attribute_of, text_of
from rbstab.store.reading.raw_arrays import RawArrays
from rbstab.store.reading.types import PLAIN_NUMBERS, TEXT_REFERENCE, is_text
from rbstab.store.variables import Variable

MAX_OBJECTS = 2000
"""The most arrays and groups of a file."""

MAX_ATTRIBUTES = 200
"""The most attributes of a file or an array."""


@dataclass(frozen=True)
class Hdf5Reader:
    """An open file.

    Args:
        hdf5: The file, opened by h5py.
        raw_arrays: The same file as bytes.

    Attributes:
        scale_names: The names of the scales of dimensions that were read already, by address.
        groups: The groups that were opened already, by name.
    """

    hdf5: h5py.File
    raw_arrays: RawArrays
    scale_names: dict[int, str] = field(default_factory=dict, init=False)
    groups: dict[str, h5py.Group] = field(default_factory=dict, init=False)

    @property
    def path(self) -> Path:
        """The file."""
        return self.raw_arrays.path

    @cached_property
    def size(self) -> int:
        """The size of the file, bytes."""
        found: int = self.hdf5.id.get_filesize()
        return found

    def check_version(self, newest: int) -> None:
        """Refuse a file that is not a result of rbstab, or has a newer format.

        Raises:
            NotAResultError: The file has no schema version.
            NewerSchemaError: Its schema version is above `newest`.
        """
        version = attribute_of(self.hdf5, "schema_version")
        if not isinstance(version, int) or version < 1:
            raise NotAResultError(f"{self.path} is HDF5, but not a result of rbstab")
        if version > newest:
            raise NewerSchemaError(
                f"{self.path} was written by a newer rbstab (schema version {version}, this one "
                f"reads up to {newest}); update rbstab"
            )

    def attributes(self) -> dict[str, Attribute]:
        """Return the attributes of the file, except the schema version.

        Raises:
            NotAResultError: An attribute is neither a number nor a text, or is too long.
        """
        if len(self.hdf5.attrs) > MAX_ATTRIBUTES:
            raise NotAResultError(f"{self.path} has more attributes than a result of rbstab")
        found = {}
        for name in self.hdf5.attrs:
            value = text_of(self.hdf5, name)
            if value is None:
                raise self._damaged(f"its attribute {name} is neither a number nor a text")
            found[name] = value
        del found["schema_version"]
        return found

    def names(self) -> list[str]:
        """Return the names of all arrays; in a group they start with its name.

        Names of other objects are returned, too; reading them raises an error.

        Raises:
            NotAResultError: The file has too many objects.
        """
        self._check_count(len(self.hdf5))
        # Low-level calls, because creating h5py objects takes most of the time of reading a file.
        groups = {
            name: len(self.hdf5[name])
            for name in self.hdf5
            if _is_hard_link(self.hdf5, name)
            and h5py.h5o.get_info(self.hdf5.id, name.encode()).type == h5py.h5o.TYPE_GROUP
        }
        self._check_count(len(self.hdf5) + sum(groups.values()))
        in_groups = [f"{group}/{name}" for group in groups for name in self.hdf5[group]]
        return [name for name in self.hdf5 if not groups.get(name)] + in_groups

    def variable(self, name: str, row: int | None = None) -> Variable:
        """Read an array, with its dimensions, unit and meaning.

        Args:
            name: The name of the array.
            row: The only row to read; default all rows.

        Raises:
            NotAResultError: There is no such array, or it is not what rbstab writes.
        """
        dataset = self.array(name)
        if is_text(dataset.dtype):
            data = self._texts(name, dataset.id)
        else:
            data = self.whole(dataset) if row is None else np.asarray(dataset[row])
        return Variable(self._dimensions_of(dataset, name), data, *self.description(dataset))

    def array(self, name: str) -> h5py.Dataset:
        """Return an array without reading it; reading it is safe.

        Raises:
            NotAResultError: There is no such array, or it is not what rbstab writes.
        """
        group, _, short_name = name.rpartition("/")
        parent = self._group(group)
        # Low-level calls, because creating h5py objects takes most of the time of reading a file.
        found = None
        if _is_hard_link(parent, short_name):
            found = h5py.h5o.open(parent.id, short_name.encode())
        if not isinstance(found, h5py.h5d.DatasetID):
            raise self._no_array(name)
        plan = found.get_create_plist()
        layout = plan.get_layout()
        if layout == h5py.h5d.VIRTUAL or plan.get_external_count():
            # rbstab never writes links to other files, and does not follow them.
            raise self._no_array(name)
        dtype = found.dtype
        holds_texts = is_text(dtype)
        if not holds_texts and dtype.kind not in "fiuS":
            raise NotAResultError(f"{self.path}: {name} holds neither numbers nor texts")
        if layout != h5py.h5d.CONTIGUOUS or plan.get_nfilters():
            raise NotAResultError(
                f"{self.path}: {name} is stored in chunks or with a filter, which rbstab never does"
            )
        size = math.prod(found.shape) * (TEXT_REFERENCE if holds_texts else dtype).itemsize
        offset = found.get_offset()
        if size and (offset is None or offset + size > self.size):
            raise self._damaged(f"its array {name} is larger than the file")
        return h5py.Dataset(found)

    def _group(self, name: str) -> h5py.Group:
        """Return a group of the file; "" is the file."""
        if name not in self.groups:
            self.groups[name] = self.hdf5[name] if name else self.hdf5
        return self.groups[name]

    def whole(self, dataset: h5py.Dataset) -> NDArray[Any]:
        """Read all of an array of numbers that `array` returned.

        `dataset[()]` returns the same, and takes longer.
        """
        found = dataset.id
        dtype, shape, offset = found.dtype, found.shape, found.get_offset()
        if offset is not None and dtype.str in PLAIN_NUMBERS:
            # It is in one piece, and within the file: `array` refuses all others.
            return self.raw_arrays.numbers(offset, dtype, shape)
        data = np.empty(shape, dtype)
        if data.size:
            found.read(h5py.h5s.ALL, h5py.h5s.ALL, data)
        return data

    def offset(self, name: str) -> int | None:
        """Return the first byte of an array of text, or of `PLAIN_NUMBERS`; None if it has none.

        Raises:
            NotAResultError: There is no such array, or it is not what rbstab writes.
        """
        dataset = self.array(name)
        is_plain = is_text(dataset.dtype) or dataset.dtype.str in PLAIN_NUMBERS
        found: int | None = dataset.id.get_offset() if is_plain else None
        return found

    def dimensions(self, name: str) -> tuple[str, ...]:
        """Return the names of the dimensions of an array: the first scale of each axis."""
        return self._dimensions_of(self.hdf5[name], name)

    def _dimensions_of(self, dataset: h5py.Dataset, name: str) -> tuple[str, ...]:
        if h5py.h5ds.is_scale(dataset.id):
            return (name.rpartition("/")[2],)
        return tuple(self._scale_name(dataset.id, axis) for axis in range(dataset.id.rank))

    def _scale_name(self, dataset: h5py.h5d.DatasetID, axis: int) -> str:
        found: list[h5py.h5d.DatasetID] = []
        h5py.h5ds.iterate(dataset, axis, found.append)
        # HDF5 takes long to find the name of an object.
        address = h5py.h5o.get_info(found[0]).addr
        if address not in self.scale_names:
            name = h5py.h5i.get_name(found[0]).decode()
            self.scale_names[address] = name.rpartition("/")[2]
        return self.scale_names[address]

    def description(self, dataset: h5py.Dataset) -> tuple[str, str]:
        """Return the unit and the meaning of an array; "" if they are missing."""
        unit, long_name = (text_of(dataset, key) for key in ("units", "long_name"))
        return str(unit or ""), str(long_name or "")

    def flags(self, dataset: h5py.Dataset) -> tuple[str, ...]:
        """Return the words for the values 0, 1, ... of an array of flags."""
        meanings = attribute_of(dataset, "flag_meanings")
        words = meanings.split(" ") if isinstance(meanings, str) else []
        return tuple(word.replace("_", " ") for word in words)

    def _texts(self, name: str, dataset: h5py.h5d.DatasetID) -> NDArray[Any]:
        shape, offset = dataset.shape, dataset.get_offset()
        if offset is None:  # `array` refuses all but an empty one
            return np.empty(shape, dtype=object)
        return self.raw_arrays.texts(name, offset, shape)

    def _check_count(self, objects: int) -> None:
        if objects > MAX_OBJECTS:
            raise NotAResultError(f"{self.path} has more arrays than a result of rbstab")

    def _no_array(self, name: str) -> NotAResultError:
        return NotAResultError(f"{self.path}: {name} is not an array of this file")

    def _damaged(self, reason: str) -> NotAResultError:
        return NotAResultError(f"{self.path} is damaged: {reason}")


def _is_hard_link(parent: h5py.Group, name: str) -> bool:
    """Whether a name in a group leads to an object of the same file, and not by another name."""
    try:
        return bool(parent.id.links.get_info(name.encode()).type == h5py.h5l.TYPE_HARD)
    except KeyError:
        return False
