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
from rbstab.config.load import resolved_yaml, run_id
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
    assert resolved_yaml(config) == stored.config
    again = rbstab.simulate(config)
    # An enclosure was added by a proof.
    names = {name for name in stored.variables if not name.startswith("enclosure/")}
    assert names <= set(again.variables)
    for quantity in ("time", "orientation", "angular_velocity", "contact_displacement", "lyapunov"):
        scale = np.abs(stored[quantity]).max() or 1.0
        # The chatter of s = E is chaotic, but in these 0.02 s the differences have not grown yet.
        assert np.abs(again[quantity] - stored[quantity]).max() < 1e-8 * scale, quantity


def proved(results, name, *options):
    """Run the config of a stored run again, and return which files changed, and which are new."""
    config = results.parent / f"{name}.yaml"
    config.write_text(call("show", "--config", results / f"{name}.h5").stdout)
    before = bytes_below(results)
    done = call("run", config, *options, "-o", results)
    assert done.exit_code == 0, done.output
    after = bytes_below(results)
    return {file for file in before if after[file] != before[file]}, set(after) - set(before)


@pytest.mark.parametrize("name", ["permanent_certified", "visco_elastic_proved"])
def test_a_run_is_taken_as_it_stands(results, name):
    """`rbstab run` of the same config finds the run, and computes only the proof that it lacks."""
    assert proved(results, name, "--no-prove") == (set(), set())
    changed, new = proved(results, name)
    assert not changed
    assert new == {f"proofs/{file.name}" for file in (results / "proofs").iterdir()}
    assert len(new) == 1


def test_a_run_learns_what_is_proved_of_its_motion(results):
    """`rbstab run --prove` adds it to the run, and stores the proof beside it."""
    stored = rbstab.open_result(results / "embedded.h5")
    changed, new = proved(results, "embedded", "--prove")
    assert (changed, len(new)) == ({"embedded.h5"}, 1)
    again = rbstab.open_result(results / "embedded.h5")
    assert stored.attributes["convergence"] == "not decided"
    assert again.attributes["convergence"] == "proved"
    assert set(stored.variables) <= set(again.variables)
    scale = np.abs(stored["orientation"]).max() or 1.0
    assert np.abs(again["orientation"] - stored["orientation"]).max() < 1e-8 * scale


# A stored sweep, the options with which it goes on, its shards before and after, and the sweep that
# it then equals.
SWEEPS = [
    ("finished_map", ["--json"], 4, 4, "finished_map"),
    ("finished_variants", ["--json"], 5, 5, "finished_variants"),
    ("begun_map", ["--no-prove"], 2, 4, "finished_map"),
    ("first_part_of_variants", ["--no-prove"], 3, 5, "finished_variants"),
]


@pytest.mark.parametrize(
    ("sweep", "options", "before", "after", "whole"), SWEEPS, indirect=["sweep"]
)
def test_a_sweep_goes_on(sweep, options, before, after, whole):
    """The stored shards stay unchanged, and the missing ones are added.

    The members file of a finished sweep may say of more members what is proved now.
    """
    stored = bytes_below(sweep)
    stored.pop("members.h5", None)
    assert sum(name.startswith("shards/") for name in stored) == before
    done = call("sweep", sweep / "plan.yaml", "-o", sweep.parent, *options)
    assert done.exit_code == 0, done.output
    assert not (sweep.parent / "plan").exists(), "the sweep started again in a new folder"
    files = bytes_below(sweep)
    assert sum(name.startswith("shards/") for name in files) == after
    assert {name: files[name] for name in stored} == stored
    table = rbstab.open_sweep(sweep)
    _same_table(table, rbstab.open_sweep(STORED / "sweeps" / whole))
    assert set(table.words("status")) == {"completed"}
    assert call("sweep", "--status", sweep).exit_code == 0


def test_traces_open():
    sweep = STORED / "sweeps" / "finished_variants"
    traces, table = rbstab.open_traces(sweep), rbstab.open_sweep(sweep)
    members = np.flatnonzero(table["traces"]).tolist()
    assert members == [0, 3, 6, 9, 12, 15, 18]
    for member in members:
        trace = traces.of(member)
        assert trace["lyapunov"][0] == table["lyapunov_start"][member]
        assert trace["orientation"][-1].tolist() == table["final_orientation"][member].tolist()


RUN = Path(__file__).parent / "data" / "run_format_1.h5"

RUN_DIGEST = "be62f82e826f1454585cc9a6f8e28a0982b18f3465ec88754927c3780ffde64a"

SYMBOLS = {
    "orientation": "Theta",
    "angular_velocity": "Omega",
    "position": "X",
    "velocity": "V",
    "contact_displacement": "E",
    "contact_velocity": "F",
    "contact_force": "Lam",
}


def test_a_stored_run_has_the_values_of_the_reference_solution():
    """Another program computed them: Taylor series in 80-bit numbers at tolerance 1e-18."""
    assert hashlib.sha256(RUN.read_bytes()).hexdigest() == RUN_DIGEST
    stored = rbstab.open_result(RUN)
    assert (stored.status, stored.attributes["variant"]) == ("completed", "permanent")
    reference = Path(__file__).parents[1] / "data" / "paper_state.json"
    case = json.loads(reference.read_text())["cases"]["permanent/0/S0_paper"]
    assert len(case["states"]) == 7
    for state in case["states"]:
        (index,) = np.flatnonzero(np.isclose(stored["time"], state["t"], rtol=0, atol=1e-12))
        for name, symbol in SYMBOLS.items():
            assert np.abs(stored[name][index] - state[symbol]).max() < 1e-8, (name, state["t"])
    # By hand: ½ m V'V with 41 kg and V = (11.84, -4.32, 3.2) m/s; ½ Ω'JΩ with Ω = (16, 32, -16).
    kinetic = 0.5 * 41 * (11.84**2 + 4.32**2 + 3.2**2) + 0.5 * (2560 + 8192 + 102.4)
    assert stored["energy"][0] == pytest.approx([kinetic, 0, 0, 0], rel=1e-14)
    assert stored["lyapunov"][0] == pytest.approx(kinetic, rel=1e-14)
    # V'L_t V and Ω'L_r Ω dissipate, with L_t = (210, 210, 140) N s/m and L_r = (60, 60, 42) N m s.
    translational = 210 * (11.84**2 + 4.32**2) + 140 * 3.2**2
    rotational = 60 * (16**2 + 32**2) + 42 * 16**2
    assert stored["dissipation"][0] == pytest.approx([0, 0, translational, rotational], rel=1e-14)
    assert stored["lyapunov_rate"][0] == pytest.approx(-translational - rotational, rel=1e-14)
    assert stored["stabilizing_force"][0] == pytest.approx([-2486.4, 907.2, -448.0], rel=1e-14)
    assert stored["stabilizing_couple"][0] == pytest.approx([-960, -1920, 672], rel=1e-14)


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


def _same_table(table, expected):
    """Compare two tables but for what is proved of more members now."""
    assert table.columns == expected.columns
    for name in set(expected.columns) - set(PROVED):
        if name in {"status", "traces", "controller_variant"}:
            assert (table[name] == expected[name]).all(), name
            continue
        scale = np.nanmax(np.abs(expected[name].astype(float)), initial=0.0) or 1.0
        # Steps may differ by one on another processor; the residual is only round-off.
        bound = {"steps": 2.0, "energy_residual": 1e-9 * expected["lyapunov_start"].max()}
        if name.endswith("_error"):  # a difference of values, which have round-off
            of = np.abs(expected[name.removesuffix("_error")].astype(float))
            bound[name] = 1e-8 * scale + 1e-14 * np.nanmax(of)
        np.testing.assert_allclose(
            table[name].astype(float),
            expected[name],
            rtol=0,
            atol=bound.get(name, 1e-8 * scale),
            err_msg=name,
        )
