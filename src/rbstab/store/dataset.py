"""A dataset in memory: named arrays with dimensions, and attributes. All results are datasets."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from rbstab.files.names import line
from rbstab.store.variables import Variable, dataset_of, make_read_only, no_such_array

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
