"""Protects older files when a later version stores more: a new quantity, or a new sweep column.

The later version is made here, by adding one of each to the declarations.
"""

import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import rbstab
from rbstab.report.model.document import Unread
from rbstab.report.reading import untrusted
from rbstab.report.reading.read_results import read_one
from rbstab.store.run_file import write_result
from rbstab.store.table import Column
from rbstab.sweep.folder.sweep_folder import read_folder
from rbstab.sweep.members.outcome import COLUMNS
from rbstab.systems.quantities import LAYOUT_VERSION, QUANTITIES, Quantity
from rbstab_cli.main import cli

STORED = Path(__file__).parent / "data" / "0.1.0"


HERE = ("--threads", "1")
"""Other processes would not know the new column, which only this one has."""


def call(*arguments):
    return CliRunner().invoke(cli, list(map(str, arguments)), prog_name="rbstab")


def short_config():
    return rbstab.load_config(
        "configs/paper/case1_permanent.yaml", ["integration.duration=0.01", "integration.samples=2"]
    )


@pytest.fixture
def newer_quantity(monkeypatch):
    """A quantity that files have from the next layout version on."""
    quantity = Quantity("spin", "ω", "rad/s", ("time",), "|Ω|", since=LAYOUT_VERSION + 1)
    monkeypatch.setattr(untrusted, "QUANTITIES", (*QUANTITIES, quantity))
    return quantity


def test_a_run_without_a_newer_quantity_is_whole(newer_quantity):
    assert not isinstance(read_one(STORED / "runs" / "embedded.h5"), Unread)


def test_a_run_of_the_newer_layout_must_have_it(newer_quantity, tmp_path):
    result = rbstab.simulate(short_config())
    result.attributes["layout_version"] = LAYOUT_VERSION + 1
    write_result(tmp_path / "newer.h5", result)
    found = read_one(tmp_path / "newer.h5")
    assert isinstance(found, Unread)
    assert "spin" in found.reason


def test_a_run_says_its_layout_version():
    assert rbstab.simulate(short_config()).attributes["layout_version"] == LAYOUT_VERSION


@pytest.fixture
def newer_column(monkeypatch):
    """A column that shards of a later version have."""
    monkeypatch.setitem(COLUMNS, "largest_spin", Column((), "f8", "rad/s", "the largest |Ω|"))


@pytest.fixture
def unfinished(tmp_path):
    """A sweep of which 0.1.0 stored two shards of four."""
    return Path(shutil.copytree(STORED / "sweeps" / "begun_map", tmp_path / "begun_map"))


@pytest.mark.usefixtures("newer_column")
def test_an_older_sweep_goes_on_with_its_columns_and_says_so(unfinished):
    before = {path.name: path.read_bytes() for path in (unfinished / "shards").iterdir()}
    done = call("sweep", unfinished / "plan.yaml", "-o", unfinished.parent)
    assert done.exit_code == 0, done.output
    errors = "peak_contact_displacement_error, peak_orientation_error"
    missing = f"energy_at_rest, rest_orientation, energy_scale, {errors}, largest_spin"
    assert f"started without the columns {missing}" in done.stderr
    assert "peaks of the members of before may be wrong" in done.stderr
    assert "differ only if the body has several rest states" in done.stderr
    assert "-o DIR" in done.stderr
    after = {path.name: path.read_bytes() for path in (unfinished / "shards").iterdir()}
    assert len(after) == 4
    assert {name: after[name] for name in before} == before
    assert "largest_spin" not in rbstab.open_sweep(unfinished).layout
    assert call("report", unfinished, "--format", "text").exit_code == 0


@pytest.mark.usefixtures("newer_column")
def test_a_new_sweep_has_the_new_column(unfinished, tmp_path):
    done = call("sweep", unfinished / "plan.yaml", "-o", tmp_path / "new", *HERE)
    assert done.exit_code == 0, done.output
    assert "started without" not in done.stderr
    table = rbstab.open_sweep(tmp_path / "new" / "begun_map")
    # Nothing computes it here; a member without a number has NaN.
    assert np.isnan(table["largest_spin"]).all()


def test_a_sweep_with_columns_of_a_newer_version_is_refused(unfinished, tmp_path, monkeypatch):
    with monkeypatch.context() as newer:
        newer.setitem(COLUMNS, "largest_spin", Column((), "f8", "rad/s", "the largest |Ω|"))
        done = call("sweep", unfinished / "plan.yaml", "-o", tmp_path / "new", *HERE)
        assert done.exit_code == 0
    with pytest.raises(rbstab.StoreError, match="largest_spin"):
        read_folder(tmp_path / "new" / "begun_map")
