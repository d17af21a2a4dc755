"""`rbstab export` writes runs and sweeps as tables, from which every bit comes back."""

import csv
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pandas as pd
import pytest
import xarray
from cli.conftest import rbstab, success
from scipy.io import loadmat
from support.made_runs import made_file
from support.results import AWKWARD
from support.sweeping import run_sweep
from support.sweeps import FakeEngine, plan_with_traces

from rbstab.listing.opening import open_result, open_sweep
from rbstab.listing.table_files import write_columns
from rbstab.store.variables import FlatColumns, flat_columns
from rbstab.sweep.folder.stored_traces import open_traces

pytestmark = pytest.mark.slow

FORMS = ("csv", "parquet", "mat")


@pytest.fixture
def sweep(folder):
    """The folder of a sweep of 12 members with traces, of which two diverged."""
    plan = plan_with_traces(12)
    run_sweep(folder / "swept", plan, factory=lambda plan: FakeEngine(plan, failing=(1, 7)))
    return folder / "swept"


def read_back(path, expected):
    """Return the columns of a file, read by another program, with the types that are expected."""
    if path.suffix == ".csv":
        with path.open(newline="", encoding="utf-8") as file:
            head, *rows = csv.reader(file)
        columns = dict(zip(head, map(list, zip(*rows, strict=True)), strict=True))
        return {
            name: np.array(columns[name], dtype=None if data.dtype == object else data.dtype)
            for name, data in expected.arrays.items()
        }
    if path.suffix == ".parquet":
        frame = pd.read_parquet(path)
        assert frame.attrs["units"] == expected.units
        return {name: data.to_numpy() for name, data in frame.reset_index().items()}
    content = {name: a for name, a in loadmat(path).items() if not name.startswith("__")}
    assert {a.shape[1] for a in content.values()} == {1}
    return {
        name: np.array(["".join(cell) for cell in a[:, 0]]) if a.dtype == object else a[:, 0]
        for name, a in content.items()
    }


def assert_same(path, expected):
    columns = read_back(path, expected)
    assert list(columns) == list(expected.arrays)
    for name, data in expected.arrays.items():
        if data.dtype == object:
            assert columns[name].tolist() == data.tolist(), name
        else:
            assert columns[name].astype(data.dtype).tobytes() == data.tobytes(), name


@pytest.mark.parametrize("form", FORMS)
def test_a_sweep_has_one_row_a_member(form, sweep):
    done = success("export", "swept", "-o", f"members.{form}")
    table = open_sweep(sweep)
    assert done.stdout.startswith(f"-> members.{form}: 12 rows, ")
    expected = table.flat()
    assert_same(Path(f"members.{form}"), expected)
    assert expected.arrays["status"].tolist().count("diverged") == 2
    assert sum(data.dtype.kind == "f" for data in expected.arrays.values()) > 30


@pytest.mark.parametrize("form", FORMS)
def test_awkward_numbers_and_texts_come_back(form, tmp_path):
    texts = ["", "a,b", 'say "Θ"', "two\nlines", "nan", "=1+1", *"cde"]
    assert len(AWKWARD) == len(texts) == 9
    arrays = {
        "number": np.array(AWKWARD),
        "text": np.array(texts, dtype=object),
        "whole": np.arange(9) - 2**62,
        "flag": np.arange(9) % 2 == 0,
    }
    columns = FlatColumns(arrays, {"number": "m"})
    write_columns(tmp_path / f"a.{form}", columns, form)
    if form == "csv":
        # `numpy` takes the words True and False for true.
        columns = columns._replace(arrays={**arrays, "flag": arrays["flag"].astype(str)})
    assert_same(tmp_path / f"a.{form}", columns)


@pytest.mark.parametrize("form", FORMS)
def test_the_traces_of_a_sweep(form, sweep):
    success("export", "swept/members.h5", "--traces", "-o", f"motion.{form}")
    traces = open_traces(sweep)
    parts = [flat_columns(motions.variables, ("run", "time")) for motions in traces]
    arrays = {
        name: np.concatenate([part.arrays[name] for part in parts]) for name in parts[0].arrays
    }
    assert_same(Path(f"motion.{form}"), FlatColumns(arrays, parts[0].units))
    assert arrays["run"].tolist() == np.repeat(np.arange(12), 5).tolist()
    assert arrays["time"].tolist() == traces.times.tolist() * 12
    assert arrays["position_2"][5 * 7 : 5 * 8].tolist() == traces.of(7)["position"][:, 2].tolist()


def test_runs_have_one_row_each(folder):
    for name in ("b", "a"):
        attributes: dict[str, Any] = {f"{name}_own": 2.5}
        (folder / "runs").mkdir(exist_ok=True)
        made_file(folder / f"runs/{name}.h5", title=f'Run "{name}", of two', **attributes)
    success("export", "runs", "-o", "runs.csv")
    with Path("runs.csv").open(newline="", encoding="utf-8") as file:
        first, second = csv.DictReader(file)
    assert (first["file"], second["file"]) == ("runs/a.h5", "runs/b.h5")
    assert first["title"] == 'Run "a", of two'
    result = open_result(folder / "runs" / "a.h5")
    assert float(first["settling_time"]) == result.settling_time
    assert float(first["lyapunov_start"]) == result["lyapunov"][0]
    assert float(first["final_position_1"]) == result["position"][-1, 1]
    assert (first["status"], first["warnings"]) == ("completed", "")
    # What one run lacks is no number.
    assert (first["a_own"], first["b_own"], second["b_own"]) == ("2.5", "nan", "2.5")


def test_a_sweep_is_one_netcdf_file(sweep):
    """Its arrays are those of `open_sweep`, for every reader of netCDF-4."""
    done = rbstab("export", "swept", "-o", "sweep.nc")
    table = open_sweep(sweep)
    assert done.stdout == f"-> sweep.nc: 12 rows, {len(table.columns)} columns\n", done.output
    with netCDF4.Dataset("sweep.nc") as file:
        assert (file.data_model, len(file.dimensions["run"])) == ("NETCDF4", 12)
        file.set_auto_mask(False)
        file.set_auto_chartostring(False)
        for name in table:
            data, stored = table[name], np.asarray(file[name][...])
            if data.dtype.kind in "iuf":
                assert (stored.dtype, stored.tobytes()) == (data.dtype, data.tobytes()), name
            else:
                assert stored.tolist() == data.astype(str).tolist(), name
        for name in table.columns:
            stored, column = file[name], table.variables[name]
            assert (stored.units, stored.long_name) == (column.unit, column.long_name)
            assert stored.dimensions == column.dimensions
    with xarray.open_dataset("sweep.nc", engine="h5netcdf", decode_times=False) as dataset:
        words = dataset["status"].attrs["flag_meanings"].split()
        assert [words[code] for code in dataset["status"].values].count("diverged") == 2
        assert dataset.attrs["plan_id"] == table.attributes["plan_id"]


@pytest.mark.parametrize("form", FORMS)
def test_the_samples_of_a_run_are_those_of_its_file(form, folder):
    result = open_result(made_file(folder / "made.h5"))
    success("export", "made.h5", "--traces", "-o", f"motion.{form}")
    arrays, units = flat_columns(result.variables, ("time",))
    file = np.full(len(result["time"]), "made.h5", dtype=object)
    assert_same(Path(f"motion.{form}"), FlatColumns({"file": file, **arrays}, units))
    assert arrays["orientation_2"].tolist() == result["orientation"][:, 2].tolist()
