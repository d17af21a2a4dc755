"""The file of one run, described in `results/README.md`."""

from pathlib import Path

import numpy as np

from rbstab.store.dataset_file import Dataset, read_dataset, write_dataset
from rbstab.store.errors import NotAResultError
from rbstab.store.result import Result
from rbstab.store.variables import Variable

KIND = "the result of a run"

REQUIRED_ATTRIBUTES = ("title", "status", "run_id", "engine")


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
    dataset = Dataset(KIND, {**result.variables, "config": config}, result.attributes)
    write_dataset(Path(path), dataset, replace=replace)


def open_result(path: str | Path) -> Result:
    """Read the result of a run from its file; see `rbstab.open_result`.

    Raises:
        NewerSchemaError: The file was written by a newer rbstab.
        NotAResultError: The file is damaged, or is not a result of rbstab.
        StoreError: The file cannot be opened.
    """
    found = read_dataset(Path(path), KIND)
    variables, attributes = dict(found.variables), dict(found.attributes)
    config = variables.pop("config", None)
    missing = [name for name in REQUIRED_ATTRIBUTES if name not in attributes]
    if missing or config is None:
        raise NotAResultError(f"{path} is damaged: {', '.join(missing) or 'config'} is missing")
    if config.data.shape != () or not config.is_text:
        raise NotAResultError(f"{path} is damaged: its config is not a text")
    return Result(variables, attributes, config.data.item())
