"""Tables of runs: columns along the dimension `run`, in memory and in their files."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbstab.store.dataset import Dataset
from rbstab.store.dataset_file import read_dataset
from rbstab.store.errors import NotAResultError
from rbstab.store.variables import (
    RUN,
    FlatColumns,
    Variable,
    dataset_of,
    flat_columns,
    frame_of,
    no_such_array,
    safe_name,
)

if TYPE_CHECKING:
    import pandas
    import xarray

AXES = 3
"""The length of the dimension `axis` of vectors."""

VARIED = "varied"
"""The attribute with the names of the columns of varied keys."""

GRID_AXIS, GRID_LENGTH = "grid_axis", "grid_length"
"""The arrays with the names and lengths of the axes along which members are counted."""

SHOWN = ("outcome", "status")
"""The columns of flags of which a table shows the first one that it has."""


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

    def of(self, data: Any) -> Variable:
        """Return the column with its data."""
        dimensions, data = (RUN, *self.dimensions), np.asarray(data, self.dtype)
        return Variable(dimensions, data, self.unit, self.long_name, self.flags)

    def describes(self, stored: Variable) -> bool:
        """Whether a column is stored as it is now, or was before words were added to its flags."""
        flags = self.flags[: len(stored.flags)]
        described = ((RUN, *self.dimensions), np.dtype(self.dtype), self.unit, flags)
        same = (stored.dimensions, stored.data.dtype, stored.unit, stored.flags) == described
        return same and stored.data.shape[1:] == self.shape and bool(flags) == bool(self.flags)


Layout = Mapping[str, Column]
"""Columns by name."""


def columns_from(layout: Layout, arrays: Mapping[str, Any]) -> dict[str, Variable]:
    """Return columns with their data.

    Args:
        layout: The columns.
        arrays: Their data by name, and `run`, the numbers of the runs.
    """
    numbers = Variable((RUN,), np.asarray(arrays[RUN]), "1", "number of the run")
    return {RUN: numbers, **{name: column.of(arrays[name]) for name, column in layout.items()}}


class Table(Dataset):
    """The results of a sweep's members: one array per column, such as `table["settling_time"]`.

    The first axis of each column is the member, in the order of the member numbers. The arrays are
    read-only: copy one to change it.

    Attributes:
        variables: Each column by name, with dimensions, unit, meaning and data, shape (member,), of
            vectors (member, 3), SI units; `run`, the member numbers; and arrays without the
            dimension `run`, such as `grid_length`.
        attributes: Metadata: texts and numbers.
    """

    @property
    def columns(self) -> list[str]:
        """The names of the columns, without `run`."""
        return [n for n, v in self.variables.items() if v.dimensions[:1] == (RUN,) and n != RUN]

    def _facts(self) -> list[str]:
        """Return how many members, how many with each word of `SHOWN`, how many columns."""
        counts: list[str] = []
        shown = next((self.variables[name] for name in SHOWN if name in self), None)
        if shown is not None:
            numbers = np.bincount(shown.data, minlength=len(shown.flags))
            pairs = zip(numbers, shown.flags, strict=True)
            counts = [f"{n} {word.replace('_', ' ')}" for n, word in pairs if n]
        return [f"{len(self[RUN])} members", *counts, f"{len(self.columns)} columns"]

    def words(self, name: str) -> NDArray[Any]:
        """Return a column of integer codes as words: `table.words("status")[0]` is "completed".

        Raises:
            KeyError: There is no such column.
        """
        coded = [name for name in self.columns if self.variables[name].flags]
        if name not in coded:
            raise no_such_array(name, coded, "column of words")
        return self.variables[name].readable

    def shaped(self, name: str) -> NDArray[Any]:
        """Return a column, reshaped to the axes of the plan, in the order of `grid_axis`.

        A plan with two varied keys of 31 and 25 values gives the shape (31, 25), and (31, 25, 3)
        for a vector. The first axis varies slowest.

        Raises:
            KeyError: There is no such column.
        """
        data = self[name]
        return data.reshape(*self[GRID_LENGTH].tolist(), *data.shape[1:])

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
        return flat_columns(self.variables, (RUN,))

    def to_xarray(self) -> "xarray.Dataset":
        """Return the numbers as an `xarray.Dataset` (needs the package xarray).

        The varied keys are coordinates: `data.sel(controller_K_r_0=7.0)`. A grid has one dimension
        for each of its axes, and drawn points have the dimension `run`. Outcomes in words are codes
        (`flag_meanings`); the plan is an attribute.

        Raises:
            ImportError: xarray is not installed.
        """
        axes, varied = self._axes(), self.varied
        variables = {name: v for name, v in self.variables.items() if not v.dimensions}
        for name in (RUN, *self.columns):
            column = self.variables[name]
            shape, dimensions = column.data.shape[1:], column.dimensions[1:]
            for dimension, length in zip(dimensions, shape, strict=True):
                numbers = np.arange(1, length + 1)
                variables[dimension] = Variable((dimension,), numbers, "1", "component of a vector")
            if name in varied:
                variables[name] = self._varied(name, axes)
            elif column.data.dtype.kind != "S":
                data = column.data.reshape(*axes.values(), *shape)
                variables[name] = column._replace(dimensions=(*axes, *dimensions), data=data)
        coordinates = [RUN, *(name for name in varied if name in variables)]
        return dataset_of(variables, self.attributes, coordinates)

    @property
    def varied(self) -> list[str]:
        """The columns of the varied keys."""
        return str(self.attributes.get(VARIED, "")).split()

    def varied_values(self, name: str) -> Variable:
        """Return the values of a varied key along `run`; variants as words."""
        column = self.variables[name]
        return column._replace(data=column.readable, flags=())

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
            return {RUN: len(self[RUN])}
        taken = {
            label for name in self.columns for label in (name, *self.variables[name].dimensions)
        }
        taken = (taken | {"axis"}).difference(self.varied)
        safe = [f"{name}_axis" if name in taken else name for name in map(safe_name, names)]
        return dict(zip(safe, self[GRID_LENGTH].tolist(), strict=True))


def read_table(path: Path, kind: str, names: Iterable[str] | None = None) -> Table:
    """Read columns of runs.

    Args:
        path: The file.
        kind: What it must be.
        names: The columns to read; default all. Arrays without the dimension `run` are all read.

    Raises:
        NotAResultError: The file is damaged, or is not of this kind.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened.
    """
    table = read_dataset(path, kind, names, form=Table)
    try:
        _check(table)
    except (KeyError, ValueError) as error:
        raise NotAResultError(f"{path} is damaged: {error}") from error
    return table


def _check(table: Table) -> None:
    """Check that the runs are counted, and that each column has an entry and a word for each."""
    runs = table[RUN]
    if runs.dtype != np.dtype("i8") or runs.ndim != 1:
        raise ValueError(f"{RUN} has a wrong type or shape")
    if len(runs) and (runs[0] < 0 or np.any(runs[1:] - runs[:-1] != 1)):
        raise ValueError(f"{RUN} does not count the runs")
    for name in table.columns:
        column = table.variables[name]
        if len(column.data) != len(runs) or column.data.ndim != len(column.dimensions):
            raise ValueError(f"{name} has the shape {column.data.shape}")
        if column.flags and not set(np.unique(column.data)) <= set(range(len(column.flags))):
            raise ValueError(f"{name} has a flag without a meaning")
