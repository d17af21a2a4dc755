"""Protects the files of users: runs and sweeps of format 1, and reports of version 0.1.0."""

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

import rbstab
from rbstab.config.load import run_id
from rbstab_cli.main import cli

STORED = Path(__file__).parent / "data" / "format_1"

# The status and verdict with which they were stored.
RUNS = {
    "embedded": ("completed", "consistent"),
    "free_gravity": ("completed", "consistent"),
    "permanent_certified": ("completed", "consistent"),
    "position_exact_20000": ("completed", "consistent"),
    "range_left": ("range left", "consistent"),
    "slope_exact_2000_gravity": ("completed", "consistent"),
    "slope_layer_20000": ("completed", "consistent"),
    "visco_elastic_compiled": ("completed", "consistent"),
    "visco_elastic_proved": ("completed", "consistent"),
}


DIGEST = "5aee92522b463e2e7caec953c9f9bbd6e90baec53e7d86f66ce8c0835d373c2d"


def call(*arguments):
    return CliRunner().invoke(cli, list(map(str, arguments)), prog_name="rbstab")


def bytes_below(folder):
    """Return the content of each file below a folder by relative path."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.fixture
def results(tmp_path):
    """A folder of results like that of a user."""
    shutil.copytree(STORED / "runs", tmp_path / "results")
    return tmp_path / "results"


@pytest.fixture
def sweep(results, request):
    """A stored sweep in a folder of results."""
    return Path(shutil.copytree(STORED / "sweeps" / request.param, results / request.param))


def test_every_stored_run_is_listed():
    assert sorted(path.stem for path in (STORED / "runs").glob("*.h5")) == sorted(RUNS)


@pytest.mark.parametrize("name", RUNS)
def test_a_run_opens(name):
    """`open_result` compares the file with its seal."""
    result = rbstab.open_result(STORED / "runs" / f"{name}.h5")
    assert (result.status, result.attributes["verdict"]) == RUNS[name]
    assert call("show", STORED / "runs" / f"{name}.h5").exit_code == 0


@pytest.mark.parametrize("name", RUNS)
def test_a_config_keeps_its_meaning(name):
    """The run id is the same, and the motion up to round-off, which differs by processor."""
    stored = rbstab.open_result(STORED / "runs" / f"{name}.h5")
    config = rbstab.load_config(yaml.safe_load(stored.config))
    assert run_id(config) == stored.run_id
    again = rbstab.simulate(config)
    # An enclosure was added by a proof.
    names = {name for name in stored.variables if not name.startswith("enclosure/")}
    assert names <= set(again.variables)
    for quantity in ("time", "orientation", "angular_velocity", "contact_displacement", "lyapunov"):
        scale = np.abs(stored[quantity]).max() or 1.0
        # The chatter of s = E is chaotic, but in these 0.02 s the differences have not grown yet.
        assert np.abs(again[quantity] - stored[quantity]).max() < 1e-8 * scale, quantity


@pytest.mark.parametrize("name", ["permanent_certified", "visco_elastic_proved"])
def test_a_run_is_taken_as_it_stands(results, tmp_path, name):
    """`rbstab run` of the same config finds the run, and computes only the proof that it lacks."""
    shown = call("show", "--config", results / f"{name}.h5")
    (tmp_path / f"{name}.yaml").write_text(shown.stdout)
    before = bytes_below(results)
    done = call("run", tmp_path / f"{name}.yaml", "--no-prove", "-o", results)
    assert done.exit_code == 0, done.output
    assert bytes_below(results) == before
    done = call("run", tmp_path / f"{name}.yaml", "-o", results)
    assert done.exit_code == 0, done.output
    after = bytes_below(results)
    assert {file: after[file] for file in before} == before
    assert [file for file in after if file not in before] == [_only_proof(results)]


def _only_proof(results):
    (file,) = (results / "proofs").iterdir()
    return str(file.relative_to(results))


def test_a_run_learns_what_is_proved_of_its_motion(results, tmp_path):
    """`rbstab run --prove` adds it to the run, and stores the proof beside it."""
    name = "embedded"
    shown = call("show", "--config", results / f"{name}.h5")
    (tmp_path / f"{name}.yaml").write_text(shown.stdout)
    before, stored = bytes_below(results), rbstab.open_result(results / f"{name}.h5")
    done = call("run", tmp_path / f"{name}.yaml", "--prove", "-o", results)
    assert done.exit_code == 0, done.output
    after, again = bytes_below(results), rbstab.open_result(results / f"{name}.h5")
    changed = {key for key in before if after[key] != before[key]}
    assert changed == {f"{name}.h5"}
    assert set(after) - set(before) == {_only_proof(results)}
    assert stored.attributes["convergence"] == "not decided"
    assert again.attributes["convergence"] == "proved"
    assert set(stored.variables) <= set(again.variables)
    scale = np.abs(stored["orientation"]).max() or 1.0
    assert np.abs(again["orientation"] - stored["orientation"]).max() < 1e-8 * scale


@pytest.mark.parametrize("sweep", ["finished_map", "finished_variants"], indirect=True)
def test_a_finished_sweep_is_finished(sweep):
    """Nothing is computed again. Its members file may say of more members what is proved now."""
    before, table = bytes_below(sweep), rbstab.open_sweep(sweep)
    del before["members.h5"]
    done = call("sweep", sweep / "plan.yaml", "-o", sweep.parent, "--json")
    assert done.exit_code == 0, done.output
    after = bytes_below(sweep)
    assert {name: after[name] for name in before} == before
    _same_table(rbstab.open_sweep(sweep), table, but=PROVED)
    assert call("sweep", "--status", sweep).exit_code == 0
    table = rbstab.open_sweep(sweep)
    assert set(table.words("status")) == {"completed"}


@pytest.mark.parametrize("sweep", ["finished_variants"], indirect=True)
def test_traces_open(sweep):
    traces = rbstab.open_traces(sweep)
    table = rbstab.open_sweep(sweep)
    members = np.flatnonzero(table["traces"]).tolist()
    assert members == [0, 3, 6, 9, 12, 15, 18]
    for member in members:
        trace = traces.of(member)
        assert trace["lyapunov"][0] == table["lyapunov_start"][member]
        assert trace["orientation"][-1].tolist() == table["final_orientation"][member].tolist()


@pytest.mark.parametrize("sweep", ["begun_map"], indirect=True)
def test_a_sweep_that_was_begun_goes_on(sweep):
    """The stored shards stay unchanged, and the missing ones are added."""
    before = bytes_below(sweep / "shards")
    assert sorted(before) == ["00000000.h5", "00000002.h5"]
    done = call("sweep", sweep / "plan.yaml", "--no-prove", "-o", sweep.parent)
    assert done.exit_code == 0, done.output
    assert not (sweep.parent / "plan").exists(), "the sweep started again in a new folder"
    after = bytes_below(sweep / "shards")
    assert len(after) == 4
    assert {name: after[name] for name in before} == before
    _same_table(rbstab.open_sweep(sweep), rbstab.open_sweep(STORED / "sweeps" / "finished_map"))


@pytest.mark.parametrize("sweep", ["first_part_of_variants"], indirect=True)
def test_a_second_part_joins_the_first(sweep):
    before = bytes_below(sweep / "shards")
    done = call("sweep", sweep / "plan.yaml", "-o", sweep.parent, "--part", "2/2")
    assert done.exit_code == 0, done.output
    assert not (sweep / "members.h5").exists()
    done = call("sweep", sweep / "plan.yaml", "--no-prove", "-o", sweep.parent)
    assert done.exit_code == 0, done.output
    after = bytes_below(sweep / "shards")
    assert len(after) == 5
    assert {name: after[name] for name in before} == before
    whole = rbstab.open_sweep(STORED / "sweeps" / "finished_variants")
    _same_table(rbstab.open_sweep(sweep), whole)


@pytest.mark.parametrize("sweep", ["finished_map"], indirect=True)
def test_all_of_it_is_reported(results, sweep, tmp_path):
    """The report reads every file, and replaces a report of version 0.1.0."""
    report = tmp_path / "report.txt"
    shutil.copy(STORED / "reports" / "report.txt", report)
    files = sorted(results.glob("*.h5"))
    done = call("report", *files, sweep, "-o", report, "--format", "text")
    assert done.exit_code == 0, done.output
    text = report.read_text()
    assert all(name in text for name in RUNS)
    assert "A map over spin, stored by rbstab 0.1.0" in text
    assert "cannot be read" not in done.output
    assert "damaged" not in text


def test_a_markdown_report_is_known_as_a_report(results, tmp_path):
    report = tmp_path / "report.md"
    shutil.copy(STORED / "reports" / "report.md", report)
    done = call("report", results / "embedded.h5", "-o", report)
    assert done.exit_code == 0, done.output
    assert "five variants" not in report.read_text().lower()


def test_the_stored_files_are_those_that_were_stored():
    """Changed files would protect nothing."""
    digest = hashlib.sha256()
    for name, content in bytes_below(STORED).items():
        digest.update(json.dumps([name, hashlib.sha256(content).hexdigest()]).encode())
    assert digest.hexdigest() == DIGEST


PROVED = ("convergence", "proved_rest_state", "one_rest_state")


def _same_table(found, expected, but=()):
    assert found.columns == expected.columns
    for name in (one for one in expected.columns if one not in but):
        if name in ("status", "traces", "convergence", "controller_variant"):
            assert (found[name] == expected[name]).all(), name
            continue
        scale = np.nanmax(np.abs(expected[name].astype(float)), initial=0.0) or 1.0
        # Steps may differ by one on another processor; the residual is only round-off.
        bound = {"steps": 2.0, "energy_residual": 1e-9 * expected["lyapunov_start"].max()}
        difference = np.abs(found[name].astype(float) - expected[name]) / (
            1.0 if name in ("steps", "energy_residual") else scale
        )
        assert np.nan_to_num(difference).max() <= bound.get(name, 1e-8), name
        assert (np.isnan(found[name]) == np.isnan(expected[name])).all(), name
