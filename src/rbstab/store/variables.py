"""Arrays with dimensions, units and words, and how pandas and xarray take them."""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from difflib import get_close_matches
from importlib import import_module
from itertools import product
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas
    import xarray


RUN = "run"
"""The dimension of runs, and its coordinate, the numbers of the runs."""

MAX_LISTED = 40
"""The most names that an error lists."""


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

    @property
    def readable(self) -> NDArray[Any]:
        """The data with words in place of codes, and texts in place of bytes."""
        if self.flags:
            return np.array(self.flags, dtype=object)[self.data]
        if self.data.dtype.kind == "S":
            return np.char.decode(self.data, "ascii", "replace").astype(object)
        return self.data


def optional_module(name: str, extra: str) -> ModuleType:
    """Import a package that only an extra of the installation has.

    Raises:
        ImportError: It is not installed; the message has the command that installs it.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise ImportError(
            f'this needs the package {error.name}. Run: pip install "rbstab[{extra}]"',
            name=error.name,
        ) from error


def no_such_array(name: object, names: Iterable[str], kind: str = "array") -> KeyError:
    """Return the error about a name that no array has: the name that was meant, or all names.

    Args:
        name: The name.
        names: The names of the arrays.
        kind: What an array is called in the message.
    """
    names = list(names)
    close = get_close_matches(str(name), names, n=1)
    if close:
        return KeyError(f"no {kind} {name!r}; did you mean {close[0]}?")
    rest = ", ..." if len(names) > MAX_LISTED else ""
    return KeyError(f"no {kind} {name!r}; there are: {', '.join(names[:MAX_LISTED])}{rest}")


def safe_name(key: str) -> str:
    """Return a config key as a netCDF name, such as `body_inertia_0` for `body.inertia[0]`."""
    return re.sub(r"[^A-Za-z0-9_]+", "_", key).strip("_")


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


def flat_columns(variables: Mapping[str, Variable], along: tuple[str, ...]) -> FlatColumns:
    """Return the arrays whose first dimensions are those of the rows, as flat columns.

    Codes are words. Vectors are split: the names end with the labels of the entries, or with their
    numbers, from 0.

    Args:
        variables: Arrays by name, with their coordinates. Those of groups are left out.
        along: The dimensions of the rows, the last one fastest; each has a coordinate.
    """
    grids = np.meshgrid(*(variables[name].data for name in along), indexing="ij")
    arrays = {name: grid.ravel() for name, grid in zip(along, grids, strict=True)}
    units = {name: variables[name].unit for name in along}
    for name, variable in variables.items():
        rows, dimensions = variable.dimensions[: len(along)], variable.dimensions[len(along) :]
        if "/" in name or name in along or rows != along:
            continue
        shape = variable.data.shape[len(along) :]
        labels = [
            _labels(variables.get(dimension), length)
            for dimension, length in zip(dimensions, shape, strict=True)
        ]
        entries = variable.readable.reshape(-1, *shape)
        for index, label in zip(np.ndindex(*shape), product(*labels), strict=True):
            column = safe_name("_".join((name, *label)))
            arrays[column] = entries[(slice(None), *index)]
            units[column] = variable.unit
    return FlatColumns(arrays, units)


def _labels(coordinate: Variable | None, length: int) -> Sequence[str]:
    """Return the words along a dimension, or the numbers of its entries, from 0."""
    if coordinate is not None and coordinate.is_text:
        return [str(word) for word in coordinate.data]
    return list(map(str, range(length)))


def joined(parts: Sequence[FlatColumns]) -> FlatColumns:
    """Return tables below each other; what a part lacks is NaN, or an empty text."""
    units = {name: unit for part in parts for name, unit in part.units.items()}
    tables = [part.arrays for part in parts]
    lengths = [len(next(iter(arrays.values()))) for arrays in tables]
    columns = {}
    for name in dict.fromkeys(name for arrays in tables for name in arrays):
        is_text = any(name in arrays and arrays[name].dtype == object for arrays in tables)
        columns[name] = np.concatenate(
            [
                # A number in a column of texts is the NaN of a missing text.
                np.full(length, "", dtype=object)
                if is_text and (name not in arrays or arrays[name].dtype != object)
                else arrays.get(name, np.full(length, np.nan))
                for arrays, length in zip(tables, lengths, strict=True)
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
    data, words = variable.data, variable.flags
    if variable.is_text and not is_label:
        texts, codes = np.unique(data.astype(str), return_inverse=True)
        data, words = codes.reshape(data.shape), tuple(texts.tolist())
    return variable.dimensions, data, described(variable._replace(data=data, flags=words))


def described(variable: Variable) -> dict[str, Any]:
    """Return the attributes of an array; the words of the codes 0, 1, ... by the CF conventions."""
    attributes: dict[str, Any] = {"units": variable.unit, "long_name": variable.long_name}
    if variable.flags:
        codes = np.arange(len(variable.flags), dtype=variable.data.dtype)
        meanings = " ".join(word.replace(" ", "_") for word in variable.flags)
        attributes |= {"flag_values": codes, "flag_meanings": meanings}
    return attributes
