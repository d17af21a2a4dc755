"""Tables of runs in memory: columns along the dimension `run`, with their units and meanings."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbstab.store.array_names import no_such_array, safe_name
from rbstab.store.cards import bar, card, line
from rbstab.store.variables import (
    RUN,
    FlatColumns,
    Variable,
    check_shape,
    dataset_of,
    flag_attributes,
    frame_of,
    make_read_only,
    split,
)

if TYPE_CHECKING:
    import pandas
    import xarray

AXES = 3
"""The length of the dimension `axis` of vectors."""

_LAST_ASCII = 127


class Column(NamedTuple):
    """The declaration of a column of a table.

    Attributes:
        dimensions: The dimensions of the entry of one run; empty for a number.
        dtype: The numpy type.
        unit: The SI unit; "1" for dimensionless columns.
        long_name: The meaning.
        flags: The words for the values 0, 1, ..., if any.
        lengths: The lengths of the dimensions; default `AXES` for each.
    """

    dimensions: tuple[str, ...]
    dtype: str
    unit: str
    long_name: str
    flags: tuple[str, ...] = ()
    lengths: tuple[int, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the entry of one run."""
        return self.lengths or (AXES,) * len(self.dimensions)

    @property
    def size(self) -> int:
        """The size of the entry of one run, bytes."""
        return int(np.dtype(self.dtype).itemsize * np.prod(self.shape, dtype=int))


Layout = Mapping[str, Column]
"""Columns by name."""

Arrays = Mapping[str, NDArray[Any]]
"""Data of columns by name; the first axis is along runs."""


VARIED = "varied"
"""The attribute with the names of the columns of varied keys."""

GRID_AXIS, GRID_LENGTH = "grid_axis", "grid_length"
"""The arrays with the names and lengths of the axes along which members are counted."""

SHOWN = ("outcome", "status")
"""The columns of flags of which a table shows the first one that it has."""


@dataclass(frozen=True, repr=False)
class Table:
    """The results of a sweep's members: one array per column, such as `table["settling_time"]`.

    The first axis of each column is the member, in the order of the member numbers. The arrays are
    read-only: copy one to change it.

    Attributes:
        layout: The declaration of each column by name: dimensions, unit, meaning.
        arrays: The data of each column by name, and `run`, the member numbers; shape (member,), of
            vectors (member, 3), SI units.
        attributes: Metadata: texts and numbers.
        extras: Arrays without the dimension `run`, such as `grid_length`.
    """

    layout: Layout
    arrays: Arrays = field(repr=False)
    attributes: Mapping[str, str | int | float]
    extras: Mapping[str, Variable] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        make_read_only([*self.arrays.values(), *(extra.data for extra in self.extras.values())])

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the data of a column, or of an array in `extras`.

        Raises:
            KeyError: There is no such column or array.
        """
        if name not in self.arrays and name not in self.extras:
            raise no_such_array(name, self.keys(), "column")
        return self.arrays[name] if name in self.arrays else self.extras[name].data

    def __contains__(self, name: str) -> bool:
        return name in self.arrays or name in self.extras

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def keys(self) -> list[str]:
        """Return the names of the columns, and of the arrays in `extras`."""
        return [*self.arrays, *self.extras]

    _ipython_key_completions_ = keys

    def __repr__(self) -> str:
        """Return one line: title, members, how many have each outcome."""
        return line("Table", str(self.attributes.get("title", "")), self._facts())

    def _repr_html_(self) -> str:
        """Return a card for notebooks: the same facts, and a bar of the outcomes."""
        members, *outcomes, columns = self._facts()
        facts = [
            ("members", members),
            (self._shown or SHOWN[0], ", ".join(outcomes) or "-"),
            ("content", columns),
        ]
        title = str(self.attributes.get("title", ""))
        return card("Table", title, facts, bar(self._counts()))

    def _facts(self) -> list[str]:
        counts = [f"{count} {word}" for word, count in self._counts().items()]
        return [f"{len(self.arrays[RUN])} members", *counts, f"{len(self.layout)} columns"]

    @property
    def _shown(self) -> str:
        """The column of flags that the table shows of itself; "" if none was read."""
        return next((n for n in SHOWN if n in self.arrays and n in self.layout), "")

    def _counts(self) -> dict[str, int]:
        """Return how many runs have each word of that column, without words that none has."""
        if not self._shown:
            return {}
        flags = self.layout[self._shown].flags
        found = np.bincount(self.arrays[self._shown], minlength=len(flags))[: len(flags)]
        pairs = zip(flags, found, strict=True)
        return {word.replace("_", " "): int(n) for word, n in pairs if n}

    def words(self, name: str) -> NDArray[Any]:
        """Return a column of integer codes as words: `table.words("status")[0]` is "completed".

        Raises:
            KeyError: There is no such column.
        """
        coded = [
            column for column, layout in self.layout.items() if layout.flags and column in self
        ]
        if name not in coded:
            raise no_such_array(name, coded, "column of words")
        return np.array(self.layout[name].flags, dtype=object)[self.arrays[name]]

    def shaped(self, name: str) -> NDArray[Any]:
        """Return a column, reshaped to the axes of the plan, in the order of `grid_axis`.

        A plan with two varied keys of 31 and 25 values gives the shape (31, 25), and (31, 25, 3)
        for a vector. The first axis varies slowest.

        Raises:
            KeyError: There is no such column.
        """
        if name not in self.arrays:
            raise no_such_array(name, self.arrays, "column")
        data = self.arrays[name]
        lengths = tuple(self[GRID_LENGTH].tolist())
        return data.reshape(lengths + data.shape[1:])

    def to_pandas(self) -> "pandas.DataFrame":
        """Return one row a member, as `flat` (needs the package pandas).

        The index is `run`, the member number. The units are in `attrs["units"]`.

        Raises:
            ImportError: pandas is not installed.
        """
        return frame_of(self.flat(), RUN)

    def flat(self) -> FlatColumns:
        """Return the columns with one entry a member: varied values, then outcomes.

        Vectors are split (`final_position_0`), and codes are words.
        """
        arrays, units = {RUN: self.arrays[RUN]}, {RUN: "1"}
        for name, column in self.layout.items():
            found = split(name, self._readable(name))
            arrays |= found
            units |= dict.fromkeys(found, column.unit)
        return FlatColumns(arrays, units)

    def to_xarray(self) -> "xarray.Dataset":
        """Return the numbers as an `xarray.Dataset` (needs the package xarray).

        The varied keys are coordinates: `data.sel(controller_K_r_0=7.0)`. A grid has one dimension
        for each of its axes, and drawn points have the dimension `run`. Outcomes in words are codes
        (`flag_meanings`); the plan is an attribute.

        Raises:
            ImportError: xarray is not installed.
        """
        axes = self._axes()
        numbers = self.arrays[RUN].reshape(tuple(axes.values()))
        variables = {RUN: Variable(tuple(axes), numbers, "1", "number of the member")} | {
            name: Variable((name,), np.arange(1, length + 1), "1", "component of a vector")
            for name, length in dimensions_of(self.layout).items()
        }
        for name, column in self.layout.items():
            if name in self.varied:
                variables[name] = self._varied(name, axes)
            elif np.dtype(column.dtype).kind != "S":
                data = self.arrays[name].reshape(*axes.values(), *column.shape)
                dimensions = (*axes, *column.dimensions)
                variables[name] = Variable(dimensions, data, column.unit, column.long_name)
        variables |= {name: extra for name, extra in self.extras.items() if not extra.dimensions}
        coordinates = [RUN, *(name for name in self.varied if name in variables)]
        dataset = dataset_of(variables, self.attributes, coordinates)
        for name, column in self.layout.items():
            if name in dataset.data_vars:
                dataset[name].attrs.update(attributes_of(column))
        return dataset

    @property
    def varied(self) -> list[str]:
        """The columns of the varied keys."""
        return str(self.attributes.get(VARIED, "")).split()

    def varied_values(self, name: str) -> Variable:
        """Return the values of a varied key along `run`; variants as words."""
        column = self.layout[name]
        return Variable((RUN,), self._readable(name), column.unit, column.long_name)

    def _varied(self, name: str, axes: Mapping[str, int]) -> Variable:
        """Return the values of a varied key along its axis; along all axes if it has none."""
        values = self.varied_values(name)
        data = values.data.reshape(tuple(axes.values()))
        for number, axis in enumerate(axes):
            only = tuple(slice(None if other == number else 1) for other in range(data.ndim))
            if name == axis or (name not in axes and (data == data[only]).all()):
                return values._replace(dimensions=(axis,), data=data[only].ravel())
        return values._replace(dimensions=tuple(axes), data=data)

    def _axes(self) -> dict[str, int]:
        """Return the names and lengths of the dimensions that count members, slowest first."""
        names = self[GRID_AXIS].tolist() if GRID_AXIS in self else []
        if names in ([], ["point"]):
            return {RUN: len(self.arrays[RUN])}
        taken = {RUN, *dimensions_of(self.layout), *self.layout}.difference(self.varied)
        safe = [f"{name}_axis" if name in taken else name for name in map(safe_name, names)]
        return dict(zip(safe, self[GRID_LENGTH].tolist(), strict=True))

    def _readable(self, name: str) -> NDArray[Any]:
        """Return a column with words in place of codes, and texts in place of bytes."""
        if self.layout[name].flags:
            return self.words(name)
        data = self.arrays[name]
        return data.astype(str).astype(object) if data.dtype.kind == "S" else data


def check_columns(layout: Layout, arrays: Arrays) -> None:
    """Check that the data of columns are as their declarations say.

    Args:
        layout: The columns.
        arrays: The data of some of these columns, and `run`.

    Raises:
        ValueError: A column has a wrong type or shape, a flag without a word, or a text that is not
            ASCII; or the numbers of the runs are not consecutive.
    """
    runs = arrays[RUN]
    if runs.dtype != np.dtype("i8") or runs.ndim != 1:
        raise ValueError(f"{RUN} has a wrong type or shape")
    if len(runs) and (runs[0] < 0 or np.any(runs[1:] - runs[:-1] != 1)):
        raise ValueError(f"{RUN} does not count the runs")
    for name, column in layout.items():
        if name in arrays:
            check_column(name, column, arrays[name], len(runs))


def check_column(name: str, column: Column, data: NDArray[Any], runs: int) -> None:
    """Check that the data of a column are as its declaration says.

    Args:
        name: The name of the column.
        column: Its declaration.
        data: Its data.
        runs: The number of runs.

    Raises:
        ValueError: It has a wrong type or shape, a flag without a word, or text that is not ASCII.
    """
    if data.dtype != np.dtype(column.dtype):
        raise ValueError(f"{name} has the type {data.dtype} (expected {column.dtype})")
    check_shape(name, data, (runs, *column.shape))
    if column.flags and data.size and not 0 <= data.min() <= data.max() < len(column.flags):
        raise ValueError(f"{name} has a flag without a meaning")
    if data.dtype.kind == "S" and np.any(np.ascontiguousarray(data).view("u1") > _LAST_ASCII):
        raise ValueError(f"{name} has a text that is not ASCII")


def dimensions_of(layout: Layout) -> dict[str, int]:
    """Return the lengths of the dimensions of columns, by name."""
    lengths = {"axis": AXES}
    for column in layout.values():
        lengths |= dict(zip(column.dimensions, column.shape, strict=True))
    return lengths


def attributes_of(column: Column) -> dict[str, Any]:
    """Return the attributes of a column in a file; flags follow the CF conventions."""
    attributes: dict[str, Any] = {"units": column.unit, "long_name": column.long_name}
    if column.flags:
        attributes |= flag_attributes(column.flags, column.dtype)
    return attributes
