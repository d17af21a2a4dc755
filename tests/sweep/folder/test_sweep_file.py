"""Protects the table of a finished sweep: all members, their varied values and the plan."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import xarray
from click.testing import CliRunner
from support.sweeping import run_sweep
from support.sweeps import FakeEngine, plan_of

import rbstab
from rbstab.store.dataset_file import write_dataset
from rbstab.store.errors import StoreError
from rbstab.store.table import read_table
from rbstab.sweep.folder.member_answers import member_answers
from rbstab.sweep.folder.members_file import counts_by_status, varied_columns
from rbstab.sweep.folder.sweep_folder import read_folder
from rbstab.sweep.folder.sweep_table import MEMBERS, check_sweep, read_sweep
from rbstab.sweep.plan.load import load_plan
from rbstab_cli.main import cli


def test_what_is_stored(tmp_path):
    plan = plan_of()
    done = run_sweep(tmp_path / "a", plan)
    assert done.finished
    assert counts_by_status(done.inventory.counts) == {"completed": 60}
    table = read_sweep(tmp_path / "a" / "members.h5")
    engine = FakeEngine(plan)
    expected = engine.compute(0, 60).outcome
    for name, data in expected.items():
        assert table[name].tobytes() == data.tobytes(), name
    spins = plan.values(0, 60)["initial.angular_velocity[0]"]
    assert (table["initial_angular_velocity_0"] == spins).all()
    assert table.variables["initial_angular_velocity_0"].unit == "rad/s"
    assert table["grid_axis"].tolist() == ["initial.angular_velocity[0]"]
    assert table["plan"].item() == (tmp_path / "a" / "plan.yaml").read_text()
    manifest = json.loads((tmp_path / "a" / "manifest.json").read_text())
    assert manifest["plan_id"] == table.attributes["plan_id"] == done.folder.manifest.plan_id
    assert rbstab.open_sweep(tmp_path / "a").shaped("steps").shape == (60,)
    summary = member_answers(done.folder.sweep_file).summary
    assert (summary["members"], summary["by_status"]) == (60, {"completed": 60})


def test_variants_and_axes_of_a_plan_in_its_file(tmp_path):
    path = Path(__file__).parents[3] / "configs" / "sweeps" / "variants.yaml"
    plan = load_plan(path, ["integration.engine=scipy"])
    done = run_sweep(tmp_path / "a", plan, shard_size=1024)
    table = rbstab.open_sweep(done.folder.sweep_file)
    assert table.words("controller_variant")[[0, 1000, 4999]].tolist() == [
        "free",
        "permanent",
        "sliding",
    ]
    assert table["grid_axis"].tolist() == ["controller.variant", "point"]
    assert table.shaped("final_position").shape == (5, 1000, 3)
    dataset = table.to_xarray()
    exported = tmp_path / "a.nc"
    exporting = CliRunner().invoke(cli, ["export", str(tmp_path / "a"), "-o", str(exported)])
    assert exporting.exit_code == 0, exporting.output
    with xarray.open_dataset(exported, engine="h5netcdf") as data:
        assert data["initial_position_2"].attrs == {
            "units": "m",
            "long_name": "initial.position[2]",
        }
        assert data["controller_variant"].attrs["flag_meanings"].split() == list(plan.variants)
        left_out = {"grid_axis_number", "grid_axis", "grid_length", "plan"}
        assert set(dataset.variables) == set(data.variables) - left_out
        assert dict(dataset.sizes) == {"controller_variant": 5, "point": 1000, "axis": 3}
        assert (
            dataset["initial_position_2"].values == data["initial_position_2"].values[:1000]
        ).all()
        for name in ("final_position", "status"):
            shape = (5, 1000, *data[name].shape[1:])
            assert (dataset[name].values == data[name].values.reshape(shape)).all()


def test_every_key_that_varies_has_a_unit():
    """Every varied column of the ready plans has a unit and a valid name."""
    for path in (Path(__file__).parents[3] / "configs" / "sweeps").glob("*.yaml"):
        plan = load_plan(path, allow_python=True)
        for name, column in varied_columns(plan, 0, 1).items():
            assert column.unit, name
            assert name.isidentifier()


def test_a_members_file_of_other_shards_is_no_finished_sweep(tmp_path):
    """`--retry-failed` that is interrupted leaves old proofs beside new members."""
    run_sweep(tmp_path / "sweep")
    folder = read_folder(tmp_path / "sweep")
    check_sweep(folder.sweep_file)
    table = read_table(folder.sweep_file, MEMBERS)
    other = {**table.attributes, "shards_digest": "0" * 64}
    write_dataset(folder.sweep_file, replace(table, attributes=other), replace=True)
    for read in (check_sweep, read_sweep):
        with pytest.raises(StoreError, match="not finished"):
            read(folder.sweep_file)
