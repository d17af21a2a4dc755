"""Protects the structure of tables and files of motions: what netCDF-4 needs to read them."""

import h5py
import netCDF4
import numpy as np
import pytest

from rbstab.store.motions import Motions
from rbstab.store.motions_file import write_motions
from rbstab.store.table import Column, TableHeader
from rbstab.store.table_writer import write_table
from rbstab.store.variables import Variable

STEPS = Column((), "i4", "1", "steps")
END = Column(("axis",), "f8", "m", "X at the end")
STATES = Column(("two",), "f8", "m", "own states", lengths=(2,))
EXTRAS = {
    "grid_length": Variable(("grid_axis_number",), np.array([2, 2]), "1", "lengths"),
    "grid_axis": Variable(("grid_axis_number",), np.array(["a", "b"], object), "", "names"),
    "plan": Variable((), np.array("title: a", object), "", "plan, YAML"),
}


def write_small_table(path):
    layout = {"steps": STEPS, "end": END, "states": STATES}
    numbers = np.arange(4)
    arrays = {
        "steps": numbers.astype("i4"),
        "end": np.outer(numbers, [1.0, 2.0, 3.0]),
        "states": np.outer(numbers, [1.0, 2.0]),
    }
    write_table(path, TableHeader(layout, 0, 4, {}, EXTRAS), [arrays])


def write_small_motions(path):
    variables = {
        "run": Variable(("run",), np.array([3, 7]), "1", "number"),
        "time": Variable(("time",), np.linspace(0, 1, 4), "s", "time"),
        "energy": Variable(("run", "time"), np.ones((2, 4)), "J", "energy"),
    }
    write_motions(path, Motions(variables, {}))


WRITERS = [write_small_table, write_small_motions]


@pytest.mark.parametrize("write", WRITERS)
def test_every_dimension_has_a_scale_of_its_name_and_length(tmp_path, write):
    write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        scales = {axis[0].name.strip("/") for name in file for axis in file[name].dims if len(axis)}
        assert scales >= {"run"}
        for name, dataset in file.items():
            for axis, length in zip(dataset.dims, dataset.shape, strict=True):
                assert dataset.is_scale or len(axis[0]) == length, name
            if dataset.is_scale:
                assert h5py.h5ds.get_scale_name(dataset.id) == name.encode()


@pytest.mark.parametrize("write", WRITERS)
def test_the_order_of_all_names_and_attributes_is_tracked(tmp_path, write):
    """netCDF-4 requires it."""
    write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        names = h5py.h5g.open(file.id, b"/").get_create_plist().get_link_creation_order()
        orders = {
            name: dataset.id.get_create_plist().get_attr_creation_order()
            for name, dataset in file.items()
        }
    tracked = h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED
    assert names == tracked
    assert orders == dict.fromkeys(orders, tracked)


def test_entries_of_vectors_are_counted_from_one(tmp_path):
    write_small_table(tmp_path / "a.h5")
    with netCDF4.Dataset(tmp_path / "a.h5") as file:
        assert {name: len(dimension) for name, dimension in file.dimensions.items()} == {
            "run": 4,
            "axis": 3,
            "two": 2,
            "grid_axis_number": 2,
        }
        assert file["axis"][:].tolist() == [1, 2, 3]
        assert file["two"][:].tolist() == [1, 2]
        assert file["grid_axis_number"][:].tolist() == [1, 2]
        assert {file[name].units for name in file.dimensions} == {"1"}
