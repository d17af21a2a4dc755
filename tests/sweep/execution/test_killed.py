"""Protects sweeps against kills: a sweep killed at any instant resumes and keeps its bits."""

import random
import signal
import time

import pytest
from support.forked_sweeps import MEMBERS, SHARD_SIZE, ForkedSweep, sweep_whole
from support.sweeping import digest_of, run_sweep
from support.sweeps import plan_with_traces, shard_files


def whole(path, keep):
    """Run the sweep in this process."""
    run_sweep(path, plan_with_traces(MEMBERS, keep), shard_size=SHARD_SIZE)


def kill_until_done(path, keep, instants):
    """Kill the sweep at instants (s after its first shard), then run it to its end."""
    for instant in instants:
        process = ForkedSweep(sweep_whole, path, keep, 3e-4)
        if process.receive() is not None:
            time.sleep(instant)
        process.kill()
        process.end()
    process = ForkedSweep(sweep_whole, path, keep, 0)
    assert process.end() == 0


@pytest.mark.heavy
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="nothing is killed like that here")
@pytest.mark.parametrize("keep", ["summary", "traces"])
def test_killed_at_fifty_random_instants(tmp_path, keep):
    whole(tmp_path / "a", keep)
    rng = random.Random(50)  # noqa: S311
    for sweep_number in range(10):
        path = tmp_path / str(sweep_number)
        kill_until_done(path, keep, [rng.uniform(0, 0.08) for _ in range(5)])
        for kind in ("shards", "traces"):
            assert shard_files(path, kind) == shard_files(tmp_path / "a", kind)
        assert digest_of(path) == digest_of(tmp_path / "a")
