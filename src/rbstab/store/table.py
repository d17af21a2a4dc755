"""Many runs as one table in memory: columns along the dimension `run`, and what they are."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbstab.store.result import Variable

if TYPE_CHECKING:
    import xarray

RUN = "run"
"""The dimension along which runs stand, and its coordinate: their numbers."""

AXES = 3
"""The length of the dimension `axis`, along which vectors stand."""


class Column(NamedTuple):
    """What a column is: the entry of a run, and the words that whole numbers stand for, if any."""

    dimensions: tuple[str, ...]
    dtype: str
    unit: str
    long_name: str
    flags: tuple[str, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the entry of one run."""
        return (AXES,) * len(self.dimensions)

    @property
    def size(self) -> int:
        """The bytes of the entry of one run."""
        return int(np.dtype(self.dtype).itemsize * AXES ** len(self.dimensions))


Layout = Mapping[str, Column]
"""Columns by name."""

Arrays = Mapping[str, NDArray[Any]]
"""Data of columns by name, the first axis along runs."""


class Head(NamedTuple):
    """What a table is, without the data of its columns; for the rest see `Table`.

    first is the number of the first run, length how many there are.
    """

    layout: Layout
    first: int
    length: int
    attributes: Mapping[str, str | int | float]
    extras: Mapping[str, Variable] = MappingProxyType({})


@dataclass(frozen=True)
class Table:
    """Runs with consecutive numbers.

    Attributes:
        layout: The columns.
        arrays: Their data; `run` has the numbers of the runs.
        attributes: What else is known, as texts and numbers.
        extras: Arrays that do not stand along runs.
    """

    layout: Layout
    arrays: Arrays = field(repr=False)
    attributes: Mapping[str, str | int | float]
    extras: Mapping[str, Variable] = field(default_factory=dict, repr=False)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The data of a column, or of an extra array."""
        return self.arrays[name] if name in self.arrays else self.extras[name].data

    def words(self, name: str) -> NDArray[Any]:
        """The data of a column of flags as texts."""
        return np.array(self.layout[name].flags, dtype=object)[self.arrays[name]]

    def shaped(self, name: str) -> NDArray[Any]:
        """The data of a column along the axes of the sweep (`grid_axis`), slowest first."""
        data = self.arrays[name]
        lengths = tuple(self["grid_length"].tolist())
        return data.reshape(lengths + data.shape[1:])

    def to_xarray(self) -> "xarray.Dataset":
        """The same as an `xarray.Dataset` (needs the package xarray).

        Raises:
            ImportError: xarray is not installed.
        """
        import xarray

        data: dict[str, Any] = {}
        for name, column in self.layout.items():
            dimensions = (RUN, *column.dimensions)
            data[name] = (dimensions, self.arrays[name], attributes_of(column))
        for name, extra in self.extras.items():
            notes = {"units": extra.unit, "long_name": extra.long_name}
            data[name] = (extra.dimensions, extra.data, notes)
        coordinates = {RUN: self.arrays[RUN], "axis": np.arange(1, AXES + 1)}
        return xarray.Dataset(data, coords=coordinates, attrs=dict(self.attributes))


def attributes_of(column: Column) -> dict[str, Any]:
    """The attributes of a column in a file; those of flags are from the CF conventions."""
    found: dict[str, Any] = {"units": column.unit, "long_name": column.long_name}
    if column.flags:
        found["flag_values"] = np.arange(len(column.flags), dtype=column.dtype)
        found["flag_meanings"] = " ".join(flag.replace(" ", "_") for flag in column.flags)
    return found


class TableDigest:
    """The SHA-256 of the columns of a table, however it is cut into parts."""

    def __init__(self, layout: Layout) -> None:
        self._columns = {name: hashlib.sha256(repr(c).encode()) for name, c in layout.items()}

    def add(self, arrays: Arrays) -> None:
        """Takes the next runs."""
        for name, digest in self._columns.items():
            digest.update(np.ascontiguousarray(arrays[name]).tobytes())

    def result(self) -> str:
        """The digest, in hexadecimal, of all runs so far."""
        found = {name: digest.hexdigest() for name, digest in self._columns.items()}
        return hashlib.sha256(json.dumps(found, sort_keys=True).encode()).hexdigest()
