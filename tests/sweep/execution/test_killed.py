"""Protects sweeps against kills: a sweep killed at any instant resumes and keeps its bits."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.sweeping import digest_of, run_sweep
from support.sweeps import plan_with_traces, shard_files

SWEEPER = """
import functools, sys
from pathlib import Path
from support.sweeps import FakeEngine, plan_with_traces
from rbstab.sweep.execution.events import ShardDone
from rbstab.sweep.sweep import SweepOptions, sweep_to_folder
def on_event(event):
    if isinstance(event, ShardDone):
        print(event.number, flush=True)
factory = functools.partial(FakeEngine, delay=float(sys.argv[2]))
options = SweepOptions(factory=factory, shard_size=50, threads=2)
sweep_to_folder(plan_with_traces(1500, sys.argv[3]), Path(sys.argv[1]), options, on_event)
"""


def sweeper(path, keep, delay=3e-4):
    """Start a sweep in its own process."""
    return subprocess.Popen(
        [sys.executable, "-c", SWEEPER, str(path), str(delay), keep],
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
    )


def kill_until_done(path, keep, instants):
    """Kill the sweep at instants (s after its first shard), then run it to its end."""
    for instant in instants:
        with sweeper(path, keep) as process:
            if process.stdout.readline():
                time.sleep(instant)
            process.kill()
    with sweeper(path, keep, 0) as process:
        assert process.wait() == 0


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="nothing is killed like that here")
@pytest.mark.parametrize("keep", ["summary", "traces"])
def test_killed_at_random_instants(tmp_path, keep):
    run_sweep(tmp_path / "a", plan_with_traces(1500, keep), shard_size=50)
    instants = [random.Random(seed).uniform(0, 0.06) for seed in range(3)]  # noqa: S311
    kill_until_done(tmp_path / "b", keep, instants)
    for kind in ("shards", "traces"):
        assert shard_files(tmp_path / "b", kind) == shard_files(tmp_path / "a", kind)
    assert digest_of(tmp_path / "b") == digest_of(tmp_path / "a")


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="nothing is killed like that here")
@pytest.mark.parametrize("keep", ["summary", "traces"])
def test_killed_at_fifty_random_instants(tmp_path, keep):
    run_sweep(tmp_path / "a", plan_with_traces(1500, keep), shard_size=50)
    rng = random.Random(50)  # noqa: S311
    for sweep_number in range(10):
        path = tmp_path / str(sweep_number)
        kill_until_done(path, keep, [rng.uniform(0, 0.08) for _ in range(5)])
        assert digest_of(path) == digest_of(tmp_path / "a")
        assert shard_files(path, "traces") == shard_files(tmp_path / "a", "traces")
