"""The result of one run, in memory and in its file, described in `results/README.md`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rbstab.store.dataset import Dataset
from rbstab.store.dataset_file import read_dataset, write_dataset
from rbstab.store.errors import NotAResultError
from rbstab.store.variables import Variable, dataset_of, flat_columns, frame_of

if TYPE_CHECKING:
    import pandas
    import xarray

RESULT = "the result of a run"
"""The kind of the files."""

REQUIRED_ATTRIBUTES = ("title", "status", "run_id", "engine")

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
"""By each word of the attribute `verdict`: the word that people read (`Sureness`)."""


@dataclass(frozen=True, repr=False)
class Result(Dataset):
    """The stored result of one run; users have it as `rbstab.Result`, where its parts are named."""

    variables: dict[str, Variable]
    attributes: dict[str, str | int | float]
    config: str = field(default="", repr=False)

    def _facts(self) -> list[str]:
        """Return the status, what the checks found, and the size."""
        texts = {name: str(self.attributes[name]) for name in SHOWN if name in self.attributes}
        if "verdict" in texts:
            texts["verdict"] = WORDS_OF_VERDICTS.get(texts["verdict"], texts["verdict"])
        reason = str(self.attributes.get("convergence_reason", "")).partition(";")[0]
        if texts.get("convergence") == "not decided" and reason:
            texts["convergence"] += f" ({reason})"
        return [*(f"{SHOWN[name]} {value}" for name, value in texts.items()), *super()._facts()]

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
        return dataset_of(arrays, {} if group else {**self.attributes, "config": self.config})

    def to_pandas(self) -> "pandas.DataFrame":
        """Return one row a sample: the arrays along `time` (needs the package pandas).

        The index is `time`, s. Vectors are split: `orientation_0`, `energy_kinetic`. The units are
        in `attrs["units"]`.

        Raises:
            ImportError: pandas is not installed.
        """
        return frame_of(flat_columns(self.variables, ("time",)), "time")


def write_result(path: str | Path, result: Result, *, replace: bool = False) -> None:
    """Write a result to a file atomically.

    Args:
        path: The file. Missing folders are created.
        result: The result.
        replace: Whether an existing file is replaced.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        StoreError: The file cannot be written (full disk, no permission, ...).
        TypeError: `result` is no result.
    """
    if not isinstance(result, Result):
        raise TypeError(f"the result is of type {type(result).__name__} (expected a Result)")
    config = Variable((), np.array(result.config, dtype=object), "", "resolved config, YAML")
    dataset = Dataset({**result.variables, "config": config}, result.attributes, kind=RESULT)
    write_dataset(Path(path), dataset, replace=replace)


def open_result(path: str | Path) -> Result:
    """Read the result of a run from its file; see `rbstab.open_result`.

    Raises:
        NewerSchemaError: The file was written by a newer rbstab.
        NotAResultError: The file is damaged, or is not a result of rbstab.
        StoreError: The file cannot be opened.
    """
    dataset = read_dataset(Path(path), RESULT, form=Result)
    config = dataset.variables.get("config")
    missing = [name for name in REQUIRED_ATTRIBUTES if name not in dataset.attributes]
    if missing or config is None:
        raise NotAResultError(f"{path} is damaged: {', '.join(missing) or 'config'} is missing")
    if config.data.shape != () or not config.is_text:
        raise NotAResultError(f"{path} is damaged: its config is not a text")
    arrays = {name: variable for name, variable in dataset.variables.items() if name != "config"}
    return Result(arrays, dict(dataset.attributes), config.data.item())
