"""Protects `rbstab run PLAN --member N`: it runs a member of a sweep as a single run."""

import json
from pathlib import Path

import pytest

import rbstab as api
from rbstab.config.load import run_id
from rbstab.sweep.plan.load import load_plan

PLAN = """\
title: Spins
base: good.yaml
vary:
  initial.angular_velocity[0]: {linspace: [-4, 4, 5]}
  controller.K_r: {scale: {values: [1, 2]}}
"""


@pytest.fixture
def plan(folder):
    (folder / "spins.yaml").write_text(PLAN)
    return folder / "spins.yaml"


@pytest.mark.parametrize("engine", ["heyoka", "scipy"])
@pytest.mark.usefixtures("plan")
def test_it_is_the_member_of_the_sweep(rbstab, engine):
    rbstab("sweep", "--no-prove", "spins.yaml", "--engine", engine, "-q")
    done = rbstab("run", "--no-prove", "results/spins/plan.yaml", "--member", "3", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)[0]["file"] == "results/spins-member3.h5"
    result, table = api.open_result("results/spins-member3.h5"), api.open_sweep("results/spins")
    # Member 3 has entry 1 of the five spins and entry 1 of the two factors.
    assert table["initial_angular_velocity_0"][3] == -2.0
    assert result["angular_velocity"][0].tolist() == [-2.0, 2.0, -1.0]
    assert result.attributes["title"] == "A short run, member 3"
    assert result.run_id == run_id(load_plan("results/spins/plan.yaml").config_of(3))
    assert result.attributes["engine"] == engine
    assert result["lyapunov"][0] == pytest.approx(table["lyapunov_start"][3], rel=1e-12)
    assert result["lyapunov"][-1] == pytest.approx(table["lyapunov_end"][3], rel=1e-9)
    assert result["position"][-1] == pytest.approx(table["final_position"][3], rel=1e-8)


@pytest.mark.usefixtures("plan")
def test_without_a_sweep_the_engine_is_that_which_a_sweep_would_have(rbstab):
    rbstab("run", "--no-prove", "spins.yaml", "--member", "1", "-q")
    rbstab(
        "run", "--no-prove", "spins.yaml", "--member", "1", "-q", "--engine", "scipy", "-o", "other"
    )
    expected = load_plan("spins.yaml", ["integration.engine=heyoka"]).config_of(1)
    run = api.open_result("results/spins-member1.h5")
    assert run.run_id == run_id(expected)
    assert api.open_result("other/spins-member1.h5").attributes["engine"] == "scipy"


@pytest.mark.usefixtures("plan")
def test_changes_are_those_of_the_base(rbstab):
    done = rbstab(
        "run", "--no-prove", "spins.yaml", "--member", "3", "--set", "controller.K_r=[10, 20, 30]"
    )
    assert done.exit_code == 0
    config = api.open_result("results/spins-member3.h5").config
    assert "K_r: [20.0, 40.0, 60.0]" in config


@pytest.mark.usefixtures("plan")
def test_it_is_not_repeated_and_not_overwritten(rbstab):
    rbstab("run", "--no-prove", "spins.yaml", "--member", "3")
    before = Path("results/spins-member3.h5").read_bytes()
    assert "already done" in rbstab("run", "--no-prove", "spins.yaml", "--member", "3").stderr
    other = rbstab("run", "--no-prove", "spins.yaml", "--member", "3", "--set", "body.mass=50")
    assert other.exit_code == 4
    assert Path("results/spins-member3.h5").read_bytes() == before
