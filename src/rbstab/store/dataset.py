"""A dataset in memory: named arrays with dimensions, and attributes. All results are datasets.

Motions of runs are arrays with the dimensions run, time and axis.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rbstab.files.text import line
from rbstab.store.variables import RUN, Variable, dataset_of, make_read_only, no_such_array

if TYPE_CHECKING:
    import xarray


Attributes = Mapping[str, str | int | float]


@dataclass(frozen=True, repr=False)
class Dataset:
    """Named arrays and attributes. The arrays are read-only.

    Attributes:
        variables: The arrays by name; in a group, the name begins with it: `certificate/verdict`.
        attributes: Texts and numbers by name.
        kind: What it is in a file, such as "the result of a run".
        digest: The digest in the seal of the file that was read.
    """

    variables: Mapping[str, Variable]
    attributes: Attributes
    kind: str = field(default="", kw_only=True)
    digest: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        make_read_only(variable.data for variable in self.variables.values())

    def __repr__(self) -> str:
        """Return one line: title, what it holds, size."""
        return line(type(self).__name__, str(self.attributes.get("title", "")), self._facts())

    def _facts(self) -> list[str]:
        """Return what the dataset shows of itself."""
        samples = [f"{len(self['time'])} samples"] if "time" in self else []
        return [*samples, f"{len(self.variables)} arrays"]

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the array with this name, such as "orientation", in SI units.

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
        """Return the arrays as an `xarray.Dataset` (needs the package xarray).

        Raises:
            ImportError: xarray is not installed.
        """
        return dataset_of(self.variables, self.attributes)


MOTIONS = "a file of traces of a sweep"
"""The kind of the files."""


class Motions(Dataset):
    """The trajectories of one or several runs at common times, as arrays by name.

    An array has the shape (time,) or (time, 3); with several runs, (run, time) or (run, time, 3).
    The arrays are read-only.

    Attributes:
        variables: Arrays by name, with dimensions and SI units, including the coordinates `time`,
            s, `axis` and `run`.
        attributes: Metadata: texts and numbers.
    """

    def _facts(self) -> list[str]:
        """Return how many runs, if several, samples and arrays there are."""
        several = RUN in self and self.variables[RUN].dimensions == (RUN,)
        return [*([f"{len(self[RUN])} runs"] if several else []), *super()._facts()]


def stack_motions(runs: list[Motions]) -> Motions:
    """Join the motions of single runs along the dimension `run`; their times must be equal."""
    stacked = {}
    for name, variable in runs[0].variables.items():
        if name == RUN:
            stacked[name] = variable._replace(
                dimensions=(RUN,), data=np.stack([m[RUN] for m in runs])
            )
        elif variable.dimensions == (name,):
            stacked[name] = variable
        elif all(name in run for run in runs):
            data = np.stack([run[name] for run in runs])
            stacked[name] = variable._replace(dimensions=(RUN, *variable.dimensions), data=data)
    return Motions(stacked, runs[0].attributes)
