"""Protects `rbstab tune`: the config it writes, its JSON, and its refusals."""

import json
from pathlib import Path

import pytest
from cli.conftest import GOOD, Invoke

from rbstab.config.load import load_config

GAINS = ("--over", "controller.L_r,controller.L_t")

OVER = (*GAINS, "--bounds", "0.5:2")


def test_a_better_config_is_written_and_not_overwritten(folder: Path, rbstab: Invoke) -> None:
    arguments = ("tune", "good.yaml", "--objective", "energy", *OVER)
    done = rbstab(*arguments)
    assert done.exit_code == 0
    assert "controller.L_t[2]" in done.stdout
    assert "energy ∫v dt [J s]" in done.stdout
    assert done.stderr.endswith("good.yaml: found a better config -> good_tuned.yaml\n")
    assert load_config("good_tuned.yaml").title == "A short run, tuned for energy"
    (row,) = [line for line in done.stdout.splitlines() if "controller.L_t[2]" in line]
    given, tuned, factor = map(float, row.split()[-3:])
    assert given == load_config("good.yaml").controller.L_t[2]
    assert tuned == pytest.approx(load_config("good_tuned.yaml").controller.L_t[2], rel=1e-5)
    assert tuned == pytest.approx(given * factor, rel=1e-3)
    text = Path("good_tuned.yaml").read_text()
    again = rbstab(*arguments)
    assert again.exit_code == 4
    assert again.stderr == "good_tuned.yaml: already exists. Replace it with --force.\n"
    Path("good_tuned.yaml").write_text("old")
    assert rbstab(*arguments, "--force").exit_code == 0
    assert Path("good_tuned.yaml").read_text() == text
    assert Path("good.yaml").read_text() == GOOD


def test_json(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("tune", "good.yaml", "--objective", "energy", *OVER, "-o", "t.yaml", "--json")
    facts = json.loads(done.stdout)
    assert facts["file"] == "t.yaml"
    assert facts["better"] is True
    assert facts["tuned"] < facts["given"]
    factor = facts["factors"]["controller.L_r"]
    assert load_config("t.yaml").controller.L_r[0] == 60 * factor


def test_nothing_better_writes_nothing(folder: Path, rbstab: Invoke) -> None:
    arguments = ("--objective", "energy", "--over", "controller.L_r", "--bounds", "1:1")
    done = rbstab("tune", "good.yaml", *arguments)
    assert done.exit_code == 0
    assert done.stderr.endswith("good.yaml: no better config was found; nothing is written\n")
    assert not Path("good_tuned.yaml").exists()


def test_no_run_that_settles_is_exit_code_3(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("tune", "good.yaml", "--objective", "settling_time", *OVER)
    assert done.exit_code == 3
    assert done.stderr.endswith("no run completed and settled; nothing is written\n")
    (row,) = [line for line in done.stdout.splitlines() if "settling_time" in line]
    assert row.split()[3:] == [*["not", "in", "this", "run"] * 2, "-"]
    assert not Path("good_tuned.yaml").exists()
