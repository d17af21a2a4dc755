"""Parts of a sweep by several processes at once: begun in one instant, killed, joined."""

import random
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.sweeps import FakeEngine, plan_of, shard_files

from rbstab.store.table_file import read_table
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import gather_folder, sweep_to_folder

pytestmark = pytest.mark.slow


@pytest.fixture
def whole(tmp_path):
    """The same sweep by one process."""
    sweep_to_folder(plan_of(1500), tmp_path / "whole", SweepOptions(FakeEngine, 1, 50))
    return tmp_path / "whole"


def digest_of(path):
    return read_table(path / "sweep.h5").attributes["arrays_digest"]


PROCESS = """
import functools, sys, time
from pathlib import Path
from support.sweeps import FakeEngine, plan_of
from rbstab.sweep.folder.parts import part_of
from rbstab.sweep.sweep import SweepOptions, sweep_to_folder
path, part, delay = sys.argv[1:]
factory = functools.partial(FakeEngine, delay=float(delay))
plan = plan_of(1500)
print("ready", flush=True)
sys.stdin.readline()
done = sweep_to_folder(plan, Path(path), SweepOptions(factory, 1, 50, part=part_of(part)))
print(len(done.inventory.done), flush=True)
"""


def processes(path, *parts, delay=0.0):
    """One process for each part, all begun in the same instant."""
    command = [sys.executable, "-c", PROCESS, str(path)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    tests = Path(__file__).parents[2]
    started = [subprocess.Popen([*command, p, str(delay)], cwd=tests, **pipes) for p in parts]
    for process in started:
        assert process.stdout.readline() == "ready\n"
    for process in started:
        process.stdin.write("go\n")
        process.stdin.flush()
    return started


def ended(started):
    """The number of shards that each of them had done at its end."""
    numbers = []
    for process in started:
        said, _ = process.communicate(timeout=120)
        numbers.append((process.returncode, said.strip()))
    return numbers


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
