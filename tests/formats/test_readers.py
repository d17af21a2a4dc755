"""Protects other readers: all readers of HDF5 and netCDF-4 find equal values, units and texts."""

import netCDF4
import numpy as np
import pytest
import xarray
from support.results import assert_equal

from rbstab.store.result import open_result

FILE_ONLY = ("format", "kind")
"""Attributes of the file, not of the run."""


def ungrouped(result):
    return {name: v for name, v in result.variables.items() if "/" not in name}


def grouped(result):
    return [name for name in result.variables if "/" in name]


def certificate_of(result):
    return {name.removeprefix("certificate/"): result.variables[name] for name in grouped(result)}


def same(found, expected):
    if expected.dtype == object:
        return np.asarray(found).tolist() == expected.tolist()
    return np.asarray(found).tobytes() == expected.tobytes()


def test_netcdf4(run):
    result, path = run
    with netCDF4.Dataset(path) as file:
        assert file.data_model == "NETCDF4"
        assert set(file.variables) == {*ungrouped(result), "config"}
        assert set(file["certificate"].variables) == set(certificate_of(result))
        sizes = {name: len(dimension) for name, dimension in file.dimensions.items()}
        assert sizes == {
            "axis": 3,
            "part": len(result["part"]),
            "time": len(result["time"]),
        }
        for name, variable in result.variables.items():
            found = file[name]
            assert found.dimensions == variable.dimensions, name
            assert (found.units, found.long_name) == (variable.unit, variable.long_name)
            found.set_auto_mask(False)
            assert same(found[...], variable.data), name
        assert str(file["config"][...]) == result.config
        assert {k: file.getncattr(k) for k in result.attributes} == result.attributes


def decoded(codes):
    """Return the words of codes, which the CF conventions write without blanks."""
    assert codes.attrs["flag_values"].tolist() == list(range(codes.max().item() + 1))
    words = [word.replace("_", " ") for word in codes.attrs["flag_meanings"].split()]
    return np.array(words, dtype=object)[codes.values]


def assert_dataset(dataset, result):
    assert set(dataset.variables) == {*ungrouped(result), "config"}
    assert set(dataset.coords) == {"time", "axis", "part"}
    assert_arrays(dataset, ungrouped(result))
    assert isinstance(dataset["config"].item(), str)
    assert dataset["config"].item() == result.config
    attributes = {k: v for k, v in dataset.attrs.items() if k not in FILE_ONLY}
    assert attributes == result.attributes


def assert_arrays(dataset, variables):
    for name, variable in variables.items():
        found = dataset[name]
        assert found.dims == variable.dimensions, name
        assert found.attrs == {"units": variable.unit, "long_name": variable.long_name}
        if variable.data.dtype == object:
            assert [str(x) for x in found.values] == variable.data.tolist()
            assert all(isinstance(x, str) for x in found.values)
        else:
            assert same(found.values, variable.data), name


def test_the_certificate_is_a_group(run):
    result, path = run
    for engine in ("h5netcdf", "netcdf4"):
        with xarray.open_dataset(path, engine=engine, group="certificate") as dataset:
            assert set(dataset.variables) == set(certificate_of(result))
            assert set(dataset.coords) == {"check"}
            assert_arrays(dataset, certificate_of(result))
    ours = result.to_xarray("certificate")
    assert set(ours.variables) == set(certificate_of(result))
    for name, found in ours.data_vars.items():
        expected = result[f"certificate/{name}"]
        assert same(decoded(found) if expected.dtype == object else found.values, expected), name


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray(run, engine):
    result, path = run
    assert_equal(open_result(path), result)
    with xarray.open_dataset(path, engine=engine) as dataset:
        assert_dataset(dataset, result)


def test_the_dataset_from_memory_is_the_one_from_the_file(run):
    """In the file the config is an array; in memory it is an attribute."""
    result, path = run
    ours = open_result(path).to_xarray()
    assert ours.attrs == result.attributes | {"config": result.config}
    with xarray.open_dataset(path, engine="h5netcdf") as dataset:
        assert dataset.drop_vars("config").equals(ours)
