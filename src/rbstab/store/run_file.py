"""One run, one file: netCDF-4 compatible HDF5, described in `results/README.md`."""

from pathlib import Path

import h5py
import numpy as np

from rbstab.store.atomic import write_atomically
from rbstab.store.digest import digest_of
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.opening import array_of, check_version, opened, plain
from rbstab.store.result import SCHEMA_VERSION, Result, Variable, beside
from rbstab.store.seal import check_seal, has_seal, sealed

TEXT = h5py.string_dtype("utf-8")

NEEDED_ATTRIBUTES = ("title", "status", "run_id", "engine", "digest")


def write_result(path: str | Path, result: Result, *, replace: bool = False) -> None:
    """Writes a result; the file appears whole or not at all.

    Args:
        path: The file. Missing folders are made.
        result: What to write.
        replace: Whether an existing file gives way.

    Raises:
        ResultExistsError: The file exists and `replace` is not set.
        StoreError: The operating system refused (full disk, no permission, ...).
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, sealed(_image(result)), replace=replace)
    except FileExistsError as error:
        # mkdir's word for a file where a folder should be.
        raise StoreError(f"{path} cannot be written: Not a directory") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreError(f"{path} cannot be written: {reason}") from error


def open_result(path: str | Path) -> Result:
    """Reads a result.

    Raises:
        NewerSchemaError: It was written by a newer rbstab.
        NotAResultError: It is damaged, or no result of rbstab.
        StoreError: It cannot be opened.
    """
    path = Path(path)
    # Before HDF5 sees it. A file that another program has changed has none any more, and older ones
    # never had: of these the digest among the attributes says whether they are whole.
    if has_seal(path):
        check_seal(path)
    with opened(path) as file:
        return _read(path, file)


def _image(result: Result) -> bytes:
    """The bytes of the file, made in memory: HDF5 on a full disk can take the process with it."""
    with h5py.File("result.h5", "w", driver="core", backing_store=False, track_order=True) as file:
        arrays = result.variables
        dimensions = {beside(name, own) for name, v in arrays.items() for own in v.dimensions}
        # Scales first: a netCDF reader numbers dimensions in this order.
        for name in sorted(arrays, key=lambda name: name not in dimensions):
            _put(file, name, arrays[name], is_scale=name in dimensions)
        file.create_dataset("config", data=result.config, dtype=TEXT, track_order=True)
        file["config"].attrs["long_name"] = "resolved config, YAML"
        file.attrs["schema_version"] = SCHEMA_VERSION
        for name, value in result.attributes.items():
            file.attrs[name] = value
        file.attrs["digest"] = digest_of(result)
        file.flush()
        image: bytes = file.id.get_file_image()
        return image


def _put(file: h5py.File, name: str, variable: Variable, *, is_scale: bool) -> None:
    is_text = variable.data.dtype.kind in "OUT"
    data = variable.data.astype(object) if is_text else variable.data
    group, _, own = name.rpartition("/")
    if group and group not in file:
        file.create_group(group, track_order=True)
    place = file[group] if group else file
    dataset = place.create_dataset(
        own, data=data, dtype=TEXT if is_text else None, track_order=True
    )
    dataset.attrs["units"] = variable.unit
    dataset.attrs["long_name"] = variable.long_name
    if is_scale:
        dataset.make_scale(own)
        return
    for index, dimension in enumerate(variable.dimensions):
        dataset.dims[index].attach_scale(place[dimension])


def _read(path: Path, file: h5py.File) -> Result:
    check_version(path, file, SCHEMA_VERSION)
    attributes = {name: plain(value) for name, value in file.attrs.items()}
    missing = [name for name in NEEDED_ATTRIBUTES if name not in attributes]
    if missing or "config" not in file:
        raise NotAResultError(f"{path} is damaged: {', '.join(missing) or 'config'} is missing")
    del attributes["schema_version"]
    written = attributes.pop("digest")
    variables = {name: _variable(path, file, name) for name in _names(file) if name != "config"}
    result = Result(variables, attributes, array_of(path, file, "config").asstr()[()])
    if digest_of(result) != written:
        raise NotAResultError(f"{path} is damaged: it is not what was written (by its digest)")
    return result


def _variable(path: Path, file: h5py.File, name: str) -> Variable:
    dataset = array_of(path, file, name)
    is_text = h5py.check_string_dtype(dataset.dtype) is not None
    data = dataset.asstr()[()] if is_text else dataset[()]
    own = name.rpartition("/")[2]
    dimensions = (own,) if dataset.is_scale else _dimensions(dataset)
    notes = dataset.attrs
    unit, long_name = (str(notes.get(key, "")) for key in ("units", "long_name"))
    return Variable(dimensions, np.asarray(data), unit, long_name)


def _names(file: h5py.File) -> list[str]:
    """The arrays of a file, those of a group with its name before theirs.

    What is neither keeps its name, and is refused when it is read.
    """
    hard = [name for name in file if isinstance(file.get(name, getlink=True), h5py.HardLink)]
    # Asked below h5py's objects, whose making takes most of the time of reading a file.
    kinds = {name: h5py.h5o.get_info(file.id, name.encode()).type for name in hard}
    groups = [n for n, kind in kinds.items() if kind == h5py.h5o.TYPE_GROUP and len(file[n])]
    return [name for name in file if name not in groups] + [
        f"{group}/{name}" for group in groups for name in file[group]
    ]


def _dimensions(dataset: h5py.Dataset) -> tuple[str, ...]:
    """The names of the first scale of each axis."""
    return tuple(_scale_name(dataset, axis) for axis in range(dataset.ndim))


def _scale_name(dataset: h5py.Dataset, axis: int) -> str:
    names: list[bytes] = []
    h5py.h5ds.iterate(dataset.id, axis, lambda scale: names.append(h5py.h5i.get_name(scale)))
    return names[0].decode().rpartition("/")[2]
