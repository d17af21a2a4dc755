"""A long sweep on a cluster whose workers are killed all the time; `make soak` runs it.

The results must equal those of a sweep that nothing disturbs, and no process may take more and more
memory. One worker lives as long as the sweep; of the others one is killed every few seconds, and
replaced.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import psutil
import yaml

from rbstab.sweep.folder.sweep_table import read_sweep
from support.clusters import LocalProcesses
from support.configs import VISCO_ELASTIC, plain
from support.sweeps import shard_files

MEMBERS = 1_000_000
KILL_INTERVAL = 4.0
"""s between two kills."""

MAX_GROWTH = 50e6
"""Bytes by which the memory of a process may grow after the first part of the sweep."""

MAX_FINISHING = MAX_GROWTH + 30e6
"""The same for the members file, beside twice its size: it is in memory by shards and whole, and
writing it imports libraries that nothing needed before."""

WARM_UP = 0.2
"""The part of the members in which a process may grow: it imports, compiles, and fills caches."""

SAMPLE_INTERVAL = 0.25
LINE_INTERVAL = 10.0

Say = Callable[[str], None]


class Memory:
    """The memory of a process that lives as long as the sweep, sampled.

    Args:
        name: The name of the process, for messages.
        pid: Its ID.
    """

    def __init__(self, name, pid):
        self.name = name
        self.process = psutil.Process(pid)
        self.samples: list[tuple[float, int]] = []
        """The share of the members that was done, and the memory, bytes."""

    def sample(self, share):
        """Read the memory; the process may have ended."""
        with suppress(psutil.NoSuchProcess):
            self.samples.append((share, int(self.process.memory_info().rss)))

    def largest(self, begin, end):
        """Return the largest memory while the share was between two values, bytes."""
        return max((size for share, size in self.samples if begin <= share < end), default=0)

    @property
    def growth(self):
        """The bytes by which it grew after the first part of the sweep."""
        return self.largest(WARM_UP, 1) - self.largest(0, WARM_UP)

    @property
    def needed_to_finish(self):
        """The bytes by which it grew when all shards were there: the members file was written."""
        return max(0, self.largest(1, np.inf) - self.largest(0, 1))

    def __str__(self):
        return f"{self.name} {self.largest(0, np.inf) / 1e6:.0f} MB"


class Soaked(NamedTuple):
    """What a soak has found.

    Attributes:
        seconds: Its duration.
        kills: The number of killed workers.
        growth: The growth of each process while members were computed, bytes.
        finishing: The growth of each process while the members file was written, bytes.
        file_size: The size of that file, bytes.
        equal: Whether the results are those of an undisturbed sweep.
    """

    seconds: float
    kills: int
    growth: dict[str, int]
    finishing: dict[str, int]
    file_size: int
    equal: bool

    @property
    def problems(self):
        """Return what is wrong, as sentences."""
        sentences = [
            f"the {name} grew by {size / 1e6:.0f} MB (at most {MAX_GROWTH / 1e6:.0f} MB)"
            for name, size in self.growth.items()
            if size > MAX_GROWTH
        ]
        sentences += [
            f"the {name} needed {size / 1e6:.0f} MB to write {self.file_size / 1e6:.0f} MB"
            for name, size in self.finishing.items()
            if size > 2 * self.file_size + MAX_FINISHING
        ]
        sentences += [] if self.equal else ["the results differ from those of an undisturbed sweep"]
        return sentences + ([] if self.kills else ["no worker was killed: the sweep is too short"])


def soak(folder, members, kill_interval, say=print):
    """Sweep with and without kills, and compare.

    Args:
        folder: An empty folder.
        members: The number of members.
        kill_interval: The time between two kills, s.
        say: Called with a line every ten seconds.

    Raises:
        AssertionError: A sweep failed.
    """
    begin = time.monotonic()
    _write_plan(folder / "plan.yaml", members)
    plain_sweep = _start(folder, "plain")
    plain_log = (folder / "plain.log").read_text
    assert plain_sweep.wait() == 0, plain_log()
    say(f"{time.monotonic() - begin:6.0f} s  {members} members without kills")
    with LocalProcesses(folder) as cluster:
        kills, memories = _sweep_and_kill(folder, members, cluster, kill_interval, say)
    seconds = time.monotonic() - begin
    return Soaked(
        seconds,
        kills,
        {memory.name: memory.growth for memory in memories},
        {memory.name: memory.needed_to_finish for memory in memories},
        (folder / "killed/plan/members.h5").stat().st_size,
        _equal(folder / "plain/plan", folder / "killed/plan"),
    )


def _write_plan(path, members):
    base = plain(VISCO_ELASTIC)
    base["body"]["inertia"] = [10.0, 8.0, 3.0]
    base["integration"] = {"duration": 0.5, "samples": 51, "rtol": 1e-8}
    keys = [f"initial.angular_velocity[{axis}]" for axis in (0, 1)]
    vary = {key: {"uniform": [-40, 40]} for key in keys}
    plan = {"base": base, "vary": vary, "design": "random", "members": members, "seed": 1}
    path.write_text(yaml.safe_dump(plan))


def _start(folder, name, *options):
    command = ("sweep", str(folder / "plan.yaml"), "-o", str(folder / name), "--engine", "heyoka")
    with (folder / f"{name}.log").open("wb") as log:
        return subprocess.Popen(
            [sys.executable, "-m", "rbstab_cli", *command, *options], stdout=log, stderr=log
        )


def _sweep_and_kill(folder, members, cluster, kill_interval, say):
    """Sweep on a cluster; return the number of killed workers, and the memory of the others."""
    lasting, victim = cluster.worker(), cluster.worker()
    sweep = _start(folder, "killed", "--dask", str(cluster.file))
    named = {"sweep": sweep, "scheduler": cluster.scheduler, "lasting worker": lasting}
    memories = [Memory(name, process.pid) for name, process in named.items()]
    shards = folder / "killed/plan/shards"
    begin = said = time.monotonic()
    killed_at, kills, done = begin, 0, 0
    while sweep.poll() is None:
        now = time.monotonic()
        share = done / max(1, len(shard_files_of(folder / "plain/plan/shards")))
        for memory in memories:
            memory.sample(share)
        if 0 < share < 1 and now - killed_at > kill_interval:
            cluster.kill(victim)
            victim, kills, killed_at = cluster.worker(), kills + 1, now
        if now - said > LINE_INTERVAL:
            said = now
            text = ", ".join(map(str, memories))
            say(f"{now - begin:6.0f} s  {share:4.0%} of {members} members, {kills} kills, {text}")
        time.sleep(SAMPLE_INTERVAL)
        done = len(shard_files_of(shards))
    assert sweep.returncode == 0, (folder / "killed.log").read_text()
    return kills, memories


def shard_files_of(folder):
    """Return the paths of the shards in a folder; it may not exist yet."""
    return list(folder.glob("[0-9]*.h5"))


def _equal(folder, other):
    files = [read_sweep(path / "members.h5") for path in (folder, other)]
    digests = {table.attributes["shards_digest"] for table in files}
    same = all(
        files[0][name].tobytes() == files[1][name].tobytes() for name in ["run", *files[0].columns]
    )
    return len(digests) == 1 and same and shard_files(folder) == shard_files(other)


def main():
    """Run the soak, print its verdict, and end with exit code 1 if something is wrong."""
    parser = argparse.ArgumentParser(description="Sweep while workers are killed.")
    parser.add_argument("--members", type=int, default=MEMBERS)
    parser.add_argument("--kill-interval", type=float, default=KILL_INTERVAL, help="s")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        soaked = soak(Path(folder), given.members, given.kill_interval)
    growth = ", ".join(f"{name} {size / 1e6:+.0f} MB" for name, size in soaked.growth.items())
    print(f"{soaked.seconds:6.0f} s  {soaked.kills} workers were killed; growth: {growth}")  # noqa: T201
    needed = f"{soaked.finishing['sweep'] / 1e6:.0f} MB to write {soaked.file_size / 1e6:.0f} MB"
    print(f"the sweep needed {needed}")  # noqa: T201
    for problem in soaked.problems:
        print(f"FAILED: {problem}")  # noqa: T201
    if soaked.problems:
        sys.exit(1)
    print("PASSED: the results are equal, and the memory is flat")  # noqa: T201


if __name__ == "__main__":
    main()
