"""Protects `rbstab run PLAN --member N`: it runs a member of a sweep as a single run."""

import json
from pathlib import Path

import pytest
from support.printed_paths import printed

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
def test_the_plan_that_a_sweep_was_made_from_does_as_well(rbstab):
    rbstab("sweep", "--no-prove", "spins.yaml", "--engine", "scipy", "-q")
    done = rbstab("run", "--no-prove", "spins.yaml", "--member", "9", "--member", "0", "-q")
    assert done.exit_code == 0, done.output
    table = api.open_sweep("results/spins")
    for number in (0, 9):
        run = api.open_result(f"results/spins-member{number}.h5")
        assert run["lyapunov"][0] == table["lyapunov_start"][number]


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


@pytest.mark.usefixtures("plan")
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["spins.yaml"],
            "spins.yaml:1:1: is the plan of a sweep (expected a config; run all its members: "
            "rbstab sweep spins.yaml; one: rbstab run spins.yaml --member N)",
        ),
        (
            ["good.yaml", "--member", "0"],
            "good.yaml:1:1: is not the plan of a sweep (expected a plan, or no --member)",
        ),
        (
            ["spins.yaml", "--member", "10"],
            "spins.yaml: has no member 10 (expected 0 to 9)",
        ),
        (["none.yaml", "--member", "0"], "none.yaml:1:1: cannot be read"),
        (["wrong.yaml", "--member", "0"], "wrong.yaml:2:8: vary.body.mass"),
        (["spins.yaml", "--member", "-1"], "-1 is not in the range x>=0"),
        (["spins.yaml", "--member", "two"], "'two' is not a valid integer"),
    ],
)
def test_what_is_wrong(rbstab, arguments, message):
    Path("wrong.yaml").write_text("base: good.yaml\nvary: {body.mass: {values: [-1]}}\n")
    done = rbstab("run", "--no-prove", *arguments)
    assert done.exit_code == 2
    assert message in done.stderr
    assert "Traceback" not in done.output
    assert not Path("results").exists()


@pytest.mark.usefixtures("plan")
def test_other_commands_know_a_plan_too(rbstab):
    done = rbstab("stability", "spins.yaml", "good.yaml")
    assert done.exit_code == 2
    assert done.stderr.count("spins.yaml:1:1: is the plan of a sweep") == 1
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.usefixtures("plan")
def test_two_members_of_one_name_are_refused(rbstab, folder):
    (folder / "sub").mkdir()
    (folder / "sub/spins.yaml").write_text(PLAN.replace("good", "../good"))
    done = rbstab("run", "--no-prove", "spins.yaml", "sub/spins.yaml", "--member", "1")
    assert done.exit_code == 2
    assert printed("spins.yaml, member 1 would both write results/spins-member1.h5") in done.stderr
