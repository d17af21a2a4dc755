"""Protects parts of one sweep in several processes: started at once, killed, and gathered."""

import random
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.sweeping import digest_of
from support.sweeps import FakeEngine, plan_of, shard_files

from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import gather_folder, sweep_to_folder

pytestmark = pytest.mark.slow


@pytest.fixture
def whole(tmp_path):
    """The folder of the same sweep, run by one process."""
    sweep_to_folder(plan_of(1500), tmp_path / "whole", SweepOptions(FakeEngine, 1, 50))
    return tmp_path / "whole"


PROCESS = """
import functools, sys, time
from pathlib import Path
from support.sweeps import FakeEngine, plan_of
from rbstab.sweep.folder.parts import parse_part
from rbstab.sweep.sweep import SweepOptions, sweep_to_folder
path, part, delay = sys.argv[1:]
factory = functools.partial(FakeEngine, delay=float(delay))
plan = plan_of(1500)
print("ready", flush=True)
sys.stdin.readline()
done = sweep_to_folder(plan, Path(path), SweepOptions(factory, 1, 50, part=parse_part(part)))
print(len(done.inventory.done), flush=True)
"""


def processes(path, *parts, delay=0.0):
    """Start one process for each part, all at the same instant."""
    started = [
        subprocess.Popen(
            [sys.executable, "-c", PROCESS, str(path), part, str(delay)],
            cwd=Path(__file__).parents[2],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for part in parts
    ]
    for process in started:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    for process in started:
        assert process.stdin is not None
        process.stdin.write("go\n")
        process.stdin.flush()
    return started


def ended(started):
    """Wait for processes; return the exit code and the number of done shards of each."""
    results = []
    for process in started:
        output, _ = process.communicate(timeout=120)
        results.append((process.returncode, output.strip()))
    return results


def test_parts_begun_in_the_same_instant(tmp_path, whole):
    for turn in range(4):
        path = tmp_path / str(turn)
        found = ended(processes(path, *(f"{number}/4" for number in range(1, 5))))
        assert found == [(0, "8"), (0, "8"), (0, "7"), (0, "7")]
        assert not list(path.glob("**/.*.part"))
        assert gather_folder(path).finished
        assert shard_files(path) == shard_files(whole)
        assert digest_of(path) == digest_of(whole)


def test_parts_that_are_killed_and_go_on(tmp_path, whole):
    path, names = tmp_path / "a", ("1/3", "2/3", "3/3")
    rng = random.Random(7)  # noqa: S311
    for _ in range(2):
        known = shard_files(path)
        started = processes(path, *names, delay=5e-3)
        while shard_files(path) == known:
            time.sleep(0.01)
        for process in started:
            time.sleep(rng.uniform(0, 0.1))
            process.kill()
        ended(started)
    assert gather_folder(path).inventory.missing
    assert [code for code, _ in ended(processes(path, *names))] == [0, 0, 0]
    assert gather_folder(path).finished
    assert shard_files(path) == shard_files(whole)
    assert digest_of(path) == digest_of(whole)
