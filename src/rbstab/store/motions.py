"""Motions of runs in memory: arrays with the dimensions run, time and axis."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rbstab.store.array_names import no_such_array
from rbstab.store.cards import line
from rbstab.store.variables import RUN, Variable, dataset_of, make_read_only

if TYPE_CHECKING:
    import xarray

_ORDER = {RUN: 0, "time": 1, "axis": 2}


def coordinates_of(variables: Mapping[str, Variable]) -> list[str]:
    """Return the names of the coordinates, which are the arrays named like their dimension.

    `run`, `time` and `axis` come first, in this order.
    """
    names = [name for name, variable in variables.items() if variable.dimensions == (name,)]
    return sorted(names, key=lambda name: _ORDER.get(name, len(_ORDER)))


@dataclass(frozen=True, repr=False)
class Motions:
    """The trajectories of one or several runs at common times, as arrays by name.

    An array has the shape (time,) or (time, 3); with several runs, (run, time) or (run, time, 3).
    The arrays are read-only.

    Attributes:
        variables: Arrays by name, with dimensions and SI units, including the coordinates `time`,
            s, `axis` and `run`.
        attributes: Metadata: texts and numbers.
    """

    variables: Mapping[str, Variable] = field(repr=False)
    attributes: Mapping[str, str | int | float] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        make_read_only(variable.data for variable in self.variables.values())

    def __repr__(self) -> str:
        """Return one line: how many runs, if several, samples and arrays."""
        samples = len(self["time"]) if "time" in self else 0
        several = RUN in self and self.variables[RUN].dimensions == (RUN,)
        runs = [f"{len(self[RUN])} runs"] if several else []
        facts = [*runs, f"{samples} samples", f"{len(self.variables)} arrays"]
        return line("Motions", "", facts)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the array with this name.

        Raises:
            KeyError: There is no such array.
        """
        if name not in self.variables:
            raise no_such_array(name, self.variables)
        return self.variables[name].data

    def __contains__(self, name: str) -> bool:
        return name in self.variables

    def __iter__(self) -> Iterator[str]:
        return iter(self.variables)

    def keys(self) -> list[str]:
        """Return the names of the arrays."""
        return list(self.variables)

    _ipython_key_completions_ = keys

    def to_xarray(self) -> "xarray.Dataset":
        """Return the motions as an `xarray.Dataset` (needs the package xarray).

        Raises:
            ImportError: xarray is not installed.
        """
        return dataset_of(self.variables, self.attributes)


def stack_motions(runs: list[Motions]) -> Motions:
    """Join the motions of single runs along the dimension `run`; their times must be equal."""
    first = runs[0].variables
    coordinates = coordinates_of(first)
    stacked = {
        name: Variable(
            (RUN, *variable.dimensions),
            np.stack([run[name] for run in runs]),
            variable.unit,
            variable.long_name,
        )
        for name, variable in first.items()
        if (name not in coordinates or name == RUN) and all(name in run for run in runs)
    }
    stacked[RUN] = stacked[RUN]._replace(dimensions=(RUN,))
    common = {name: first[name] for name in coordinates if name != RUN}
    return Motions(common | stacked, runs[0].attributes)
