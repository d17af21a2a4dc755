"""Read a result that the user named; its content is checked, since it may be damaged or hostile."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.analysis.certificate.verdict import Check
from rbstab.elements.declarations import OwnState
from rbstab.experiment.stored_run import own_states_of
from rbstab.files.text import shell_word
from rbstab.report.model.words import untrusted
from rbstab.report.reading.kinds import Kind, kind_of, not_a_result, sweep_folder_of
from rbstab.store.disk.paths import path_is_file
from rbstab.store.errors import NotAResultError
from rbstab.store.result import Result, open_result
from rbstab.store.variables import Variable
from rbstab.sweep.folder.sweep_folder import SWEEP_FILE, read_folder, unfinished_error
from rbstab.sweep.folder.sweep_table import check_sweep
from rbstab.systems.quantities import QUANTITIES, RUN_DIMENSIONS, Quantity, state_quantity

# fmt: off
NEEDED = frozenset((
    "time", "part", "orientation", "angular_velocity", "position", "velocity",
    "contact_displacement", "contact_velocity", "contact_force", "stabilizing_force",
    "stabilizing_couple", "lyapunov", "lyapunov_rate", "lyapunov_change", "energy", "dissipation",
    "energy_residual", "energy_at_rest", "energy_round_off", "rest_orientation", "rest_position",
))
# fmt: on
"""The arrays that every file has. Old files lack the quantities that were added later."""

TEXTS = (
    *("transition_kind", "part"),
    *(f"certificate/{column}" for column in ("check", "verdict", "quantity")),
)
"""The arrays that are text; the others are numbers."""


def file_of(path: Path) -> Path:
    """Return the file to read: that of a run, or the members file of a sweep.

    Raises:
        StoreError: The path is neither, or the sweep is not finished.
    """
    kind = kind_of(path)
    if kind is Kind.RUN:
        return path
    if kind is Kind.FOLDER:
        raise NotAResultError(
            f"{path} is a folder, but not a sweep, and no result is in it; `rbstab run CONFIG -o "
            f"{shell_word(path)}` stores one"
        )
    if kind is not Kind.SWEEP:
        raise NotAResultError(not_a_result(path, kind))
    folder = sweep_folder_of(path)
    if path_is_file(folder / SWEEP_FILE):
        return folder / SWEEP_FILE
    raise unfinished_error(read_folder(folder))


def result_of(file: Path) -> Result | None:
    """Return the result of a run; None if the file is that of a sweep, which is read later.

    Raises:
        StoreError: The file holds neither a run nor a sweep, or cannot be read.
    """
    if kind_of(file) is Kind.SWEEP:
        check_sweep(file)
        return None
    result = open_result(file)
    _check_arrays(file, result)
    return _printable(result)


def _check_arrays(file: Path, result: Result) -> None:
    """Check that a result has the arrays of a run, with the right types and shapes."""
    lengths = dict(RUN_DIMENSIONS)
    element_states = [_own_state(name, result.variables[name]) for name in own_states_of(result)]
    for name, dimensions in (
        *((quantity.name, quantity.dimensions) for quantity in (*QUANTITIES, *element_states)),
        ("part", ("part",)),
        *((f"certificate/{column}", ("check",)) for column in Check._fields),
    ):
        variable = result.variables.get(name)
        if variable is None and name in NEEDED:
            raise NotAResultError(f"{file} is damaged: it has no array {name}")
        if variable is None:
            continue
        fits = variable.dimensions == dimensions
        fits &= variable.data.dtype.kind in ("O" if name in TEXTS else "fiu")
        for dimension, length in zip(variable.dimensions, variable.data.shape, strict=fits):
            fits &= length > 0 and lengths.setdefault(dimension, length) == length
        if not fits:
            raise NotAResultError(f"{file} is damaged: its array {name} has a wrong type or shape")


def _own_state(name: str, variable: Variable) -> Quantity:
    """Return what an array must be, if it is the own state of a named element."""
    size = variable.data.shape[1] if variable.data.ndim == 2 else 0
    symbol, _, meaning = variable.long_name.partition(": ")
    return state_quantity(OwnState(name, symbol, variable.unit, meaning, size))


def _printable(result: Result) -> Result:
    """Return the result with all its texts escaped by `untrusted`."""
    attributes: dict[str, Any] = {
        name: "\n".join(map(untrusted, value.splitlines())) if isinstance(value, str) else value
        for name, value in result.attributes.items()
    }
    variables = {name: _printable_variable(variable) for name, variable in result.variables.items()}
    return replace(result, attributes=attributes, variables=variables)


def _printable_variable(variable: Variable) -> Variable:
    data = variable.data
    if data.dtype.kind in "OUT":
        words = [untrusted(word) for word in data.ravel().tolist()]
        data = np.array(words, dtype=object).reshape(data.shape)
    unit, long_name = untrusted(variable.unit), untrusted(variable.long_name)
    return variable._replace(data=data, unit=unit, long_name=long_name)
