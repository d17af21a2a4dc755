"""A result in memory: named arrays with dimensions, and attributes."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from rbstab.store.array_names import no_such_array
from rbstab.store.cards import card, curve, line
from rbstab.store.variables import (
    Variable,
    dataset_of,
    flat_columns,
    frame_of,
    make_read_only,
)

if TYPE_CHECKING:
    import pandas
    import xarray

SHOWN = {
    "status": "status",
    "verdict": "checks",
    "convergence": "convergence",
    "variant": "variant",
    "engine": "engine",
}
"""The attributes that a result shows of itself, if it has them, and what they are called there."""

WORDS_OF_VERDICTS = {
    "certified": "proved",
    "consistent": "seen",
    # All checks hold; v may rise, and what rises is supplied.
    "driven": "seen",
    "violated": "false",
    "unknown": "not decided",
}
"""By each word of the attribute `verdict`: the word that people read (`Sureness`). Files keep
theirs, so that older and newer versions read the same."""

CURVE = ("time", "lyapunov")
"""The arrays of the curve that a result shows of itself."""


@dataclass(frozen=True, repr=False)
class Result:
    """The stored result of one run; users have it as `rbstab.Result`, where its parts are named."""

    variables: dict[str, Variable]
    attributes: dict[str, str | int | float]
    config: str = field(repr=False)

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        make_read_only(variable.data for variable in self.variables.values())

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the array with this name, such as "orientation", in SI units.

        Raises:
            KeyError: The result has no such array.
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

    def __repr__(self) -> str:
        """Return one line: title, status, what the checks found, size."""
        facts = [f"{name} {value}" for name, value in self._facts()]
        return line("Result", str(self.attributes.get("title", "")), [*facts, self._size()])

    def _repr_html_(self) -> str:
        """Return a card for notebooks: the same facts, and v over time."""
        facts = self._facts()
        title = str(self.attributes.get("title", ""))
        plot = ""
        if all(name in self for name in CURVE):
            x, y = (self.variables[name] for name in CURVE)
            if x.data.ndim == 1 and x.data.shape == y.data.shape:
                plot = curve(x.data, y.data, f"{CURVE[1]} [{y.unit}] over {CURVE[0]} [{x.unit}]")
        return card("Result", title, [*facts, ("content", self._size())], plot)

    def _facts(self) -> list[tuple[str, str]]:
        """Return what the result shows of itself: names and words."""
        known = {name: str(self.attributes[name]) for name in SHOWN if name in self.attributes}
        if "verdict" in known:
            known["verdict"] = WORDS_OF_VERDICTS.get(known["verdict"], known["verdict"])
        reason = str(self.attributes.get("convergence_reason", "")).partition(";")[0]
        if known.get("convergence") == "not decided" and reason:
            known["convergence"] += f" ({reason})"
        return [(SHOWN[name], value) for name, value in known.items()]

    def _size(self) -> str:
        arrays = f"{len(self.variables)} arrays"
        return f"{len(self['time'])} samples, {arrays}" if "time" in self else arrays

    @property
    def status(self) -> str:
        """How the run ended, as text; one of the values of `RunStatus`."""
        return str(self.attributes["status"])

    @property
    def run_id(self) -> str:
        """The run id, 32 hexadecimal digits of the SHA-256 of the resolved config."""
        return str(self.attributes["run_id"])

    def to_xarray(self, group: str = "") -> "xarray.Dataset":
        """Return the numbers as an `xarray.Dataset` (needs the package xarray).

        Texts are attributes, also the config. Where a text array has a dimension, its words become
        codes: `flag_meanings` lists the words (CF conventions).

        Args:
            group: The group to return; by default the arrays without a group.

        Raises:
            ImportError: xarray is not installed.
        """
        arrays = {
            name.removeprefix(f"{group}/"): variable
            for name, variable in self.variables.items()
            if name.rpartition("/")[0] == group
        }
        return dataset_of(arrays, {} if group else self.attributes | {"config": self.config})

    def to_pandas(self) -> "pandas.DataFrame":
        """Return one row a sample: the arrays along `time` (needs the package pandas).

        The index is `time`, s. Vectors are split: `orientation_0`, `energy_kinetic`. The units are
        in `attrs["units"]`.

        Raises:
            ImportError: pandas is not installed.
        """
        return frame_of(flat_columns(self.variables, ("time",)), "time")
