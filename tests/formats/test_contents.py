"""Protects the content of a result file: arrays, dimensions, units, attributes, and HDF5 layout."""

from importlib.metadata import version

import h5py
import numpy as np
import pytest
import xarray
from support.results import assert_equal

from rbstab.config.load import load_config, run_id
from rbstab.store.result import open_result

TIME, VECTOR, PARTS = ("time",), ("time", "axis"), ("time", "part")

REQUIRED = {
    "time": (TIME, "s"),
    "orientation": (VECTOR, "rad"),
    "angular_velocity": (VECTOR, "rad/s"),
    "position": (VECTOR, "m"),
    "velocity": (VECTOR, "m/s"),
    "contact_displacement": (VECTOR, "m"),
    "contact_velocity": (VECTOR, "m/s"),
    "contact_force": (VECTOR, "N"),
    "stabilizing_force": (VECTOR, "N"),
    "stabilizing_couple": (VECTOR, "N m"),
    "lyapunov": (TIME, "J"),
    "lyapunov_rate": (TIME, "W"),
    "energy": (PARTS, "J"),
    "dissipation": (PARTS, "W"),
    "energy_residual": (TIME, "J"),
    "axis": (("axis",), "1"),
    "part": (("part",), "1"),
}

MANIFOLD = {
    "constraint_position_residual": (TIME, "m"),
    "constraint_velocity_residual": (TIME, "m/s"),
}


def test_variables(run, kind):
    result, path = run
    assert_equal(open_result(path), result)
    # A file with five samples consists mostly of names and units: in HDF5, and in its index.
    assert path.stat().st_size < 60_000
    stored = open_result(path).variables
    required = dict(REQUIRED)
    if kind == "embedded":
        required["connector_state"] = (VECTOR, "m")
    if kind == "manifold":
        required |= MANIFOLD
    for name, (dimensions, unit) in required.items():
        assert (stored[name].dimensions, stored[name].unit) == (dimensions, unit), name
    others = {"connector_state", *MANIFOLD} - set(required)
    assert not others & set(stored)
    for name, variable in stored.items():
        assert len(variable.long_name) > 5, name
        # A run that does not settle has no time at which it does.
        may_be_none = name.startswith(("certificate/", "settling_time"))
        if variable.data.dtype.kind == "f" and not may_be_none:
            assert np.isfinite(variable.data).all(), name
    parts = ["kinetic", "gravity", "translational stabilizer", "rotational stabilizer"]
    tied = kind not in {"free", "permanent", "manifold"}
    assert stored["part"].data.tolist() == parts + ["connector"] * tied
    assert stored["axis"].data.tolist() == [1, 2, 3]


ATTRIBUTES = {
    "title": str,
    "variant": str,
    "status": str,
    "status_detail": str,
    "warnings": str,
    "run_id": str,
    "engine": str,
    "rbstab_version": str,
    "commit": str,
    "python_version": str,
    "numpy_version": str,
    "h5py_version": str,
    "created": str,
    "steps": int,
    "evaluations": int,
    "wall_time": float,
}


def test_attributes(run, kind):
    _, path = run
    stored = open_result(path).attributes
    for name, expected in ATTRIBUTES.items():
        assert type(stored[name]) is expected, name
    engine = "heyoka" if kind == "compiled" else "scipy"
    assert stored["engine"] == engine
    assert {"scipy_version", "heyoka_version"} & set(stored) == {f"{engine}_version"}
    assert stored["title"] == "Case"
    assert stored["rbstab_version"] == version("rbstab")
    assert stored["numpy_version"] == version("numpy")
    assert stored[f"{engine}_version"] == version(engine)
    with h5py.File(path) as file:
        assert (file.attrs["format"], file.attrs["kind"]) == (1, "the result of a run")
        assert isinstance(file.attrs["format"], np.integer)


def test_status(run, kind, tmp_path):
    _, path = run
    stored = open_result(path)
    copy = tmp_path / "again.yaml"
    copy.write_text(stored.config, encoding="utf-8")
    assert run_id(load_config(copy)) == stored.run_id
    if kind == "stopped":
        assert stored.status == "range left"
        detail = stored.attributes["status_detail"]
        assert isinstance(detail, str)
        assert "cos θ2 fell to 0.001 at t = " in detail
        # It starts 2.6e-5 rad inside.
        first, end = stored["time"].tolist()
        assert first == 0.0 < end < 1e-4
    else:
        assert stored.status == "completed"
        assert stored.attributes["status_detail"] == ""
        assert stored["time"] == pytest.approx([0, 0.005, 0.01, 0.015, 0.02], abs=1e-16)
        for name in ("steps", "evaluations", "wall_time"):
            number = stored.attributes[name]
            assert isinstance(number, int | float)
            assert number > 0


def test_xarray_finds_in_the_file_what_it_gets_from_memory(run):
    """In the file the config is an array; in memory it is an attribute."""
    result, path = run
    in_memory = result.to_xarray()
    assert in_memory.attrs == result.attributes | {"config": result.config}
    for engine in ("h5netcdf", "netcdf4"):
        with xarray.open_dataset(path, engine=engine) as dataset:
            assert dataset["config"].item() == result.config
            assert dataset.drop_vars("config").equals(in_memory)
        with xarray.open_dataset(path, engine=engine, group="certificate") as group:
            names = {f"certificate/{name}" for name in group.variables}
            assert names == {name for name in result.variables if "/" in name}
            for name, array in group.data_vars.items():
                assert array.values.tolist() == pytest.approx(
                    result[f"certificate/{name}"].tolist(), nan_ok=True
                )
