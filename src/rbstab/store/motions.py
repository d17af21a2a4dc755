"""Motions of runs in memory: arrays along the dimensions run, time and axis."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rbstab.store.result import Variable, dataset_of
from rbstab.store.table import RUN

if TYPE_CHECKING:
    import xarray

COORDINATES = (RUN, "time", "axis")
"""The dimensions, in their order. Arrays of these names are their coordinates."""


@dataclass(frozen=True)
class Motions:
    """Motions of some runs at the same samples, or of one, which then has no dimension `run`.

    Attributes:
        variables: Arrays by name, among them the coordinates of their dimensions.
        attributes: What else is known, as texts and numbers.
    """

    variables: Mapping[str, Variable] = field(repr=False)
    attributes: Mapping[str, str | int | float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The array of that name."""
        return self.variables[name].data

    def __contains__(self, name: str) -> bool:
        return name in self.variables

    def to_xarray(self) -> "xarray.Dataset":
        """The same as an `xarray.Dataset` (needs the package xarray).

        Raises:
            ImportError: xarray is not installed.
        """
        return dataset_of(self.variables, self.attributes)


def joined(parts: list[Motions]) -> Motions:
    """Motions of some runs from those of each, all at the same samples, in the order given."""
    first = parts[0].variables
    together = {
        name: Variable(
            (RUN, *variable.dimensions),
            np.stack([part[name] for part in parts]),
            variable.unit,
            variable.long_name,
        )
        for name, variable in first.items()
        if name not in COORDINATES or name == RUN
    }
    together[RUN] = together[RUN]._replace(dimensions=(RUN,))
    alike = {name: first[name] for name in COORDINATES if name != RUN}
    return Motions(alike | together, parts[0].attributes)
