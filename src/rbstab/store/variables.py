"""Arrays with dimensions and units, and how pandas and xarray take them."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbstab.store.array_names import safe_name
from rbstab.store.cards import optional_module

if TYPE_CHECKING:
    import pandas
    import xarray


RUN = "run"
"""The dimension of runs, and its coordinate, the numbers of the runs."""


class Variable(NamedTuple):
    """An array with the names of its dimensions, its unit, its meaning, and words for its codes."""

    dimensions: tuple[str, ...]
    data: NDArray[Any]
    unit: str
    long_name: str
    flags: tuple[str, ...] = ()

    @property
    def is_text(self) -> bool:
        """Whether the array holds texts."""
        return self.data.dtype.kind in "OUT"


def coordinate_name(name: str, dimension: str) -> str:
    """Return the name of the coordinate of an array's dimension; it is in the array's group."""
    group, slash, _ = name.rpartition("/")
    return f"{group}{slash}{dimension}"


def check_shape(name: str, data: NDArray[Any], shape: tuple[int, ...]) -> None:
    """Check the shape of an array.

    Raises:
        ValueError: The shape is wrong.
    """
    if np.shape(data) != shape:
        raise ValueError(f"{name} has the shape {np.shape(data)} (expected {shape})")


def make_read_only(arrays: Iterable[NDArray[Any]]) -> None:
    """Refuse writing to arrays: `result["orientation"] *= 57.3` would change what was computed."""
    for array in arrays:
        array.setflags(write=False)


class FlatColumns(NamedTuple):
    """Columns of equal length, and the units of those that have one, by name.

    A vector is split: `position_0`, `position_1`, `position_2`.
    """

    arrays: dict[str, NDArray[Any]]
    units: dict[str, str]


def split(
    name: str, data: NDArray[Any], rows: int = 1, labels: Sequence[Sequence[str]] | None = None
) -> dict[str, NDArray[Any]]:
    """Return an array as flat columns, whose names end with the labels of their entries.

    Args:
        name: The name of the array.
        data: The array.
        rows: How many of the first dimensions count the rows.
        labels: The labels along each further dimension; default their numbers, from 0.
    """
    shape = data.shape[rows:]
    names = labels if labels is not None else [list(map(str, range(n))) for n in shape]
    entries = data.reshape(-1, *shape)
    return {
        safe_name("_".join((name, *label))): entries[(slice(None), *index)]
        for index, label in zip(np.ndindex(*shape), product(*names), strict=True)
    }


def flat_columns(variables: Mapping[str, Variable], along: tuple[str, ...]) -> FlatColumns:
    """Return the arrays whose first dimensions are those of the rows, as flat columns.

    Args:
        variables: Arrays by name, with their coordinates. Those of groups are left out.
        along: The dimensions of the rows, the last one fastest; each has a coordinate.
    """
    grids = np.meshgrid(*(variables[name].data for name in along), indexing="ij")
    arrays = {name: grid.ravel() for name, grid in zip(along, grids, strict=True)}
    units = {name: variables[name].unit for name in along}
    for name, variable in variables.items():
        dimensions = variable.dimensions
        if "/" in name or name in along or dimensions[: len(along)] != along:
            continue
        labels = [_labels(variables, dimension) for dimension in dimensions[len(along) :]]
        found = split(name, variable.data, len(along), labels)
        arrays |= found
        units |= dict.fromkeys(found, variable.unit)
    return FlatColumns(arrays, units)


def _labels(variables: Mapping[str, Variable], dimension: str) -> Sequence[str]:
    """Return the words along a dimension, or the numbers of its entries, from 0."""
    coordinate = variables[dimension]
    count = len(coordinate.data)
    return coordinate.data.tolist() if coordinate.is_text else list(map(str, range(count)))


def joined(parts: Sequence[FlatColumns]) -> FlatColumns:
    """Return tables below each other; what a part lacks is NaN, or an empty text."""
    units = {name: unit for part in parts for name, unit in part.units.items()}
    found = [part.arrays for part in parts]
    lengths = [len(next(iter(arrays.values()))) for arrays in found]
    columns = {}
    for name in dict.fromkeys(name for arrays in found for name in arrays):
        is_text = any(name in arrays and arrays[name].dtype == object for arrays in found)
        columns[name] = np.concatenate(
            [
                # A number in a column of texts is the NaN of a missing text.
                np.full(length, "", dtype=object)
                if is_text and (name not in arrays or arrays[name].dtype != object)
                else arrays.get(name, np.full(length, np.nan))
                for arrays, length in zip(found, lengths, strict=True)
            ]
        )
    return FlatColumns(columns, units)


def frame_of(columns: FlatColumns, index: str) -> "pandas.DataFrame":
    """Return columns as a `pandas.DataFrame`, one of them as its index.

    Raises:
        ImportError: pandas is not installed.
    """
    # Imported here because pandas is optional, and its import takes half a second.
    package: Any = optional_module("pandas", "table")
    frame = package.DataFrame(columns.arrays).set_index(index)
    frame.attrs["units"] = columns.units
    return frame


def dataset_of(
    variables: Mapping[str, Variable],
    attributes: Mapping[str, Any],
    coordinates: Collection[str] = (),
) -> "xarray.Dataset":
    """Return arrays as an `xarray.Dataset` of numbers.

    Only the labels of a dimension may be words. Other texts become an attribute, or codes.

    Args:
        variables: The arrays. Those named like a dimension are its coordinates.
        attributes: Texts and numbers.
        coordinates: Further arrays that are coordinates; those along one dimension have an index.

    Raises:
        ImportError: xarray is not installed.
    """
    # Imported here because xarray is optional, and its import takes a second.
    package: Any = optional_module("xarray", "xarray")
    dimensions = {dimension for v in variables.values() for dimension in v.dimensions}
    labels = dimensions | set(coordinates)
    texts = {
        name: str(v.data.item()) for name, v in variables.items() if v.is_text and not v.dimensions
    }
    data = {name: _entry(v, name in labels) for name, v in variables.items() if name not in texts}
    make_read_only(entry[1] for entry in data.values())
    labelled = {name: data.pop(name) for name in list(data) if name in labels}
    dataset = package.Dataset(data, coords=labelled, attrs={**attributes, **texts})
    for name in coordinates:
        if name not in dimensions and len(variables[name].dimensions) == 1:
            dataset = dataset.set_xindex(name)
    return dataset


def _entry(variable: Variable, is_label: bool) -> tuple[Any, ...]:
    """Return an array as xarray takes it; of texts that are no labels, the codes."""
    data, attributes = variable.data, {"units": variable.unit, "long_name": variable.long_name}
    if variable.is_text and not is_label:
        words, codes = np.unique(data.astype(str), return_inverse=True)
        data = codes.reshape(data.shape)
        attributes |= flag_attributes(words.tolist(), data.dtype)
    return variable.dimensions, data, attributes


def flag_attributes(words: Sequence[str], dtype: Any) -> dict[str, Any]:
    """Return the attributes that give the words of the codes 0, 1, ... (CF conventions)."""
    meanings = " ".join(word.replace(" ", "_") for word in words)
    return {"flag_values": np.arange(len(words), dtype=dtype), "flag_meanings": meanings}
