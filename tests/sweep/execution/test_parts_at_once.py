"""Protects parts of one sweep in several processes: started at once, killed, and finished."""

import time

import pytest
from support.forked_sweeps import MEMBERS, SHARD_SIZE, ForkedSweep, sweep_part
from support.sweeping import digest_of
from support.sweeps import FakeEngine, plan_of, shard_files

from rbstab.sweep.folder.shard_inventory import shard_inventory
from rbstab.sweep.folder.sweep_folder import read_folder
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import sweep_to_folder

pytestmark = pytest.mark.slow


@pytest.fixture
def whole(tmp_path):
    """The folder of the same sweep, run by one process."""
    sweep_to_folder(plan_of(MEMBERS), tmp_path / "whole", SweepOptions(FakeEngine, 1, SHARD_SIZE))
    return tmp_path / "whole"


def finish(path):
    return sweep_to_folder(plan_of(MEMBERS), path, SweepOptions(FakeEngine, 1, SHARD_SIZE))


def processes(path, *parts, delay=0.0, **options):
    """Start one process for each part, all at the same instant."""
    started = [ForkedSweep(sweep_part, path, part, delay, options) for part in parts]
    begin(started)
    return started


def begin(started):
    """Tell processes to go when all are ready."""
    for process in started:
        assert process.receive() == "ready"
    for process in started:
        process.pipe.send("go")


def ended(started):
    """Wait for processes; return the exit code and the number of done shards of each."""
    results = []
    for process in started:
        done = process.receive()
        results.append((process.end(), done))
    return results


def test_parts_begun_in_the_same_instant(tmp_path, whole):
    for turn in range(4):
        path = tmp_path / str(turn)
        endings = ended(processes(path, *(f"{number}/4" for number in range(1, 5))))
        assert endings == [(0, 8), (0, 8), (0, 7), (0, 7)]
        assert not list(path.glob("**/.*.part"))
        assert finish(path).finished
        assert shard_files(path) == shard_files(whole)
        assert digest_of(path) == digest_of(whole)


def test_two_commands_at_once(tmp_path, whole):
    """Equal plans share a folder. Of two that differ, one is refused; whose, is chance."""
    for turn in range(3):
        path = tmp_path / f"equal{turn}"
        assert ended(processes(path, "1/1", "1/1")) == [(0, 30), (0, 30)]
        assert shard_files(path) == shard_files(whole)
        assert digest_of(path) == digest_of(whole)
        for name, other in (("plan", {"members": 59}), ("size", {"shard_size": 70})):
            path = tmp_path / f"{name}{turn}"
            pair = [ForkedSweep(sweep_part, path, "1/1", 0.0, options) for options in ({}, other)]
            begin(pair)
            endings = ended(pair)
            assert sorted(code for code, _ in endings) == [0, 1]
            (refused,) = (said for code, said in endings if code)
            assert refused.startswith("OtherSweepError: ")
            assert shard_inventory(read_folder(path)).missing == []
            assert not list(path.glob("**/.*.part"))


def test_force_beside_another_command(tmp_path, whole):
    """It waits for nobody: one of the two is refused, and what the other has made is whole."""
    for option in ("force", "retry_failed"):
        path = tmp_path / option
        slow = ForkedSweep(sweep_part, path, "1/1", 1e-3, {})
        begin([slow])
        while not shard_files(path):
            time.sleep(0.01)
        forced = ForkedSweep(sweep_part, path, "1/1", 0.0, {"members": 59, option: True})
        begin([forced])
        ((code, refused),) = ended([forced])
        assert (code, refused.partition(":")[0]) == (1, "FolderInUseError")
        assert ended([slow]) == [(0, 30)]
        assert shard_files(path) == shard_files(whole)
