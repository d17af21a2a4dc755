"""A result in memory: named arrays with dimensions, and attributes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray

SCHEMA_VERSION = 1
"""The version of the file format that this program writes, and the newest that it reads."""


class Variable(NamedTuple):
    """One array: the names of its dimensions, its data, its unit and what it is."""

    dimensions: tuple[str, ...]
    data: NDArray[Any]
    unit: str
    long_name: str


def beside(name: str, dimension: str) -> str:
    """The name of a dimension's coordinate: it stands in the group of the array that has it."""
    group, slash, _ = name.rpartition("/")
    return f"{group}{slash}{dimension}"


@dataclass(frozen=True)
class Result:
    """The result of one run.

    Attributes:
        variables: Arrays by name; those named like a dimension are its coordinates. One of a group
            has the group's name before its own: `certificate/verdict`.
        attributes: What else is known of the run, as texts and numbers (`status`, `run_id`, ...).
        config: The resolved config, YAML.
    """

    variables: dict[str, Variable]
    attributes: dict[str, str | int | float]
    config: str = field(repr=False)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The array of that name."""
        return self.variables[name].data

    def __contains__(self, name: str) -> bool:
        return name in self.variables

    @property
    def status(self) -> str:
        """How the run ended."""
        return str(self.attributes["status"])

    @property
    def run_id(self) -> str:
        """The identity of the run."""
        return str(self.attributes["run_id"])

    def to_xarray(self, group: str = "") -> "xarray.Dataset":
        """The same as an `xarray.Dataset` (needs the package xarray).

        Args:
            group: The group whose arrays are wanted; those of none by default.

        Raises:
            ImportError: xarray is not installed.
        """
        members = {
            name.removeprefix(f"{group}/"): variable
            for name, variable in self.variables.items()
            if name.rpartition("/")[0] == group
        }
        if group:
            return dataset_of(members, {})
        found = dataset_of(members, self.attributes)
        found["config"] = ((), np.array(self.config, dtype=object), {})
        return found


def dataset_of(
    variables: Mapping[str, Variable], attributes: Mapping[str, str | int | float]
) -> "xarray.Dataset":
    """Arrays as an `xarray.Dataset`; those named like a dimension are its coordinates.

    Raises:
        ImportError: xarray is not installed.
    """
    # Imported late: it takes a second, and is optional.
    import xarray

    data = {
        name: (v.dimensions, v.data, {"units": v.unit, "long_name": v.long_name})
        for name, v in variables.items()
    }
    dimensions = {dimension for v in variables.values() for dimension in v.dimensions}
    coordinates = {name: data.pop(name) for name in list(data) if name in dimensions}
    return xarray.Dataset(data, coords=coordinates, attrs=dict(attributes))
