"""Places of arrays in files that were read before, tried in the next file of the same size.

rbstab writes runs of one kind alike: their arrays are in the same places, with the same names,
types, dimensions, units and meanings, and so are their attributes. To find all this out takes HDF5
most of the time. So it is taken from a file of the same size that was read before. The digest of a
result covers all of it, and the numbers: it shows that what was read is right. It does not show
that HDF5 would find these arrays. So only files with a seal are read in this way, and only in
processes that read many files and call `use_known_places`: what other commands say of a file does
not depend on those that were read before.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rbstab.store.errors import NotAResultError
from rbstab.store.reading.attributes import KNOWN_TYPES, Attribute, attribute_of_type, known_type
from rbstab.store.reading.hdf5_reader import Hdf5Reader
from rbstab.store.variables import Variable

MAX_SIZES = 256
"""The most sizes of files that are remembered."""


class Content(NamedTuple):
    """The attributes and the arrays of a file."""

    attributes: dict[str, Attribute]
    variables: dict[str, Variable]


class _Place(NamedTuple):
    """An array without its content; offset is its first byte."""

    dimensions: tuple[str, ...]
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    unit: str
    long_name: str
    offset: int


class _Layout(NamedTuple):
    """A file without its content: the types of its attributes, and its arrays."""

    attributes: dict[str, str]
    arrays: dict[str, _Place]


_known: dict[int, _Layout] | None = None
"""The files that were read, by size; None in a process that does not use known places."""


def use_known_places() -> None:
    """Let this process try the places of arrays of earlier files from now on."""
    global _known  # noqa: PLW0603 (a fact about the process)
    _known = {} if _known is None else _known


def content_at_known_places(file: Hdf5Reader) -> Content | None:
    """Return the content of a file as if it were like another one of its size; None without one.

    Args:
        file: A file as rbstab wrote it. The result may be wrong: compare it with its digest.
    """
    layout = None if _known is None else _known.get(file.size)
    if layout is None:
        return None
    attributes = {}
    for name, dtype in layout.attributes.items():
        value = attribute_of_type(file.hdf5, name, dtype)
        if value is None:
            return None
        attributes[name] = value
    try:
        variables = {name: _read(file, name, place) for name, place in layout.arrays.items()}
    except (NotAResultError, UnicodeDecodeError):
        return None
    return Content(attributes, variables)


def _read(file: Hdf5Reader, name: str, place: _Place) -> Variable:
    raw = file.raw_arrays
    if place.dtype == object:
        data = raw.texts(name, place.offset, place.shape)
    else:
        data = raw.numbers(place.offset, place.dtype, place.shape)
    return Variable(place.dimensions, data, place.unit, place.long_name)


def remember_places(
    file: Hdf5Reader, attributes: Mapping[str, Attribute], variables: Mapping[str, Variable]
) -> None:
    """Remember where a file as rbstab wrote it has its content; no empty array has a place."""
    if _known is None or len(_known) >= MAX_SIZES:
        return
    types = {name: known_type(value) for name, value in attributes.items()}
    if not set(types.values()) <= set(KNOWN_TYPES):
        return
    places = {}
    for name, variable in variables.items():
        offset = file.offset(name)
        if offset is None:
            return
        dimensions, data, unit, long_name = variable
        places[name] = _Place(dimensions, data.dtype, data.shape, unit, long_name, offset)
    _known[file.size] = _Layout(types, places)
