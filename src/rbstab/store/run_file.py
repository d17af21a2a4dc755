"""The file of one run in netCDF-4 compatible HDF5, described in `results/README.md`."""

from pathlib import Path
from typing import TYPE_CHECKING

import h5py

from rbstab.store.digest import digest_of
from rbstab.store.disk.atomic import write_atomically
from rbstab.store.disk.isolated_reading import IsolatedReader
from rbstab.store.disk.seal import add_seal, has_seal
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.held_files import check_unchanged
from rbstab.store.result import SCHEMA_VERSION, Result
from rbstab.store.variables import Variable, check_shape, coordinate_name

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rbstab.store.reading.hdf5_reader import Hdf5Reader

TEXT = h5py.string_dtype("utf-8")

REQUIRED_ATTRIBUTES = ("title", "status", "run_id", "engine", "digest")


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
    path = Path(path)
    if not isinstance(result, Result):
        raise TypeError(f"the result is of type {type(result).__name__} (expected a Result)")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, add_seal(_file_bytes(result)), replace=replace)
    except FileExistsError as error:
        # mkdir raises this error if a file has the name of a folder.
        raise StoreError(f"{path} cannot be written: Not a directory") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreError(f"{path} cannot be written: {reason}") from error


def open_result(path: str | Path) -> Result:
    """Read the result of a run from its file; see `rbstab.open_result`.

    Raises:
        NewerSchemaError: The file was written by a newer rbstab.
        NotAResultError: The file is damaged, or is not a result of rbstab.
        StoreError: The file cannot be opened.
    """
    path = Path(path)
    if has_seal(path):
        check_unchanged(path)
        return _open_here(path, is_sealed=True)
    # Old files, and files changed by another program, have no seal. Only HDF5 can read the digest
    # in their attributes, and on a damaged file it may hang.
    result: Result = _open_isolated(path)
    return result


def _open_here(path: Path, *, is_sealed: bool = False) -> Result:
    # Imported late: a new run only writes.
    from rbstab.store.reading.opening import open_hdf5

    with open_hdf5(path) as file:
        return _read(file, is_sealed=is_sealed)


_open_isolated = IsolatedReader(_open_here)


def _file_bytes(result: Result) -> bytes:
    """Return the bytes of the file, built in memory, because HDF5 may crash on a full disk."""
    with h5py.File("result.h5", "w", driver="core", backing_store=False, track_order=True) as file:
        arrays = result.variables
        scales = {coordinate_name(name, d) for name, v in arrays.items() for d in v.dimensions}
        for name, variable in arrays.items():
            scales_of_array = (coordinate_name(name, d) for d in variable.dimensions)
            lengths = (arrays[scale].data.shape[0] for scale in scales_of_array)
            check_shape(name, variable.data, tuple(lengths))
        # The scales come first, because netCDF readers number dimensions in this order.
        for name in sorted(arrays, key=lambda name: name not in scales):
            _write_array(file, name, arrays[name], is_scale=name in scales)
        file.create_dataset("config", data=result.config, dtype=TEXT, track_order=True)
        file["config"].attrs["long_name"] = "resolved config, YAML"
        file.attrs["schema_version"] = SCHEMA_VERSION
        for name, value in result.attributes.items():
            file.attrs[name] = value
        file.attrs["digest"] = digest_of(result)
        file.flush()
        image: bytes = file.id.get_file_image()
        return image


def _write_array(file: h5py.File, name: str, variable: Variable, *, is_scale: bool) -> None:
    data = variable.data.astype(object) if variable.is_text else variable.data
    group, _, short_name = name.rpartition("/")
    if group and group not in file:
        file.create_group(group, track_order=True)
    parent = file[group] if group else file
    dataset = parent.create_dataset(
        short_name, data=data, dtype=TEXT if variable.is_text else None, track_order=True
    )
    dataset.attrs["units"] = variable.unit
    dataset.attrs["long_name"] = variable.long_name
    if is_scale:
        dataset.make_scale(short_name)
        return
    for index, dimension in enumerate(variable.dimensions):
        dataset.dims[index].attach_scale(parent[dimension])


def _read(file: "Hdf5Reader", *, is_sealed: bool = False) -> Result:
    # Imported late: a new run only writes.
    from rbstab.store.reading.known_places import content_at_known_places, remember_places

    path = file.path
    file.check_version(SCHEMA_VERSION)
    # Without a seal, an array may have been removed or replaced, and its numbers still be there.
    known = content_at_known_places(file) if is_sealed else None
    if known is not None:
        try:
            return _result(path, *known)
        except NotAResultError:
            pass  # it is not like the other file
    attributes = file.attributes()
    _check_complete(path, attributes)
    variables = {name: file.variable(name) for name in file.names()}
    result = _result(path, attributes, variables)
    if is_sealed:
        remember_places(file, attributes, variables)
    return result


def _result(
    path: Path,
    attributes: "Mapping[str, str | int | float]",
    variables: "Mapping[str, Variable]",
) -> Result:
    """Return a result with these attributes and arrays, of which one is its config.

    Raises:
        NotAResultError: The digest among the attributes is that of another result.
    """
    if "config" not in variables:
        raise NotAResultError(f"{path} is damaged: config is missing")
    config = variables["config"].data
    if config.shape != () or not isinstance(config.item(), str):
        raise NotAResultError(f"{path} is damaged: its config is not a text")
    facts = {name: value for name, value in attributes.items() if name != "digest"}
    arrays = {name: variable for name, variable in variables.items() if name != "config"}
    result = Result(arrays, facts, config.item())
    if digest_of(result) != attributes["digest"]:
        raise NotAResultError(f"{path} is damaged: its content does not match its digest")
    return result


def _check_complete(path: Path, attributes: dict[str, str | int | float]) -> None:
    missing = [name for name in REQUIRED_ATTRIBUTES if name not in attributes]
    if missing:
        raise NotAResultError(f"{path} is damaged: {', '.join(missing)} is missing")
