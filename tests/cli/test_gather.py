"""`rbstab sweep --shard` and `rbstab gather`: one sweep by several processes."""

import functools
import json
import signal
import sys
import time
from pathlib import Path

import pytest
from cli.conftest import start
from support.sweeps import FakeEngine, shard_files

from rbstab.integrate.engines import EngineMissingError
from rbstab.store.lock import locked
from rbstab.store.table_file import read_table
from rbstab.sweep.folder.open_folder import open_for_part
from rbstab.sweep.folder.parts import Part
from rbstab.sweep.plan.load import load_plan

PLAN = """\
title: Spins
base: good.yaml
vary:
  initial.angular_velocity[0]: {linspace: [-4, 4, 20]}
"""

SWEEP = ("sweep", "plan.yaml", "--engine", "scipy", "--shard-size", "4")


@pytest.fixture
def plan(folder):
    (folder / "plan.yaml").write_text(PLAN)
    return folder / "plan.yaml"


@pytest.fixture
def fake(monkeypatch, plan):
    """Lets a made up engine follow the members, with failures as its arguments say."""

    def fake(**arguments):
        made = functools.partial(FakeEngine, **arguments)
        monkeypatch.setattr("rbstab.sweep.sweep.factory_for", lambda _: made)

    fake()
    return fake


@pytest.mark.usefixtures("fake")
def test_parts_and_what_joins_them(rbstab):
    whole = rbstab(*SWEEP, "-o", "whole")
    for number, shards in ((1, 3), (2, 2)):
        done = rbstab(*SWEEP, "--shard", f"{number}/2")
        assert done.exit_code == 0, done.output
        said = f"{shards} of {shards} shards of part {number}/2 are stored."
        assert said in done.stderr
        assert "rbstab gather results/plan" in done.stderr.replace("\\", "/")
        words = [line.split() for line in done.stdout.splitlines()]
        assert ["completed", str(4 * shards), "100.00%"] in words
        assert not Path("results/plan/sweep.h5").exists()
    gathered = rbstab("gather", "results/plan")
    assert gathered.exit_code == 0
    assert gathered.stdout == whole.stdout
    assert "-> results/plan/sweep.h5" in gathered.stderr.replace("\\", "/")
    assert shard_files(Path("results/plan")) == shard_files(Path("whole/plan"))
    digests = {
        read_table(Path(name) / "plan" / "sweep.h5").attributes["arrays_digest"]
        for name in ("results", "whole")
    }
    assert len(digests) == 1
    again = rbstab("gather", "results/plan")
    assert (again.exit_code, again.stdout) == (0, whole.stdout)
    assert "results/plan is gathered already" in again.stderr.replace("\\", "/")


@pytest.mark.usefixtures("plan")
def test_the_comparison_is_made_when_the_parts_are_joined(rbstab):
    options = ("sweep", "plan.yaml", "--engine", "heyoka", "--shard-size", "10")
    for number in (1, 2):
        assert rbstab(*options, "--shard", f"{number}/2").exit_code == 0
    assert not Path("results/plan/check.json").exists()
    gathered = rbstab("gather", "results/plan")
    assert gathered.exit_code == 0
    assert "1 members, largest relative difference" in gathered.stdout
    assert Path("results/plan/check.json").exists()


@pytest.mark.usefixtures("fake")
def test_missing_shards(rbstab):
    rbstab(*SWEEP, "--shard", "1/3")
    missing = rbstab("gather", "results/plan")
    assert missing.exit_code == 3
    assert (
        "3 of 5 shards are missing, of part 2/3, 3/3: members 4 to 11, 16 to 19" in missing.stderr
    )
    assert "rbstab sweep PLAN --shard 2/3" in missing.stderr
    found = json.loads(rbstab("gather", "results/plan", "--json", "-q").stdout)
    assert (found["finished"], found["missing"]) == (False, [[4, 12], [16, 20]])
    # A sweep that was killed knows no parts.
    for lock in Path("results/plan").glob(".lock.*"):
        lock.unlink()
    missing = rbstab("gather", "results/plan")
    assert "3 of 5 shards are missing: members 4 to 11, 16 to 19" in missing.stderr
    assert "--shard" not in missing.stderr


@pytest.mark.usefixtures("fake")
def test_for_machines(rbstab):
    done = rbstab(*SWEEP, "--shard", "2/2", "--json", "-q")
    assert (done.exit_code, done.stderr) == (0, "")
    found = json.loads(done.stdout)
    part = {"number": 2, "parts": 2, "shards": 2, "done_shards": 2, "members": 8}
    assert found["part"] == part
    assert (found["finished"], found["done"], found["members"]) == (False, 8, 20)
    rbstab(*SWEEP, "--shard", "1/2")
    gathered = rbstab("gather", "results/plan", "--json", "-q")
    assert (gathered.exit_code, gathered.stderr) == (0, "")
    found = json.loads(gathered.stdout)
    assert (found["finished"], found["by_status"]) == (True, {"completed": 20})
    assert "missing" not in found


@pytest.mark.parametrize("part", ["0/3", "4/3", "1", "x/y", "1/0", ""])
def test_a_part_that_is_none(rbstab, plan, part):
    refused = rbstab(*SWEEP, "--shard", part)
    assert refused.exit_code == 2
    assert "part" in refused.stderr
    assert not Path("results").exists()


@pytest.mark.usefixtures("plan")
@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--shard", "1/2", "--force"), "--shard cannot be combined with --force"),
        (("--dask", "tcp://x:1", "--threads", "2"), "--dask cannot be combined with --threads"),
        (("--dask", "tcp://x:1", "--dry-run"), "--dask cannot be combined with --dry-run"),
    ],
)
def test_options_that_rule_each_other_out(rbstab, options, said):
    refused = rbstab(*SWEEP, *options)
    assert refused.exit_code == 2
    assert said in refused.stderr


@pytest.mark.usefixtures("plan")
def test_a_dry_run_of_a_part(rbstab, monkeypatch):
    monkeypatch.setattr("rbstab.sweep.execution.estimate.CALIBRATION", 0.01)
    whole = json.loads(rbstab(*SWEEP, "--dry-run", "--json").stdout)
    found = json.loads(rbstab(*SWEEP, "--dry-run", "--json", "--shard", "1/2").stdout)
    assert (found["members"], found["done"], found["check_seconds"]) == (12, 0, 0)
    assert found["bytes"] == pytest.approx(whole["bytes"] * 12 / 20, abs=1)
    rbstab(*SWEEP, "--shard", "2/2")
    found = json.loads(rbstab(*SWEEP, "--dry-run", "--json", "--shard", "2/2").stdout)
    assert (found["members"], found["done"]) == (8, 8)
    assert "of part 2/2" in rbstab(*SWEEP, "--dry-run", "--shard", "2/2").stdout


def test_exit_codes_of_a_part(rbstab, fake):
    fake(failing=range(20))
    assert rbstab(*SWEEP, "--shard", "1/2").exit_code == 3
    assert rbstab(*SWEEP, "--shard", "9/9", "-o", "other").exit_code == 0  # nothing to be done
    fake(failing=(5,))
    failed = rbstab(*SWEEP, "--shard", "2/2", "--fail-fast", "--threads", "1")
    assert failed.exit_code == 3
    assert "member 5 failed; 1 of 2 shards of part 2/2 are stored" in failed.stderr
    fake(failing=(15,))
    at_the_end = rbstab(*SWEEP, "--shard", "2/2", "--fail-fast", "--retry-failed")
    assert at_the_end.exit_code == 3
    assert "member 15 failed; 2 of 2 shards of part 2/2 are stored" in at_the_end.stderr
    other = rbstab(*SWEEP, "--shard", "2/2", "--set", "body.mass=42")
    assert other.exit_code == 4
    assert "holds another sweep" in other.stderr
    size = rbstab(*SWEEP, "--shard", "2/2", "--shard-size", "5")
    assert size.exit_code == 4
    assert "begun with shards of 4 members" in size.stderr


@pytest.mark.usefixtures("fake")
def test_which_parts_run(rbstab):
    rbstab(*SWEEP, "--shard", "1/3")
    loaded = load_plan("plan.yaml", ["integration.engine=scipy"])
    with open_for_part(Path("results/plan"), loaded, 4, Part(2, 3)):
        said = rbstab("sweep", "--status", "results/plan")
        found = json.loads(rbstab("sweep", "--status", "results/plan", "--json").stdout)
        for refused in (rbstab(*SWEEP), rbstab("gather", "results/plan")):
            assert refused.exit_code == 4
            assert "in use by another process (running: part 2/3)" in refused.stderr
    assert ["running", "part", "2/3"] in [line.split() for line in said.stdout.splitlines()]
    assert found["running"] is True
    assert found["running_parts"] == [{"number": 2, "parts": 3}]
    with locked(Path("results/plan")):
        assert rbstab(*SWEEP, "--shard", "1/3").exit_code == 4


@pytest.mark.usefixtures("folder")
def test_gathering_what_is_none(rbstab):
    refused = rbstab("gather", "results")
    assert refused.exit_code == 4
    assert "results is not the folder of a sweep" in refused.stderr
    assert not Path("results").exists()


@pytest.mark.usefixtures("plan")
def test_gathering_without_the_engine(rbstab, monkeypatch):
    def missing(name):
        raise EngineMissingError(f"the engine {name!r} cannot be used here")

    options = ("sweep", "plan.yaml", "--engine", "heyoka", "--set", "integration.duration=0.01")
    assert rbstab(*options, "--shard", "1/1").exit_code == 0
    monkeypatch.setattr("rbstab.sweep.members.engines.engine", missing)
    refused = rbstab("gather", "results/plan")
    assert refused.exit_code == 2
    assert "the engine 'heyoka' cannot be used here" in refused.stderr
    assert not Path("results/plan/sweep.h5").exists()


@pytest.mark.usefixtures("plan")
def test_without_distributed(rbstab, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "rbstab.sweep.execution.dask_executor", raising=False)
    monkeypatch.delitem(sys.modules, "rbstab.sweep.execution.dask_worker", raising=False)
    refused = rbstab(*SWEEP, "--dask", "tcp://127.0.0.1:9")
    assert refused.exit_code == 2
    assert "pip install 'rbstab[cluster]'" in refused.stderr


@pytest.mark.usefixtures("plan")
def test_a_scheduler_that_does_not_answer(rbstab, monkeypatch):
    monkeypatch.setattr("rbstab.sweep.execution.dask_executor.TIME_LIMIT", 0.5)
    refused = rbstab(*SWEEP, "--dask", "tcp://127.0.0.1:9")
    assert refused.exit_code == 2
    assert "--dask tcp://127.0.0.1:9: the scheduler cannot be reached" in refused.stderr
    assert not Path("results").exists()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="an interrupt there reaches the tests too")
@pytest.mark.usefixtures("plan")
def test_interrupting_a_part():
    Path("plan.yaml").write_text(PLAN.replace("20]", "400]"))
    options = ("--set", "integration.duration=0.2", "--shard", "1/2")
    with start(*SWEEP, *options) as process:
        while not shard_files(Path("results/plan")):
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "of 50 shards of part 1/2 are stored." in said
    assert "The same command goes on" in said
    assert all(int(Path(name).stem) % 2 == 0 for name in shard_files(Path("results/plan")))
