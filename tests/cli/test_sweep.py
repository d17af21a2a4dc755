"""Protects `rbstab sweep`: the folder it writes, `--status`, `--dry-run`, and its errors."""

import json
import shutil
import signal
import sys
import time
from pathlib import Path

import pytest
import xarray
from cli.conftest import GOOD, start
from support.sweeps import shard_files

from rbstab import load_plan, open_sweep, open_traces, simulate
from rbstab.integrate.engines import EngineMissingError, engine
from rbstab.store.disk.lock import locked
from rbstab.store.table import read_table
from rbstab.sweep.folder.sweep_folder import SHARD
from rbstab_cli.output.sweeps.sweep_progress import RATE_WINDOW, Rate, duration
from rbstab_cli.output.sweeps.sweep_report import size

PLAN = """\
title: Spins
base: good.yaml
vary:
  initial.angular_velocity[0]: {linspace: [-4, 4, 10]}
  controller.K_r: {scale: {values: [1, 2]}}
"""

SWEEP = ("sweep", "--no-prove", "plan.yaml")


@pytest.mark.usefixtures("plan")
@pytest.mark.parametrize("name", ["heyoka", "scipy"])
def test_a_sweep(rbstab, name):
    done = rbstab(*SWEEP, "--engine", name, "--shard-size", "8")
    assert done.exit_code == 0, done.output
    assert "completed       20  100.00%" in done.stdout
    assert "-> results/plan/members.h5" in done.stderr.replace("\\", "/")
    names = sorted(path.name for path in Path("results/plan").iterdir())
    assert names == [".lock", "manifest.json", "members.h5", "plan.yaml", "shards"]
    assert ("4 members, largest relative difference" in done.stdout) == (name == "heyoka")
    with xarray.open_dataset("results/plan/members.h5", engine="h5netcdf") as data:
        assert data.sizes["run"] == 20
        assert data["controller_K_r"].attrs["long_name"] == "factor on controller.K_r"
    again = rbstab(*SWEEP)
    assert (again.exit_code, again.stdout) == (0, done.stdout)
    assert "20 of 20 members are already done" in again.stderr


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("amplitude", [0.0, 50.0])
def test_the_residual_names_what_it_is_divided_by(rbstab, amplitude):
    """A body that is pushed from rest ends with more energy than it had."""
    push = f"{{kind: input, quantity: force, direction: [1, 0, 0], amplitude: {amplitude}, "
    push += "point: [0, 0, 0], signal: {kind: constant}}"
    text = GOOD.replace("title:", "schema_version: 2\ntitle:").replace("[1, 2, -1]", "[0.1, 0, 0]")
    Path("good.yaml").write_text(f"{text}elements: {{push: {push}}}\n")
    plan = "base: good.yaml\nvary:\n  initial.angular_velocity[0]: {values: [0.1, 0.2]}\n"
    Path("plan.yaml").write_text(plan)
    done = rbstab(*SWEEP, "--engine", "scipy")
    assert done.exit_code == 0, done.output
    assert "worst |r| / largest energy " in done.stdout


@pytest.mark.usefixtures("plan")
def test_traces(rbstab):
    Path("plan.yaml").write_text(f"{PLAN}keep: {{traces: {{every: 3}}}}\n")
    with_traces = json.loads(rbstab(*SWEEP, "--dry-run", "--json", "--engine", "heyoka").stdout)
    Path("plan.yaml").write_text(PLAN)
    without = json.loads(rbstab(*SWEEP, "--dry-run", "--json", "--engine", "heyoka").stdout)
    assert with_traces["bytes"] > without["bytes"]
    Path("plan.yaml").write_text(f"{PLAN}keep: {{traces: {{every: 3}}}}\n")
    done = rbstab(*SWEEP, "--engine", "heyoka")
    assert done.exit_code == 0, done.output
    assert "traces" not in done.stderr
    traces = open_traces("results/plan")
    assert traces.members.tolist() == list(range(0, 20, 3))
    single = simulate(load_plan(Path("plan.yaml")).config_of(9))
    assert traces.of(9)["contact_force"] == pytest.approx(single["contact_force"], abs=1e-8)
    status = json.loads(rbstab("sweep", "--status", "results/plan", "--json").stdout)
    assert status["traces"] == 7
    Path("results/plan/traces/00000000.h5").write_bytes(b"")
    status = json.loads(rbstab("sweep", "--status", "results/plan", "--json").stdout)
    assert (status["damaged_shards"], status["done"]) == ([0], 0)
    assert "of 7 members" in rbstab("sweep", "--status", "results/plan").stdout
    assert rbstab(*SWEEP).exit_code == 0
    assert len(open_traces("results/plan")) == 7


@pytest.mark.usefixtures("plan")
def test_a_disk_without_room(rbstab, monkeypatch):
    usage = shutil.disk_usage(".")._replace(free=1000)
    monkeypatch.setattr("rbstab.sweep.folder.open_folder.shutil.disk_usage", lambda _: usage)
    refused = rbstab(*SWEEP, "--engine", "scipy")
    assert refused.exit_code == 4
    assert "GB are free. No member was computed" in refused.stderr


def test_failures(rbstab, use_fake_engine):
    use_fake_engine(failing=(3, 4, 9))
    done = rbstab(*SWEEP, "--engine", "scipy", "--shard-size", "5", "--fail-fast", "--threads", "1")
    assert done.exit_code == 3
    assert "member 3 failed; 5 of 20 members are stored" in done.stderr
    done = rbstab(*SWEEP, "--engine", "scipy")
    assert done.exit_code == 0
    assert "diverged         3  15.00%" in done.stdout
    use_fake_engine()
    done = rbstab(*SWEEP, "--retry-failed")
    assert (done.exit_code, "diverged" in done.stdout) == (0, False)
    use_fake_engine(failing=range(20))
    assert rbstab(*SWEEP, "-o", "other", "--engine", "scipy").exit_code == 3


def test_status(rbstab, use_fake_engine):
    use_fake_engine(failing=(11,))
    options = ("--engine", "scipy", "--shard-size", "8", "--threads", "1")
    rbstab(*SWEEP, *options, "--fail-fast")
    shown = rbstab("sweep", "--status", "results/plan")
    assert shown.exit_code == 0
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
    nothing = rbstab("sweep", "--status", "nowhere")
    assert nothing.exit_code == 4
    assert nothing.stderr == "nowhere is not the folder of a sweep: there is no such folder\n"
    Path("somewhere").mkdir()
    other = rbstab("sweep", "--status", "somewhere")
    assert other.stderr == "somewhere is not the folder of a sweep\n"


@pytest.mark.usefixtures("plan")
@pytest.mark.parametrize("as_json", [False, True])
def test_a_dry_run(rbstab, as_json):
    options = ("--dry-run", "--engine", "heyoka", "--threads", "2")
    shown = rbstab(*SWEEP, *options, *(["--json"] if as_json else []))
    assert shown.exit_code == 0
    assert not Path("results").exists()
    if as_json:
        found = json.loads(shown.stdout)
        assert (found["members"], found["done"], found["threads"]) == (20, 0, 2)
        assert found["bytes"] > 0
    else:
        assert "10 x 2 = 20" in shown.stdout


@pytest.mark.usefixtures("use_fake_engine")
def test_a_dry_run_of_what_is_done(rbstab):
    rbstab(*SWEEP, "--engine", "scipy")
    found = json.loads(rbstab(*SWEEP, "--dry-run", "--json").stdout)
    assert found["done"] == 20
    other = rbstab(*SWEEP, "--dry-run", "--json", "--set", "body.mass=42")
    assert json.loads(other.stdout)["done"] == 0
    assert "holds a different sweep" in other.stderr


@pytest.mark.usefixtures("use_fake_engine")
def test_a_different_plan_in_the_same_folder(rbstab):
    rbstab(*SWEEP, "--engine", "scipy")
    before = shard_files(Path("results/plan"))
    for changes in (("--set", "body.mass=42"), ("--engine", "heyoka")):
        refused = rbstab(*SWEEP, *changes)
        assert refused.exit_code == 2
        assert "holds another sweep" in refused.stderr
    assert shard_files(Path("results/plan")) == before
    forced = rbstab(*SWEEP, "--set", "body.mass=42", "--force")
    assert forced.exit_code == 0
    (aside,) = Path("results").glob("plan.*")
    assert f"the previous sweep was moved to {aside}" in forced.stderr
    assert shard_files(aside) == before


@pytest.mark.usefixtures("use_fake_engine")
@pytest.mark.parametrize("name", ["heyoka", "scipy"])
def test_the_plan_in_a_folder_makes_the_same_sweep_again(rbstab, plan, name):
    plan.rename("spins.yaml")
    rbstab("sweep", "--no-prove", "spins.yaml", "--engine", name, "-q")
    done = rbstab("sweep", "--no-prove", "results/spins/plan.yaml", "-o", "again", "-q")
    assert done.exit_code == 0, done.output
    first, again = (open_sweep(f"{folder}/spins") for folder in ("results", "again"))
    for key in ("engine", "plan_id", "shards_digest"):
        assert again.attributes[key] == first.attributes[key]
    assert rbstab("sweep", "--no-prove", "results/spins/plan.yaml", "-q").exit_code == 0
    assert not Path("results/plan").exists()


@pytest.mark.usefixtures("use_fake_engine")
def test_a_folder_in_use(rbstab):
    Path("results/plan").mkdir(parents=True)
    with locked(Path("results/plan")):
        refused = rbstab(*SWEEP)
    assert refused.exit_code == 4
    assert "in use by another process" in refused.stderr


@pytest.mark.usefixtures("plan")
def test_without_heyoka(rbstab, monkeypatch):
    def missing(name):
        if name == "heyoka":
            raise EngineMissingError("the engine 'heyoka' cannot be used here")
        return engine(name)

    monkeypatch.setattr("rbstab.sweep.members.engines.engine", missing)
    done = rbstab(*SWEEP)
    assert done.exit_code == 0
    assert done.stderr.count("heyoka is not installed: using scipy") == 1
    refused = rbstab(*SWEEP, "--engine", "heyoka")
    assert refused.exit_code == 2
    assert "cannot be used here" in refused.stderr
    # Of a wrong plan only the errors are printed.
    Path("plan.yaml").write_text(PLAN.replace("linspace", "linspcae"))
    wrong = rbstab(*SWEEP, "-o", "other")
    assert wrong.exit_code == 2
    assert "heyoka" not in wrong.stderr


def test_what_a_sweep_says_of_its_progress(rbstab, use_fake_engine, statuses):
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
@pytest.mark.skipif(sys.platform == "win32", reason="an interrupt there reaches the tests too")
def test_interrupts(folder):
    (folder / "plan.yaml").write_text(PLAN.replace("10]", "400]"))
    options = ("--engine", "scipy", "--shard-size", "4", "--set", "integration.duration=0.2")
    shards = Path("results/plan/shards")
    for presses in (1, 2):
        known = len(list(shards.glob("0*.h5")))
        with start(*SWEEP, *options) as process:
            while len(list(shards.glob("0*.h5"))) == known:
                assert process.poll() is None
                time.sleep(0.01)
            for _ in range(presses):
                process.send_signal(signal.SIGINT)
                time.sleep(0.02)
            _, stderr = process.communicate(timeout=20)
        assert process.returncode == 130
        assert "Run the same command again to resume." in stderr
        for path in shards.glob("0*.h5"):
            assert len(read_table(path, SHARD)["run"]) == 4


def test_the_rate_is_that_of_late():
    rate = Rate()
    assert rate(100.0, 50) == 0.0
    assert rate(101.0, 1050) == 1000.0
    assert rate(105.0, 4050) == 800.0
    # Half a window later the fast members still count; a whole window later they do not.
    assert rate(105.0 + RATE_WINDOW / 2, 4065) == pytest.approx(4015 / (5 + RATE_WINDOW / 2))
    assert rate(105.0 + RATE_WINDOW, 4080) == pytest.approx(1.0)
    assert rate(105.0 + 9 * RATE_WINDOW, 4080) == 0.0
