"""Protects results in the hands of xarray and pandas: numbers that can be averaged, selected by the
values of varied keys and stored again; one row a member; and arrays that nobody can change.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray
from support.configs import EMBEDDED, edited, plain
from support.sweeping import run_sweep
from support.sweeps import SHORT, FakeEngine

import rbstab

pytestmark = pytest.mark.slow

SPIN, OTHER = "initial.angular_velocity[0]", "initial.angular_velocity[1]"
X, Y = "initial_angular_velocity_0", "initial_angular_velocity_1"

VARIED: dict[str, dict[str, Any]] = {
    "one key": {"vary": {SPIN: {"linspace": [-4, 4, 5]}}},
    "grid": {"vary": {SPIN: {"values": [1, 2, 4]}, OTHER: {"values": [-6, 6]}}},
    "zip": {
        # Its name is that of a column.
        "vary": {
            "status": {"zip": {SPIN: {"values": [1, 2, 4]}, OTHER: {"values": [9, 8, 9]}}},
            "body.mass": {"values": [40, 41]},
        }
    },
    "variants": {
        "vary": {
            "controller.variant": {"each": {"values": ["embedded", "visco-elastic"]}},
            SPIN: {"uniform": [-4, 4]},
        },
        "design": "random",
        "members": 3,
        "seed": 1,
    },
    "drawn": {
        "vary": {SPIN: {"uniform": [-4, 4]}, OTHER: {"uniform": [-4, 4]}},
        "design": "random",
        "members": 4,
        "seed": 1,
    },
}


@pytest.fixture(scope="module")
def sweeps(tmp_path_factory):
    """The folders of finished sweeps of each kind of plan, with traces; member 1 diverged."""
    folders = {}
    for name, plan in VARIED.items():
        base = {**plain(EMBEDDED), "integration": SHORT}
        loaded = rbstab.load_plan({"title": name, "base": base, "keep": "traces", **plan})
        folders[name] = tmp_path_factory.mktemp("sweep") / name
        run_sweep(folders[name], loaded, factory=lambda plan: FakeEngine(plan, failing=(1,)))
    return folders


@pytest.fixture(scope="module")
def tables(sweeps):
    return {name: rbstab.open_sweep(folder) for name, folder in sweeps.items()}


@pytest.fixture(scope="module")
def traces(sweeps):
    return {name: rbstab.open_traces(folder) for name, folder in sweeps.items()}


@pytest.fixture(scope="module")
def run():
    """A run with switches or impacts has more dimensions; this one has texts in its certificate."""
    text = edited("orientation: [0, 0, 0]", "orientation: [0.1, 0.2, 0]")
    return rbstab.simulate({**plain(text), "integration": SHORT})


KINDS = ("run", "certificate", "motions", "traces", *VARIED)


@pytest.fixture(params=KINDS)
def dataset(
    request,
    run,
    tables,
    traces,
):
    others: dict[str, Callable[[], xarray.Dataset]] = {
        "run": run.to_xarray,
        "certificate": lambda: run.to_xarray("certificate"),
        "motions": lambda: traces["grid"].of(2).to_xarray(),
        "traces": lambda: traces["grid"].to_xarray([0, 3, 5]),
    }
    kind = request.param
    return others[kind]() if kind in others else tables[kind].to_xarray()


def test_a_dataset_holds_numbers(dataset):
    """Only coordinates along one dimension may be words: its labels."""
    assert dataset.data_vars
    for name, array in dataset.variables.items():
        is_label = name in dataset.coords and array.ndim == 1
        assert array.dtype.kind in "fiub" or (is_label and array.dtype.kind in "OUT"), name


@pytest.mark.parametrize(
    ("kind", "selection", "members"),
    [
        ("one key", {X: -2}, [1]),
        ("grid", {X: 2, Y: 6}, [3]),
        ("grid", {X: 4}, [4, 5]),
        ("grid", {Y: -6}, [0, 2, 4]),
        ("zip", {X: 2, "body_mass": 41}, [3]),
        ("zip", {Y: 9}, [0, 1, 4, 5]),
        ("variants", {"controller_variant": "visco-elastic"}, [3, 4, 5]),
    ],
)
def test_values_of_varied_keys_select(kind, selection, members, tables):
    """The members are counted by the last key of the plan first."""
    table = tables[kind]
    # Without an index only newer versions of xarray select.
    assert set(selection) <= set(table.to_xarray().indexes)
    selected = table.to_xarray().sel(selection)
    assert selected["run"].values.ravel().tolist() == members
    assert np.array_equal(selected["settling_time"].values.ravel(), table["settling_time"][members])
    vectors = selected["final_position"].values.reshape(-1, 3)
    assert np.array_equal(vectors, table["final_position"][members], equal_nan=True)


def test_drawn_values_select_their_member(tables, traces):
    third = {X: tables["drawn"][X][3]}
    assert tables["drawn"].to_xarray().sel(third)["run"].item() == 3
    # Each variant has the same points.
    points = tables["variants"].to_xarray().sel({X: tables["variants"][X][1]})
    assert points["run"].values.ravel().tolist() == [1, 4]
    assert traces["drawn"].to_xarray([3, 0]).sel(third)["run"].item() == 3
    assert traces["grid"].to_xarray(range(6)).sel({Y: 6})["run"].values.tolist() == [1, 3, 5]


@pytest.mark.parametrize("kind", VARIED)
def test_pandas_has_one_row_a_member(kind, tables):
    table = tables[kind]
    frame = table.to_pandas()
    assert frame.index.tolist() == table["run"].tolist()
    assert frame.index.name == "run"
    assert frame["status"].tolist() == table.words("status").tolist()
    assert frame["status"][1] == "diverged"
    for axis in range(3):
        column = frame[f"final_orientation_{axis}"].to_numpy()
        assert np.array_equal(column, table["final_orientation"][:, axis], equal_nan=True)
    assert frame[X].tolist() == table[X].tolist()
    assert frame.attrs["units"][X] == "rad/s"
    assert frame.attrs["units"]["final_position_2"] == "m"
    numbers = frame.drop(columns=["status"]).select_dtypes("number")
    assert numbers.mean()[X] == pytest.approx(table[X].mean())


def test_pandas_has_one_row_a_sample(run):
    frame = run.to_pandas()
    assert frame.index.tolist() == run["time"].tolist()
    assert frame["orientation_1"].tolist() == run["orientation"][:, 1].tolist()
    kinetic = run["energy"][:, run["part"].tolist().index("kinetic")]
    assert frame["energy_kinetic"].tolist() == kinetic.tolist()
    assert frame.attrs["units"]["energy_kinetic"] == "J"
