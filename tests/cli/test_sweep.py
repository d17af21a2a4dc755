"""Protects `rbstab sweep`: the folder it writes, `--status`, `--dry-run`, and its errors."""

import json
from pathlib import Path

import pytest
import xarray
from cli.conftest import ended, json_of, rbstab, success
from support.sweeps import shard_files

from rbstab import load_plan, open_traces, simulate
from rbstab.files.text import shell_word
from rbstab.integrate.engines import EngineMissingError, engine
from rbstab.store.disk.lock import locked
from rbstab_cli.work.sweeps.progress import duration
from rbstab_cli.work.sweeps.tables import size

PLAN = """\
title: Spins
base: good.yaml
vary:
  initial.angular_velocity[0]: {linspace: [-4, 4, 10]}
  controller.K_r: {scale: {values: [1, 2]}}
"""

SWEEP = ("sweep", "--no-prove", "plan.yaml")


@pytest.mark.parametrize("name", ["heyoka", "scipy"])
def test_a_sweep(plan, name):
    done = success(*SWEEP, "--engine", name, "--shard-size", "8")
    assert "completed       20  100.00%" in done.stdout
    assert "largest |r|/largest energy " in done.stdout
    assert "-> results/plan/members.h5" in done.stderr.replace("\\", "/")
    names = sorted(path.name for path in Path("results/plan").iterdir())
    assert names == [".lock", "manifest.json", "members.h5", "plan.yaml", "shards"]
    assert ("4 members, largest relative difference" in done.stdout) == (name == "heyoka")
    with xarray.open_dataset("results/plan/members.h5", engine="h5netcdf") as data:
        assert data.sizes["run"] == 20
        assert data["controller_K_r"].attrs["long_name"] == "factor on controller.K_r"
    # The plan in the folder makes the same sweep.
    again = rbstab("sweep", "--no-prove", "results/plan/plan.yaml")
    assert (again.exit_code, again.stdout) == (0, done.stdout)
    assert "20 of 20 members are already done" in again.stderr


def test_failures(use_fake_engine):
    use_fake_engine(failing=(3, 4, 9))
    done = ended(
        3, *SWEEP, "--engine", "scipy", "--shard-size", "5", "--fail-fast", "--threads", "1"
    )
    assert "member 3 failed; 5 of 20 members are stored" in done.stderr
    done = success(*SWEEP, "--engine", "scipy")
    assert "diverged         3  15.00%" in done.stdout
    use_fake_engine()
    done = rbstab(*SWEEP, "--retry-failed")
    assert (done.exit_code, "diverged" in done.stdout) == (0, False)
    use_fake_engine(failing=range(20))
    ended(3, *SWEEP, "-o", "other", "--engine", "scipy")


def test_status(use_fake_engine):
    use_fake_engine(failing=(11,))
    options = ("--engine", "scipy", "--shard-size", "8", "--threads", "1")
    rbstab(*SWEEP, *options, "--fail-fast")
    shown = success("sweep", "--status", "results/plan")
    words = [line.split() for line in shown.stdout.splitlines()]
    assert ["done", "16", "(80.0%)"] in words
    assert ["not", "done", "4", "20.00%"] in words
    assert ["running", "no"] in words
    Path("results/plan/shards/00000001.h5").write_bytes(b"")
    with locked(Path("results/plan")):
        shown = rbstab("sweep", "--status", "results/plan")
    words = [line.split() for line in shown.stdout.splitlines()]
    assert ["shards", "1", "of", "3,", "1", "damaged"] in words
    assert ["running", "yes"] in words


def test_what_a_sweep_says_of_its_progress(use_fake_engine, statuses):
    use_fake_engine(failing=(0,), delay=1e-3)
    rbstab(*SWEEP, "--engine", "scipy", "--shard-size", "10", "--threads", "1")
    lines = [line for line in statuses if " of 20 members, " in line]
    assert len(lines) == 2
    assert "/s, 1 diverged, " in lines[0]
    assert lines[0].endswith(" left")
    use_fake_engine()
    statuses.clear()
    again = rbstab(*SWEEP, "--retry-failed")
    assert "10 of 20 members are already done" in again.stderr
    assert "20 of 20 members, " in statuses[0]
    assert "diverged" not in "".join(statuses)


def test_numbers_in_words():
    assert [duration(s) for s in (0.123, 40, 720, 12600)] == ["0.12 s", "40 s", "12 min", "3.5 h"]
    assert [size(n) for n in (10, 1500, 24_300_000, 5 * 10**12)] == [
        "0.01 kB",
        "1.5 kB",
        "24.3 MB",
        "5e+03 GB",
    ]


@pytest.mark.slow
def test_motions_are_kept_on_request_and_made_again_if_lost(plan):
    Path("plan.yaml").write_text(f"{PLAN}keep: {{traces: {{every: 3}}}}\n")
    success(*SWEEP, "--engine", "heyoka")
    traces = open_traces("results/plan")
    assert traces.members.tolist() == list(range(0, 20, 3))
    single = simulate(load_plan(Path("plan.yaml")).config_of(9))
    assert traces.of(9)["contact_force"] == pytest.approx(single["contact_force"], abs=1e-8)
    status = ("sweep", "--status", "results/plan")
    assert json_of(*status)["traces"] == 7
    Path("results/plan/traces/00000000.h5").write_bytes(b"")
    facts = json_of(*status)
    assert (facts["damaged_shards"], facts["done"]) == ([0], 0)
    assert "of 7 members" in rbstab(*status).stdout
    success(*SWEEP)
    assert len(open_traces("results/plan")) == 7


@pytest.mark.slow
def test_a_dry_run_says_what_is_left_and_writes_nothing(use_fake_engine):
    options = ("--dry-run", "--engine", "scipy", "--shard-size", "8", "--threads", "2")
    assert "10 x 2 = 20" in rbstab(*SWEEP, *options).stdout
    whole = json_of(*SWEEP, *options)
    assert (whole["members"], whole["done"], whole["threads"]) == (20, 0, 2)
    part = json_of(*SWEEP, *options, "--part", "1/2")
    assert (part["members"], part["done"]) == (12, 0)
    assert part["bytes"] == pytest.approx(whole["bytes"] * 12 / 20, abs=1)
    assert not Path("results").exists()
    rbstab(*SWEEP, "--engine", "scipy", "--shard-size", "8")
    assert json_of(*SWEEP, *options)["done"] == 20
    other = rbstab(*SWEEP, *options, "--json", "--set", "body.mass=42")
    assert json.loads(other.stdout)["done"] == 0
    assert "holds a different sweep" in other.stderr


@pytest.mark.slow
def test_another_sweep_is_moved_aside_by_force_only(use_fake_engine):
    rbstab(*SWEEP, "--engine", "scipy")
    before = shard_files(Path("results/plan"))
    for changes in (("--set", "body.mass=42"), ("--engine", "heyoka")):
        refused = ended(2, *SWEEP, *changes)
        assert "holds another sweep" in refused.stderr
    with locked(Path("results/plan")):
        assert "in use by another process" in rbstab(*SWEEP, "--force").stderr
    assert shard_files(Path("results/plan")) == before
    forced = success(*SWEEP, "--set", "body.mass=42", "--force")
    (aside,) = Path("results").glob("plan.*")
    assert f"the previous sweep was moved to {aside}" in forced.stderr
    assert shard_files(aside) == before


@pytest.mark.slow
def test_without_heyoka_scipy_is_used_unless_heyoka_is_wanted(plan, monkeypatch):
    def missing(name):
        if name == "heyoka":
            raise EngineMissingError("the engine 'heyoka' cannot be used here")
        return engine(name)

    monkeypatch.setattr("rbstab.sweep.members.engines.engine", missing)
    done = success(*SWEEP)
    assert done.stderr.count("heyoka is not installed: using scipy") == 1
    refused = ended(2, *SWEEP, "--engine", "heyoka")
    assert "cannot be used here" in refused.stderr


def test_the_next_command_is_named(use_fake_engine):
    done = rbstab(*SWEEP, "--engine", "scipy", "-o", "my results")
    assert done.stderr.endswith(f"Next: rbstab report {shell_word(Path('my results', 'plan'))}\n")
    assert "Next" not in rbstab(*SWEEP, "-o", "my results", "-q").stderr
