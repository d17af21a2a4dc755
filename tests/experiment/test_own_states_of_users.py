"""Protects own states of elements of users: the same motion as `kind: embedded`, and names.

The example `creeping_tie.py` states what the embedded tie of the program states. So runs, sweeps
and sensitivities must agree with those of the tie, which other tests compare with closed forms.
"""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from support.config_elements import config_data
from support.problems import ENGINES
from support.user_code import CREEPING_TIE, MAXWELL

import rbstab
from rbstab.config.build import problem_of
from rbstab.config.entries import entries_of, is_of_initial_state
from rbstab.config.errors import ConfigError
from rbstab.config.load import acting_sections, initial_sections, load_config, plain_data, run_id
from rbstab.config.units import Kind, unit_of
from rbstab.experiment.own_states import own_states_of
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.tuning.sensitivities import sensitivities
from rbstab.report.reading.sources import read_sources
from rbstab.report.runs.figures.curves import element_states
from rbstab.store.run_file import write_result
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.sweep import sweep_to_folder
from rbstab_cli.main import cli

VALUES = {
    "point": [0.15, 0.1, -0.42],
    "anchor": [0.1, 0.1, -0.4],
    "K_c": [[4000.0, 300.0, 0.0], [300.0, 5000.0, -200.0], [0.0, -200.0, 6000.0]],
    "L_c": [150.0, 150.0, 200.0],
    "K_d": [900.0, 800.0, 1200.0],
    "L_d": [120.0, 150.0, 90.0],
    "initial_state": [0.02, -0.03, 0.01],
}
OURS = {"kind": "embedded"} | VALUES
THEIRS = {"kind": "python", "file": CREEPING_TIE.name, "class": "CreepingTie", "parameters": VALUES}
BODY = ("orientation", "angular_velocity", "position", "velocity", "energy", "lyapunov")


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / CREEPING_TIE.name).write_text(
        CREEPING_TIE.read_text(encoding="utf-8"), encoding="utf-8"
    )


def load(element, **sections):
    return load_config(config_data({"tie": element}, **sections), allow_python=True)


def with_parameters(**changes):
    return THEIRS | {"parameters": VALUES | changes}


@pytest.mark.parametrize("engine", ENGINES)
def test_the_motion_is_that_of_the_embedded_tie(engine):
    integration = {"engine": engine, "duration": 1.0, "samples": 51, "rtol": 1e-13}
    theirs, ours = (
        rbstab.simulate(load(element, integration=integration)) for element in (THEIRS, OURS)
    )
    assert theirs.status == ours.status == "completed"
    for name in (*BODY, "tie.state"):
        size = max(1.0, np.abs(ours[name]).max())
        assert np.abs(theirs[name] - ours[name]).max() < 1e-12 * size, name
    np.testing.assert_array_equal(theirs["tie.state"][0], VALUES["initial_state"])
    assert np.abs(theirs["tie.state"][-1] - theirs["tie.state"][0]).max() > 1e-3
    one, other = theirs.variables["tie.state"], ours.variables["tie.state"]
    assert (one.unit, one.dimensions) == (other.unit, other.dimensions)
    assert one.long_name == "D: the point between the springs, inertial"


def test_a_state_of_another_size_is_stored_and_relaxes(tmp_path):
    """A spring and a damper in a row between fixed points: s falls as exp(-k t/c)."""
    (tmp_path / "mine.py").write_text(MAXWELL)
    far = {
        "point": [0, 0, 0],
        "anchor": [1.0, 0, 0],
        "k": 8.0,
        "c": 2.0,
        "initial_extension": [0.3],
    }
    heavy = {"mass": 1e12, "inertia": [1e12] * 3, "contact_point": [0, 0, 0]}
    element = {"kind": "python", "file": "mine.py", "class": "Mine", "parameters": far}
    integration = {"duration": 0.5, "samples": 6, "rtol": 1e-12}
    data = {"schema_version": 2, "body": heavy, "gravity": [0, 0, 0]}
    config = load_config(
        data | {"elements": {"mine": element}, "integration": integration}, allow_python=True
    )
    result = rbstab.simulate(config)
    expected = 0.3 * np.exp(-4.0 * result["time"])
    np.testing.assert_allclose(result["mine.extension"][:, 0], expected, rtol=1e-10)
    assert result.variables["mine.extension"].dimensions == ("time", "mine.extension_component")


def test_the_start_is_of_the_initial_state_and_the_rest_is_not():
    config, moved = load(THEIRS), load(with_parameters(initial_state=[0.0, 0.0, 0.5]))
    assert run_id(config) != run_id(moved)
    assert proof_id(config) == proof_id(moved)
    assert acting_sections(config) == acting_sections(moved)
    assert initial_sections(config) != initial_sections(moved)
    keys = [entry.key for entry in entries_of(config) if is_of_initial_state(entry.paths[0])]
    assert keys[-3:] == [f"elements.tie.parameters.initial_state[{k}]" for k in range(3)]
    assert problem_of(config).system.own_states == {"tie.state": slice(12, 15)}
    again = load_config(plain_data(config), allow_python=True)
    assert run_id(again) == run_id(config)
    kind = Kind("python", None, CREEPING_TIE.read_text(encoding="utf-8"), "CreepingTie")
    assert unit_of("elements.tie.parameters.initial_state", [kind]) == "m"
    assert unit_of("elements.tie.parameters.K_d", [kind]) == "N/m"


def test_the_default_start_is_zero():
    values = {key: value for key, value in VALUES.items() if key != "initial_state"}
    config = load(THEIRS | {"parameters": values})
    assert config.elements["tie"].parameters["initial_state"] == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("parameters", "key", "text"),
    [
        ({"initial_state": [0, 0]}, "elements.tie.parameters.initial_state", "has 2 entries"),
        ({"initial_state": [0, 0, "x"]}, "elements.tie.parameters.initial_state", "number"),
        ({"initial_stat": [0, 0, 0]}, "elements.tie.parameters.initial_stat", "initial_state"),
    ],
)
def test_wrong_initial_values(parameters, key, text):
    with pytest.raises(ConfigError) as found:
        load(with_parameters(**parameters))
    (problem,) = found.value.problems
    assert problem.key.startswith(key)
    assert text in f"{problem.problem} {problem.expected}"


def test_sensitivities_are_those_of_ours():
    pytest.importorskip("heyoka")
    integration = {"duration": 0.5, "samples": 26, "rtol": 1e-12}
    theirs, ours = (sensitivities(load(e, integration=integration)) for e in (THEIRS, OURS))
    keys = {entry.key.replace(".parameters", ""): row for row, entry in enumerate(theirs.entries)}
    common = [entry.key for entry in ours.entries if entry.key in keys]
    assert {f"elements.tie.initial_state[{k}]" for k in range(3)} <= set(common)
    rows = {entry.key: row for row, entry in enumerate(ours.entries)}
    found = theirs.derivatives[[keys[key] for key in common]]
    expected = ours.derivatives[[rows[key] for key in common]]
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_a_sweep_is_that_of_the_embedded_tie(tmp_path, engine):
    columns = ("lyapunov_end", "final_position", "final_tie.state", "energy_at_rest")
    tables, traces = [], []
    for name, element, inner in (("theirs", THEIRS, "parameters."), ("ours", OURS, "")):
        plan = load_plan(
            {
                "title": name,
                "base": config_data(
                    {"tie": element}, integration={"duration": 0.5, "samples": 11, "engine": engine}
                ),
                "vary": {
                    f"elements.tie.{inner}initial_state[0]": {"uniform": [-0.05, 0.05]},
                    f"elements.tie.{inner}K_d[1]": {"uniform": [500, 900]},
                },
                "design": "random",
                "members": 5,
                "seed": 3,
                "keep": "traces",
            },
            allow_python=True,
        )
        sweep_to_folder(plan, tmp_path / name, SweepOptions(threads=1))
        tables.append(rbstab.open_sweep(tmp_path / name))
        traces.append(rbstab.open_traces(tmp_path / name).of(2))
    for column in columns:
        found, expected = (table[column] for table in tables)
        assert np.isfinite(found).all()
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-10, err_msg=column)
    start = tables[0]["elements_tie_parameters_initial_state_0"][2]
    kept, other = (trace["tie.state"] for trace in traces)
    assert kept[0, 0] == start
    np.testing.assert_allclose(kept, other, rtol=1e-9, atol=1e-10)


def test_a_state_of_one_number_is_reported_and_shown(tmp_path):
    """Its file also has an array with the numbers of its entries, which is no state."""
    (tmp_path / "mine.py").write_text(MAXWELL)
    values = {"point": [0, 0, 0.3], "anchor": [1.0, 0, 0], "k": 8.0, "c": 2.0}
    element = {"kind": "python", "file": "mine.py", "class": "Mine", "parameters": values}
    config = load(element, integration={"duration": 0.5, "samples": 6})
    result = rbstab.simulate(config)
    assert own_states_of(result) == ("tie.extension",)
    write_result(tmp_path / "run.h5", result)
    sources = read_sources([tmp_path / "run.h5"])
    assert not sources.unread
    assert element_states(sources.runs[0]) == ("tie.extension",)
    found = CliRunner().invoke(cli, ["show", "--json", str(tmp_path / "run.h5")])
    assert found.exit_code == 0, found.output
    assert len(json.loads(found.stdout)["final"]["tie.extension"]) == 1
    shown = CliRunner().invoke(cli, ["show", str(tmp_path / "run.h5")])
    assert shown.exit_code == 0, shown.output
    assert "final tie.extension" in shown.stdout
