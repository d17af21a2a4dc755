"""A result in memory: named arrays with dimensions, and attributes."""

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


@dataclass(frozen=True)
class Result:
    """The result of one run.

    Attributes:
        variables: Arrays by name; those named like a dimension are its coordinates.
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

    def to_xarray(self) -> "xarray.Dataset":
        """The same as an `xarray.Dataset` (needs the package xarray).

        Raises:
            ImportError: xarray is not installed.
        """
        import xarray

        data = {
            name: (v.dimensions, v.data, {"units": v.unit, "long_name": v.long_name})
            for name, v in self.variables.items()
        }
        dimensions = {dimension for v in self.variables.values() for dimension in v.dimensions}
        coordinates = {name: data.pop(name) for name in list(data) if name in dimensions}
        data["config"] = ((), np.array(self.config, dtype=object), {})
        return xarray.Dataset(data, coords=coordinates, attrs=dict(self.attributes))
