"""What a named file or folder holds, read with no trust in it."""

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from rbstab.experiment.stored_certificate import CertificateLine
from rbstab.report.model.words import untrusted
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.result import Result, Variable
from rbstab.store.run_file import open_result
from rbstab.store.table_file import read_table
from rbstab.sweep.folder.sweep_folder import MANIFEST, SWEEP_FILE, read_folder, unfinished
from rbstab.systems.quantities import QUANTITIES

SWEEP: Literal["sweep"] = "sweep"
"""Stands for the content of a sweep, of which nothing is read before it is wanted."""

NOT_OF_EVERY_RUN = {
    "connector_state",
    "contact_work",
    "constraint_position_residual",
    "constraint_velocity_residual",
    "mode",
    "switch_count",
    "chatter_energy",
    "discarded_energy",
    "trusted_until",
    "switch_time",
    "switch_axis",
    "transition_time",
    "transition_axis",
    "transition_kind",
}
"""Quantities that only some variants, coordinates or versions store."""

WORDS = "transition_kind"
"""The one quantity that is words."""


def file_of(path: Path) -> Path:
    """The file to be read: that of a sweep where its folder is named.

    Raises:
        StoreError: It is another folder, or the sweep is not finished.
    """
    if not path.is_dir():
        return path
    file = path / SWEEP_FILE
    if file.is_file():
        return file
    if not (path / MANIFEST).exists():
        raise NotAResultError(
            f"{path} is a folder, but not that of a sweep; name the files in it, as {path}/*.h5"
        )
    raise unfinished(read_folder(path))


def content_of(file: Path) -> Result | Literal["sweep"]:
    """The run in a file, or `SWEEP`.

    Raises:
        StoreError: It is neither, or cannot be read.
    """
    try:
        result = open_result(file)
    except NotAResultError as error:
        # A sweep lacks what every run has.
        with suppress(NotAResultError):
            read_table(file, ())
            return SWEEP
        folder = file.absolute().parent.parent
        if (folder / MANIFEST).is_file():
            raise StoreError(f"{file} is a part of a sweep; name its folder, {folder}") from error
        raise
    _check_arrays(file, result)
    return _told(result)


def _check_arrays(file: Path, result: Result) -> None:
    """Refuses a result without the arrays that every run has, in their shapes."""
    lengths = {"axis": 3}
    for quantity in QUANTITIES:
        variable = result.variables.get(quantity.name)
        if variable is None and quantity.name in NOT_OF_EVERY_RUN:
            continue
        if variable is None:
            raise NotAResultError(f"{file} is damaged: it has no array {quantity.name}")
        kinds = "O" if quantity.name == WORDS else "fiu"
        fits = variable.dimensions == quantity.dimensions and variable.data.dtype.kind in kinds
        for dimension, length in zip(variable.dimensions, variable.data.shape, strict=fits):
            fits &= length > 0 and lengths.setdefault(dimension, length) == length
        if not fits:
            raise NotAResultError(f"{file} is damaged: its array {quantity.name} is not a run's")
    parts = result.variables.get("part")
    if parts is None or parts.data.shape != (lengths["part"],):
        raise NotAResultError(f"{file} is damaged: it does not name its parts")
    _check_certificate(file, result)


def _check_certificate(file: Path, result: Result) -> None:
    """Refuses a certificate whose columns do not belong together."""
    columns = [result.variables.get(f"certificate/{name}") for name in CertificateLine._fields]
    there = [column.data for column in columns if column is not None]
    kinds = "".join("O" if data.dtype.kind in "OUT" else "f" for data in there)
    if there and (kinds != "OOfffO" or len({data.shape for data in there}) > 1):
        raise NotAResultError(f"{file} is damaged: its certificate is not a run's")


def _told(result: Result) -> Result:
    """The same with every text of it fit to be shown."""
    attributes: dict[str, Any] = {
        name: "\n".join(map(untrusted, value.splitlines())) if isinstance(value, str) else value
        for name, value in result.attributes.items()
    }
    variables = {name: _told_variable(variable) for name, variable in result.variables.items()}
    return replace(result, attributes=attributes, variables=variables)


def _told_variable(variable: Variable) -> Variable:
    told = variable._replace(unit=untrusted(variable.unit), long_name=untrusted(variable.long_name))
    if variable.data.dtype.kind not in "OUT":
        return told
    words = [untrusted(word) for word in variable.data.ravel().tolist()]
    return told._replace(data=np.array(words, dtype=object).reshape(variable.data.shape))
