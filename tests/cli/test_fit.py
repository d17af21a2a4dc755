"""`rbstab fit`: what it writes has the fitted numbers; what is wrong ends it before the work."""

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from cli.conftest import GOOD, ended, json_of, success

from rbstab.config.load import load_config
from rbstab.experiment.simulate import simulate

HEAD = "time [s],theta1 [deg],theta2 [deg],theta3 [deg]\n"
FIT = ("fit", "good.yaml", "m.csv", "--free", "controller.L_r, controller.K_r[0]")


def write_motion(noise=0.01):
    """Write what is measured of a body with other gains than those of `good.yaml`."""
    true = ["controller.L_r=[50, 70, 30]", "controller.K_r[0]=300", "integration.samples=41"]
    run = simulate(load_config("good.yaml", true))
    angles = np.degrees(run["orientation"]) + np.random.default_rng(1).normal(0, noise, (41, 3))
    rows = [",".join(map(str, row)) for row in np.column_stack([run["time"], angles]).tolist()]
    Path("m.csv").write_text(HEAD + "\n".join(rows))


@pytest.fixture
def motion(folder):
    """The working folder with `good.yaml`, and in `m.csv` the motion of a body with other gains."""
    Path("good.yaml").write_text(GOOD.replace("duration: 0.1", "duration: 1"))
    write_motion()


@pytest.fixture
def no_fit(refuse):
    """Let every fit that runs something fail the test."""
    refuse("experiment.tuning.fit.problem_of")


def test_the_config_is_written_with_the_numbers_that_are_printed(motion):
    done = success(*FIT)
    assert done.stderr.endswith("good.yaml: fitted -> good_fitted.yaml\n")
    assert "warning" not in done.stderr
    written = load_config("good_fitted.yaml")
    rows = {
        line.split()[0]: line.split() for line in done.stdout.splitlines() if "controller" in line
    }
    for key, true, value in (
        ("controller.L_r[0]", 50, written.controller.L_r[0]),
        ("controller.L_r[2]", 30, written.controller.L_r[2]),
        ("controller.K_r[0]", 300, written.controller.K_r[0]),
    ):
        *_, fitted, _, low, high = rows[key]
        assert float(fitted) == pytest.approx(value, rel=1e-4)
        assert float(low) < true < float(high)
    (theta1,) = [line.split() for line in done.stdout.splitlines() if "theta1 [rad]" in line]
    assert int(theta1[2]) == 41
    assert float(theta1[3]) == pytest.approx(np.radians(0.01), rel=0.3)
    # All else is as it was.
    assert written.controller.K_t == load_config("good.yaml").controller.K_t
    ended(4, *FIT)


def test_the_json_has_all(motion):
    facts = json_of(*FIT, "-o", "new.yaml")
    assert facts["file"] == "new.yaml"
    assert [entry["name"] for entry in facts["numbers"]][::3] == [
        "controller.L_r[0]",
        "controller.K_r[0]",
    ]
    first = facts["numbers"][0]
    assert (first["unit"], first["given"]) == ("N m s/rad", 60.0)
    assert first["low"] < first["fitted"] < first["high"]
    assert [entry["name"] for entry in facts["columns"]] == ["theta1", "theta2", "theta3"]
    assert (facts["is_minimum"], facts["warnings"]) == (True, [])


def test_what_the_data_do_not_determine_is_a_warning_and_null(motion):
    done = success(*FIT, "--free", "initial.position[0]", "--json")
    assert "warning: m.csv: not determined: initial.position[0] +0.01 m: what was" in done.stderr
    number = json.loads(done.stdout)["numbers"][-1]
    assert (number["error"], number["low"], number["high"]) == (None, None, None)


def test_a_body_that_fits_but_cannot_be_is_told(motion):
    """Here one that was measured with other gains than those of the config."""
    done = success(*FIT[:4], "body.inertia")
    assert "warning: good_fitted.yaml: body.inertia: no real body has the principal" in done.stderr
    assert "warning: good.yaml: body.inertia" not in done.stderr


def test_the_figure_has_the_residuals(motion):
    success(*FIT, "--figure", "f.csv")
    lines = Path("f.csv").read_text().splitlines()
    residuals = [line.split(",") for line in lines if ",residual," in line]
    assert len(residuals) == 3 * 41
    head = lines[0].split(",")
    values = np.array([float(row[head.index("y")]) for row in residuals])
    assert np.std(values) == pytest.approx(np.radians(0.01), rel=0.2)


def test_the_figure_is_drawn(motion):
    pytest.importorskip("vl_convert")
    success(*FIT, "--figure", "f.svg")
    text = Path("f.svg").read_text()
    assert "residual of theta2 [rad]" in text


def test_a_fit_without_a_minimum_writes_nothing(motion, monkeypatch):
    monkeypatch.setattr("rbstab.experiment.tuning.fit.MAX_RUNS", 1)
    done = ended(3, *FIT, "--json")
    assert done.stderr.endswith(
        "good.yaml: no minimum was found; try other values to start from; no config is written\n"
    )
    facts = json.loads(done.stdout)
    assert (facts["file"], facts["is_minimum"]) == (None, False)
    assert not Path("good_fitted.yaml").exists()


def test_all_problems_of_the_file_are_told(folder, no_fit):
    Path("m.csv").write_text("time [s],theta1 [grad]\n0,a\n0.05,1\n0.2,2\n")
    done = ended(2, *FIT)
    first, second, third = done.stderr.splitlines()
    assert first.startswith("m.csv:1:10: is 'theta1 [grad]'")
    assert second.startswith("m.csv:2:3: is 'a'")
    assert third.startswith("m.csv:4:1: is the time 0.2 s (expected rising times from 0 to 0.1 s")


def test_a_run_that_does_not_complete_is_said(motion):
    done = ended(3, *FIT, "--set", "integration.step_limit=1")
    assert done.stderr.startswith("error: step limit: stopped after 1 steps")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("--figure", "f.gif"), 2, "--figure f.gif: expected a file name that ends in .svg, .pdf"),
        (("--figure", "m.csv"), 4, "m.csv: already exists. Replace it with --force.\n"),
        (("-o", "m.csv"), 4, "m.csv: already exists. Replace it with --force.\n"),
        (("-o", "good.yaml", "--force"), 2, "good.yaml is the given config."),
        # What was measured is not lost, nor is what was found.
        (("-o", "m.csv", "--force"), 2, "CONFIG, DATA, -o and --figure: expected different files"),
        (("--figure", "m.csv", "--force"), 2, "expected different files"),
        (("-o", "f.csv", "--figure", "./f.csv"), 2, "expected different files"),
    ],
)
def test_a_wrong_target_ends_it_before_the_work(folder, no_fit, arguments, code, message):
    Path("m.csv").write_text(f"{HEAD}0,1,2,3\n")
    assert message in ended(code, *FIT, *arguments).stderr


def test_a_wrong_key_or_too_few_values_are_told(folder):
    Path("m.csv").write_text(f"{HEAD}0,1,2,3\n")
    done = ended(2, *FIT)
    few = "error: m.csv: theta1: has 1 values (expected more than the 4 free numbers)"
    assert done.stderr.startswith(few)
    done = ended(2, *FIT[:4], "controller.Q")
    assert done.stderr.startswith("error: controller.Q: is no number to fit (expected numbers that")


@pytest.mark.skipif(sys.platform == "win32", reason="no pipes there")
def test_a_pipe_is_no_file_of_data(folder, no_fit):
    os.mkfifo("m.csv")
    assert ended(2, *FIT).stderr.startswith("m.csv:1:1: cannot be read: ")
