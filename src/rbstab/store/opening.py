"""Reading HDF5 files that may be damaged, hostile, or written by other programs.

The program writes simple files: arrays of numbers or texts in one piece, without filters. Anything
else is refused before it is read. So reading never needs much more memory than the file has bytes.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
from numpy.typing import NDArray

from rbstab.store.disk.checked_reads import CheckedReads
from rbstab.store.disk.regular_file import open_regular
from rbstab.store.disk.text_heaps import Texts, find_texts
from rbstab.store.errors import NewerSchemaError, NotAResultError, StoreError
from rbstab.store.result import Variable

MAX_OBJECTS = 2000
"""The most arrays and groups of a file."""

MAX_ATTRIBUTES = 200
"""The most attributes of a file or an array."""

MAX_TEXT_BYTES = 16 << 20
"""The most bytes of all texts of an array, or of an attribute."""

PLAIN_NUMBERS = frozenset({"<f8", "<i8", "<i4", "|i1", "|u1"})
"""The types of numbers that the program writes: their bytes are those in memory."""

_TEXT = h5py.string_dtype("utf-8")

_TEXT_REFERENCE = np.dtype([("length", "<u4"), ("address", "<u8"), ("index", "<u4")])
"""HDF5 stores a text of any length as its length and its place in the file."""

_COMMON_NUMBERS = ((h5py.h5t.STD_I64LE, "<i8"), (h5py.h5t.IEEE_F64LE, "<f8"))
"""Types of attributes. To find the type of numpy for one of HDF5 takes longer than to compare."""


@dataclass(frozen=True)
class Hdf5Reader:
    """An open file.

    Args:
        path: The file.
        hdf5: The file, opened by h5py.
        raw: The same file as bytes.
        stored_texts: Where its texts are.

    Attributes:
        scale_names: The names of the scales of dimensions that were read already, by address.
        groups: The groups that were opened already, by name.
    """

    path: Path
    hdf5: h5py.File
    raw: BinaryIO
    stored_texts: Texts
    scale_names: dict[int, str] = field(default_factory=dict, init=False)
    groups: dict[str, h5py.Group] = field(default_factory=dict, init=False)

    @cached_property
    def base(self) -> int:
        """The byte from which HDF5 counts; zero in the files of rbstab."""
        found: int = self.hdf5.userblock_size
        return found

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
        version = self._attribute(self.hdf5, "schema_version")
        if not isinstance(version, int) or version < 1:
            raise NotAResultError(f"{self.path} is HDF5, but not a result of rbstab")
        if version > newest:
            raise NewerSchemaError(
                f"{self.path} was written by a newer rbstab (schema version {version}, this one "
                f"reads up to {newest}); update rbstab"
            )

    def attributes(self) -> dict[str, str | int | float]:
        """Return the attributes of the file, except the schema version.

        Raises:
            NotAResultError: An attribute is neither a number nor a text, or is too long.
        """
        if len(self.hdf5.attrs) > MAX_ATTRIBUTES:
            raise NotAResultError(f"{self.path} has more attributes than a result of rbstab")
        found = {}
        for name in self.hdf5.attrs:
            value = self._text(self.hdf5, name)
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
        if _is_text(dataset.dtype):
            data = self._texts(name, dataset.id)
        else:
            data = self._whole(dataset) if row is None else np.asarray(dataset[row])
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
        is_text = _is_text(dtype)
        if not is_text and dtype.kind not in "fiuS":
            raise NotAResultError(f"{self.path}: {name} holds neither numbers nor texts")
        if layout != h5py.h5d.CONTIGUOUS or plan.get_nfilters():
            raise NotAResultError(
                f"{self.path}: {name} is stored in chunks or with a filter, which rbstab never does"
            )
        size = math.prod(found.shape) * (_TEXT_REFERENCE if is_text else dtype).itemsize
        offset = found.get_offset()
        if size and (offset is None or offset + size > self.size):
            raise self._damaged(f"its array {name} is larger than the file")
        return h5py.Dataset(found)

    def _group(self, name: str) -> h5py.Group:
        """Return a group of the file; "" is the file."""
        if name not in self.groups:
            self.groups[name] = self.hdf5[name] if name else self.hdf5
        return self.groups[name]

    def _whole(self, dataset: h5py.Dataset) -> NDArray[Any]:
        """Read all of an array of numbers, as `dataset[()]` does, in a small part of the time."""
        found = dataset.id
        dtype, shape, offset = found.dtype, found.shape, found.get_offset()
        if offset is not None and dtype.str in PLAIN_NUMBERS:
            # It is in one piece, and within the file: `array` refuses all others.
            return self.numbers_at(offset, dtype, shape)
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
        is_plain = _is_text(dataset.dtype) or dataset.dtype.str in PLAIN_NUMBERS
        found: int | None = dataset.id.get_offset() if is_plain else None
        return found

    def numbers_at(self, offset: int, dtype: np.dtype[Any], shape: tuple[int, ...]) -> NDArray[Any]:
        """Read an array from a place in the file, whatever is there; HDF5 is not asked.

        Raises:
            NotAResultError: The file ends before.
        """
        data = np.empty(shape, dtype)
        self.raw.seek(offset)
        size = self.raw.readinto(data.reshape(-1).view("u1").data)  # type: ignore[attr-defined]
        if size != data.nbytes:
            raise self._damaged("it became shorter while it was read")
        return data

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
        unit, long_name = (self._text(dataset, key) for key in ("units", "long_name"))
        return str(unit or ""), str(long_name or "")

    def flags(self, dataset: h5py.Dataset) -> tuple[str, ...]:
        """Return the words for the values 0, 1, ... of an array of flags."""
        meanings = self._attribute(dataset, "flag_meanings")
        words = meanings.split(" ") if isinstance(meanings, str) else []
        return tuple(word.replace("_", " ") for word in words)

    def _texts(self, name: str, dataset: h5py.h5d.DatasetID) -> NDArray[Any]:
        shape, offset = dataset.shape, dataset.get_offset()
        if offset is None:  # `array` refuses all but an empty one
            return np.empty(shape, dtype=object)
        return self.texts_at(name, offset, shape)

    def texts_at(self, name: str, offset: int, shape: tuple[int, ...]) -> NDArray[Any]:
        """Read texts whose references are at a place in the file, whatever is there.

        Args:
            name: The name of the array, for messages.
            offset: The first byte of the references.
            shape: The shape of the array.

        Raises:
            NotAResultError: They lead to no text, or to more text than rbstab writes.
        """
        references = self.numbers_at(offset, _TEXT_REFERENCE, shape)
        # Many references may lead to one long text: so the lengths are added before it is read.
        total = references["length"].sum(dtype=np.int64)
        if total > MAX_TEXT_BYTES:
            raise NotAResultError(
                f"{self.path}: {name} has {total / 1e6:.3g} MB of text, more than rbstab writes"
            )
        texts = [self._text_at(*reference) for reference in references.ravel().tolist()]
        return np.array(texts, dtype=object).reshape(shape)

    def _text_at(self, length: int, address: int, index: int) -> str:
        if not length:
            return ""
        span = self.stored_texts.get((address + self.base, index))
        if span is None or length > span.size:
            raise self._damaged("it has a reference to a text that is not there")
        self.raw.seek(span.start)
        content = self.raw.read(length)
        # As in C, a text ends before its first zero.
        return content.partition(b"\0")[0].decode()

    def _text(self, owner: h5py.File | h5py.Dataset, name: str) -> str | int | float | None:
        """Return what `_attribute` does. A text takes less time: its type is not asked for."""
        of, key = owner.id, name.encode()
        if not h5py.h5a.exists(of, key):
            return None
        attribute, value = h5py.h5a.open(of, key), np.empty((), dtype=_TEXT)
        try:
            if attribute.get_storage_size() == _TEXT_REFERENCE.itemsize:
                attribute.read(value)
                found: str = value.item().decode("utf-8", "surrogateescape")
                return found
        except (OSError, RuntimeError, TypeError, ValueError):
            pass  # it has another type or shape, or no value
        return self._value(attribute)

    def _attribute(self, owner: h5py.File | h5py.Dataset, name: str) -> str | int | float | None:
        """Return an attribute; None if it is missing, or is neither a number nor a text."""
        of, key = owner.id, name.encode()
        return self._value(h5py.h5a.open(of, key)) if h5py.h5a.exists(of, key) else None

    @staticmethod
    def _value(attribute: h5py.h5a.AttrID) -> str | int | float | None:
        number = _common_number(attribute)
        if number is not None:
            return number
        dtype = attribute.dtype
        is_text = _is_text(dtype)
        if attribute.shape != () or not (is_text or dtype.kind in "fiu"):
            return None
        if attribute.get_storage_size() > MAX_TEXT_BYTES:
            return None
        value = np.zeros((), dtype=dtype)
        attribute.read(value)
        plain = value.item().decode("utf-8", "surrogateescape") if is_text else value.item()
        return plain if isinstance(plain, str | int | float) else None

    def _check_count(self, objects: int) -> None:
        if objects > MAX_OBJECTS:
            raise NotAResultError(f"{self.path} has more arrays than a result of rbstab")

    def _no_array(self, name: str) -> NotAResultError:
        return NotAResultError(f"{self.path}: {name} is not an array of this file")

    def _damaged(self, reason: str) -> NotAResultError:
        return NotAResultError(f"{self.path} is damaged: {reason}")


@contextmanager
def open_hdf5(path: Path) -> Iterator[Hdf5Reader]:
    """Return a context with an HDF5 file open for reading; all errors become store errors.

    HDF5 reads through a Python file object. So it needs no lock, which network file systems often
    do not have. Other programs and other parts of this process may have the file open too.

    Raises:
        NotAResultError: The file is damaged, or is not HDF5.
        StoreError: The file cannot be opened.
    """
    with _open_raw(path) as raw:
        checked = CheckedReads(raw)
        try:
            texts = find_texts(raw)
            if texts is None:
                raise NotAResultError(f"{path} is damaged: its texts are not as HDF5 stores them")
            with h5py.File(checked, "r") as file:
                yield Hdf5Reader(path, file, raw, texts)
            checked.raise_error()
        except Exception as error:
            # A file that cannot be read now may be whole, so a failed read is not called damage.
            raise _store_error(path, checked.error or error) from error


def _store_error(path: Path, error: Exception) -> StoreError:
    """Return the store error for an error of reading.

    h5py raises many kinds for files that are not as they should be. Their texts help no user: they
    name functions of HDF5.
    """
    if isinstance(error, StoreError):
        return error
    if isinstance(error, OSError):
        if error.errno is not None:
            return _unreadable(path, error)
        return NotAResultError(f"{path} is damaged or is not HDF5")
    if isinstance(error, MemoryError):
        return StoreError(f"{path} needs more memory than there is")
    return NotAResultError(f"{path} is damaged: HDF5 cannot read it")


def _unreadable(path: Path, error: OSError) -> StoreError:
    return StoreError(f"{path} cannot be read: {error.strerror or error}")


@contextmanager
def _open_raw(path: Path) -> Iterator[BinaryIO]:
    """Return a context with a file open for reading; an error of closing it is a store error."""
    file = open_regular(path)
    try:
        yield file
    finally:
        try:
            file.close()
        except OSError as error:
            raise _unreadable(path, error) from error


def _is_text(dtype: np.dtype[Any]) -> bool:
    found = h5py.check_string_dtype(dtype)
    return found is not None and found.length is None


def _common_number(attribute: h5py.h5a.AttrID) -> int | float | None:
    """Return an attribute that is one number of a type that rbstab writes; None for all others."""
    stored = attribute.get_type()
    for common, dtype in _COMMON_NUMBERS:
        if stored.equal(common):
            if attribute.get_space().get_simple_extent_type() != h5py.h5s.SCALAR:
                return None
            value = np.zeros((), dtype)
            attribute.read(value)
            number: int | float = value.item()
            return number
    return None


def _is_hard_link(parent: h5py.Group, name: str) -> bool:
    """Whether a name in a group leads to an object of the same file, and not by another name."""
    try:
        return bool(parent.id.links.get_info(name.encode()).type == h5py.h5l.TYPE_HARD)
    except KeyError:
        return False
