"""The file of one run in netCDF-4 compatible HDF5, described in `results/README.md`."""

from pathlib import Path

import h5py
import numpy as np

from rbstab.store.atomic import write_atomically
from rbstab.store.digest import digest_of
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.opening import check_version, get_array, open_hdf5, to_python
from rbstab.store.result import SCHEMA_VERSION, Result, Variable, coordinate_name
from rbstab.store.seal import add_seal, check_seal, has_seal
from rbstab.store.table import check_shape

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
    """
    path = Path(path)
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
    """Read a result.

    Raises:
        NewerSchemaError: The file was written by a newer rbstab.
        NotAResultError: The file is damaged, or is not a result of rbstab.
        StoreError: The file cannot be opened.
    """
    path = Path(path)
    # Checked before HDF5 reads the file. Old files, and files changed by another program, have no
    # seal. They are checked by the digest in their attributes.
    if has_seal(path):
        check_seal(path)
    with open_hdf5(path) as file:
        return _read(path, file)


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
    is_text = variable.data.dtype.kind in "OUT"
    data = variable.data.astype(object) if is_text else variable.data
    group, _, short_name = name.rpartition("/")
    if group and group not in file:
        file.create_group(group, track_order=True)
    parent = file[group] if group else file
    dataset = parent.create_dataset(
        short_name, data=data, dtype=TEXT if is_text else None, track_order=True
    )
    dataset.attrs["units"] = variable.unit
    dataset.attrs["long_name"] = variable.long_name
    if is_scale:
        dataset.make_scale(short_name)
        return
    for index, dimension in enumerate(variable.dimensions):
        dataset.dims[index].attach_scale(parent[dimension])


def _read(path: Path, file: h5py.File) -> Result:
    check_version(path, file, SCHEMA_VERSION)
    attributes = {name: to_python(value) for name, value in file.attrs.items()}
    missing = [name for name in REQUIRED_ATTRIBUTES if name not in attributes]
    if missing or "config" not in file:
        raise NotAResultError(f"{path} is damaged: {', '.join(missing) or 'config'} is missing")
    del attributes["schema_version"]
    written = attributes.pop("digest")
    variables = {
        name: _variable(path, file, name) for name in _array_names(file) if name != "config"
    }
    result = Result(variables, attributes, get_array(path, file, "config").asstr()[()])
    if digest_of(result) != written:
        raise NotAResultError(f"{path} is damaged: its content does not match its digest")
    return result


def _variable(path: Path, file: h5py.File, name: str) -> Variable:
    dataset = get_array(path, file, name)
    is_text = h5py.check_string_dtype(dataset.dtype) is not None
    data = dataset.asstr()[()] if is_text else dataset[()]
    short_name = name.rpartition("/")[2]
    dimensions = (short_name,) if dataset.is_scale else _dimensions(dataset)
    attributes = dataset.attrs
    unit, long_name = (str(attributes.get(key, "")) for key in ("units", "long_name"))
    return Variable(dimensions, np.asarray(data), unit, long_name)


def _array_names(file: h5py.File) -> list[str]:
    """Return the names of the arrays of a file; in a group they start with its name.

    Names of other objects are returned, too; reading them raises an error.
    """
    hard_links = [name for name in file if isinstance(file.get(name, getlink=True), h5py.HardLink)]
    # Low-level calls, because creating h5py objects takes most of the time of reading a file.
    kinds = {name: h5py.h5o.get_info(file.id, name.encode()).type for name in hard_links}
    groups = [n for n, kind in kinds.items() if kind == h5py.h5o.TYPE_GROUP and len(file[n])]
    return [name for name in file if name not in groups] + [
        f"{group}/{name}" for group in groups for name in file[group]
    ]


def _dimensions(dataset: h5py.Dataset) -> tuple[str, ...]:
    """Return the name of the first scale of each axis."""
    return tuple(_scale_name(dataset, axis) for axis in range(dataset.ndim))


def _scale_name(dataset: h5py.Dataset, axis: int) -> str:
    names: list[bytes] = []
    h5py.h5ds.iterate(dataset.id, axis, lambda scale: names.append(h5py.h5i.get_name(scale)))
    return names[0].decode().rpartition("/")[2]
