"""Protects `rbstab sweep --dask`: interrupts, a lost scheduler, results equal to local ones."""

import signal
import sys
import time
from pathlib import Path

import pytest
from cli.conftest import start, success
from support.clusters import LocalProcesses
from support.sweeps import shard_files

PLAN = """\
title: Spins
base: good.yaml
vary:
  initial.angular_velocity[0]: {linspace: [-4, 4, 400]}
"""

SWEEP = ("sweep", "--no-prove", "plan.yaml", "--engine", "scipy", "--shard-size", "8")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="it has no SIGINT for one process"),
]


@pytest.fixture
def cluster(folder, plan):
    (folder / "cluster").mkdir()
    with LocalProcesses(folder / "cluster") as processes:
        processes.worker()
        processes.worker()
        yield processes


def done_shards():
    return len(shard_files(Path("results/plan")))


def sweep_and_disturb(cluster, act):
    """Sweep on the cluster, call `act` after three shards, and return exit code and messages."""
    before = done_shards()
    # The scheduler is named by its address, or by the file that it writes.
    scheduler = str(cluster.file) if before else cluster.address
    with start(*SWEEP, "--dask", scheduler) as process:
        while done_shards() < before + 3:
            assert process.poll() is None, process.communicate()[1]
            time.sleep(0.01)
        act(process)
        _, stderr = process.communicate(timeout=60)
    return process.returncode, stderr


def test_interrupted_once_twice_and_for_good(cluster):
    def interrupt(process):
        process.send_signal(signal.SIGINT)

    def interrupt_twice(process):
        interrupt(process)
        time.sleep(0.02)
        interrupt(process)

    for act in (interrupt, interrupt_twice):
        code, stderr = sweep_and_disturb(cluster, act)
        assert code == 130
        assert "Traceback" not in stderr
        assert "Run the same command again to resume." in stderr
    code, stderr = sweep_and_disturb(cluster, lambda _: cluster.kill(cluster.scheduler))
    assert code == 4
    assert "Traceback" not in stderr
    assert "does not answer any more" in stderr
    before = shard_files(Path("results/plan"))
    assert 9 <= len(before) < 50
    success(*SWEEP)
    after = shard_files(Path("results/plan"))
    assert before.items() <= after.items()
    success(*SWEEP, "-o", "here")
    assert shard_files(Path("here/plan")) == after
