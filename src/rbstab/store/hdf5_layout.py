"""Lay out an HDF5 file in memory, so that HDF5 itself never writes to a disk.

h5py drops the errors of writes that HDF5 makes while it closes an object, and HDF5 may end the
process if a disk fills. So HDF5 writes into memory: all metadata and texts. For the other arrays it
only reserves space. The caller writes everything to the disk, and sees every error.
"""

from threading import get_ident
from typing import NamedTuple

import h5py
import numpy as np

from rbstab.store.dataset import Dataset
from rbstab.store.variables import Variable, described

TEXT = h5py.string_dtype("utf-8")


class Layout(NamedTuple):
    """The layout of an HDF5 file.

    Attributes:
        pieces: Ascending and without gaps: the bytes that HDF5 wrote, and the names of the arrays
            for which it reserved space.
        offsets: The first byte of each array of numbers, by name; 0 if it is empty.
    """

    pieces: tuple[bytes | str, ...]
    offsets: dict[str, int]


def layout_of(dataset: Dataset, format_: int) -> Layout:
    """Lay out a dataset as a netCDF-4 file.

    Args:
        dataset: The dataset. Its arrays of numbers are in the byte order of the file.
        format_: The version of the format.

    Raises:
        ValueError: An array has another shape than its coordinates.
    """
    scales, arrays = _scales(dataset), dataset.variables
    # Two threads cannot have a file of one name, although it is only in memory.
    name = f"layout {get_ident()}"
    with h5py.File(name, "w", driver="core", backing_store=False, track_order=True) as file:
        for group in dict.fromkeys(name.rpartition("/")[0] for name in arrays):
            if group:
                file.create_group(group, track_order=True)
        # The scales come first, because netCDF readers number dimensions in this order.
        for name, v in {**scales, **arrays}.items():
            if v.is_text:
                data = v.data.astype(object)
                added = file.create_dataset(name, data=data, dtype=TEXT, track_order=True)
            elif name in arrays:
                added = _reserve(file, name, v)
            else:
                added = file.create_dataset(name, data=v.data, track_order=True)
            added.attrs.update(described(v))
            if name in scales:
                added.make_scale(name.rpartition("/")[2])
                continue
            for axis, dimension in enumerate(v.dimensions):
                added.dims[axis].attach_scale(file[_coordinate_name(name, dimension)])
        file.attrs.update({**dataset.attributes, "format": format_, "kind": dataset.kind})
        file.flush()
        image = file.id.get_file_image()
        numbers = {name: v.data.nbytes for name, v in arrays.items() if not v.is_text}
        offsets = {name: file[name].id.get_offset() or 0 for name in numbers}
    pieces, end = list[bytes | str](), 0
    for offset, name in sorted((offsets[name], name) for name, size in numbers.items() if size):
        pieces += [image[end:offset], name]
        end = offset + numbers[name]
    return Layout((*pieces, image[end:]), offsets)


def _reserve(file: h5py.File, name: str, variable: Variable) -> h5py.Dataset:
    """Create an array whose data the caller will write."""
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_layout(h5py.h5d.CONTIGUOUS)
    properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    properties.set_obj_track_times(False)
    properties.set_attr_creation_order(h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED)
    kind = h5py.h5t.py_create(variable.data.dtype)
    space = h5py.h5s.create_simple(variable.data.shape)
    return h5py.Dataset(h5py.h5d.create(file.id, name.encode(), kind, space, properties))


def _scales(dataset: Dataset) -> dict[str, Variable]:
    """Return the coordinates of all dimensions; where there is none, the numbers of the entries."""
    coordinates, arrays = dict[str, Variable](), dataset.variables
    for name, v in arrays.items():
        if len(v.dimensions) != v.data.ndim:
            raise ValueError(f"{name} has {v.data.ndim} dimensions (expected {len(v.dimensions)})")
        for dimension, length in zip(v.dimensions, v.data.shape, strict=True):
            scale, numbers = _coordinate_name(name, dimension), np.arange(1, length + 1)
            made = Variable((dimension,), numbers, "1", f"number of the {dimension}")
            coordinates.setdefault(scale, arrays.get(scale, made))
    for name, v in arrays.items():
        lengths = tuple(
            len(coordinates[_coordinate_name(name, axis)].data) for axis in v.dimensions
        )
        if v.data.shape != lengths:
            raise ValueError(f"{name} has the shape {v.data.shape} (expected {lengths})")
    return coordinates


def _coordinate_name(name: str, dimension: str) -> str:
    """Return the name of the coordinate of an array's dimension; it is in the array's group."""
    group, slash, _ = name.rpartition("/")
    return f"{group}{slash}{dimension}"
