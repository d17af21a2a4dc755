"""Attributes of files and arrays: texts and numbers, one value each.

Low-level calls of h5py are used, because creating its objects takes most of the time of reading a
file.
"""

import h5py
import numpy as np

from rbstab.store.reading.types import MAX_TEXT_BYTES, TEXT, TEXT_REFERENCE, is_text

Attribute = str | int | float

COMMON_NUMBERS = ((h5py.h5t.STD_I64LE, "<i8"), (h5py.h5t.IEEE_F64LE, "<f8"))
"""Types of numbers that rbstab writes. To find the type of numpy for one of HDF5 takes longer than
to compare."""

TEXT_TYPE = "text"

KNOWN_TYPES = (TEXT_TYPE, *(dtype for _, dtype in COMMON_NUMBERS))


def attribute_of(owner: h5py.File | h5py.Dataset, name: str) -> Attribute | None:
    """Return an attribute; None if it is missing, or is neither one number nor one text."""
    found = _one_value(owner, name)
    return None if found is None else _value(found)


def text_of(owner: h5py.File | h5py.Dataset, name: str) -> Attribute | None:
    """Return what `attribute_of` does. A text takes less time: its type is not asked for."""
    found = _one_value(owner, name)
    if found is None:
        return None
    known = _read_text(found)
    return _value(found) if known is None else known


def attribute_of_type(owner: h5py.File | h5py.Dataset, name: str, known: str) -> Attribute | None:
    """Return an attribute read as one of `KNOWN_TYPES`; None if it cannot be.

    HDF5 converts numbers of other types, so the value may be wrong. Compare it with a digest.
    """
    found = _one_value(owner, name)
    if found is None:
        return None
    return _read_text(found) if known == TEXT_TYPE else _read_number(found, known)


def known_type(value: Attribute) -> str:
    """Return the type with which rbstab stores an attribute: one of `KNOWN_TYPES`."""
    return TEXT_TYPE if isinstance(value, str) else np.array(value).dtype.str


def _one_value(owner: h5py.File | h5py.Dataset, name: str) -> h5py.h5a.AttrID | None:
    """Return an attribute that is not an array; None for others, and if it is missing.

    HDF5 would write the further values of an array beyond the memory of the first.
    """
    of, key = owner.id, name.encode()
    if not h5py.h5a.exists(of, key):
        return None
    found = h5py.h5a.open(of, key)
    is_one = found.get_space().get_simple_extent_type() == h5py.h5s.SCALAR
    return found if is_one else None


def _read_text(found: h5py.h5a.AttrID) -> str | None:
    """Return an attribute that is a text of any length; None if it is not."""
    if found.get_storage_size() != TEXT_REFERENCE.itemsize:
        return None
    value = np.empty((), dtype=TEXT)
    try:
        found.read(value)
    except (KeyError, OSError, RuntimeError, TypeError, ValueError):
        return None
    content = value.item()
    # HDF5 has other types of this size: lists of any length.
    return content.decode("utf-8", "surrogateescape") if isinstance(content, bytes) else None


def _read_number(found: h5py.h5a.AttrID, dtype: str) -> int | float | None:
    value = np.zeros((), dtype)
    try:
        found.read(value)
    except (OSError, RuntimeError, TypeError, ValueError):
        return None
    number: int | float = value.item()
    return number


def _value(found: h5py.h5a.AttrID) -> Attribute | None:
    stored = found.get_type()
    for common, dtype in COMMON_NUMBERS:
        if stored.equal(common):
            return _read_number(found, dtype)
    dtype = found.dtype
    if not (is_text(dtype) or dtype.kind in "fiu") or found.get_storage_size() > MAX_TEXT_BYTES:
        return None
    value = np.zeros((), dtype=dtype)
    found.read(value)
    plain = value.item()
    plain = plain.decode("utf-8", "surrogateescape") if is_text(dtype) else plain
    return plain if isinstance(plain, Attribute) else None
