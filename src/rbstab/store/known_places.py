"""Places of arrays in files that were read before, tried in the next file of the same size.

rbstab writes runs of one kind alike: their arrays are in the same places, with the same names,
types, dimensions, units and meanings. To find all this out takes HDF5 most of the time. So it is
taken from a file of the same size that was read before. The digest of a result covers all of it,
and the numbers: it shows that what was read is right. It does not show that HDF5 would find these
arrays, so only files with a seal are read in this way.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rbstab.store.errors import NotAResultError
from rbstab.store.opening import Hdf5Reader
from rbstab.store.result import Variable

MAX_SIZES = 256
"""The most sizes of files that are remembered."""


class _Place(NamedTuple):
    """An array without its content; offset is its first byte."""

    dimensions: tuple[str, ...]
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    unit: str
    long_name: str
    offset: int


_known: dict[int, dict[str, _Place]] = {}
"""The arrays of files that were read, by the size of the file."""


def variables_at_known_places(file: Hdf5Reader) -> dict[str, Variable] | None:
    """Return the arrays of a file as if it were like another one of its size; None without one.

    Args:
        file: A file as rbstab wrote it. The result may be wrong: compare it with its digest.
    """
    places = _known.get(file.size)
    if places is None:
        return None
    try:
        return {name: _read(file, name, place) for name, place in places.items()}
    except (NotAResultError, UnicodeDecodeError):
        return None


def _read(file: Hdf5Reader, name: str, place: _Place) -> Variable:
    if place.dtype == object:
        data = file.texts_at(name, place.offset, place.shape)
    else:
        data = file.numbers_at(place.offset, place.dtype, place.shape)
    return Variable(place.dimensions, data, place.unit, place.long_name)


def remember_places(file: Hdf5Reader, variables: Mapping[str, Variable]) -> None:
    """Remember the places of all arrays of a file as rbstab wrote it; no empty array has one."""
    if len(_known) >= MAX_SIZES:
        return
    places = {}
    for name, variable in variables.items():
        offset = file.offset(name)
        if offset is None:
            return
        dimensions, data, unit, long_name = variable
        places[name] = _Place(dimensions, data.dtype, data.shape, unit, long_name, offset)
    _known[file.size] = places
