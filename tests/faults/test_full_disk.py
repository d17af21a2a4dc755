"""Protects results against a disk that another process fills while a command writes.

Each trial has a disk of another size, which is filled at another moment. The command ends with
exit code 0 and right results, or with exit code 4 and one clear line. Every file is whole then.
Once there is space, the same command gives the same results as if nothing had happened.
"""

import random
import time

import pytest
from faults.contents import partial_files
from faults.disturbed_commands import CASES, Undisturbed, daily_and_long
from faults.full_disks import PLENTY, SmallDisk, small_disk
from support.forked_commands import Command, Ended

PAGE = 4096

SPARE = 1 << 21
"""Bytes; a command with so many free bytes more than it writes begins to write."""


@pytest.fixture(scope="module")
def disk(tmp_path_factory):
    with small_disk(tmp_path_factory.mktemp("disk") / "disk") as found:
        yield found


class Trials:
    """Trials of one command on full disks.

    Args:
        done: The command on a disk with enough space.
        disk: The disk.
    """

    def __init__(self, done: Undisturbed, disk: SmallDisk) -> None:
        self.done = done
        self.disk = disk

    def _start(self) -> Command:
        # The data of a report go to stdout, which is on the disk too.
        stdout = self.disk.inside / "data.txt" if self.done.name == "data" else None
        return self.disk.server.start(self.disk.inside / "work", *self.done.words, stdout=stdout)

    def run(self, number: int) -> None:
        """Fill the disk while the command runs; then free it, and repeat the command."""
        rng = random.Random(f"{self.done.name} {number}")  # noqa: S311 (seeded trials)
        work = self.disk.path / "work"
        self.disk.mount(PLENTY)
        try:
            self.done.copy_to(work)
            self.disk.resize(self._size(rng) // PAGE * PAGE)
            command = self._start()
            self._fill(command, rng)
            self._check(command.wait(), work)
            self.disk.free()
            ended = self._start().wait()
            ended.assert_no_debris()
            self.done.assert_done(work, ended)
            assert partial_files(work) == []
        finally:
            self.disk.unmount()

    def _size(self, rng: random.Random) -> int:
        """Return a size of the disk: in half of the trials it is large enough at first."""
        if rng.random() < 0.5:
            return self.disk.used + PAGE + int(self.done.size * rng.uniform(0, 1))
        return self.disk.used + SPARE + int(self.done.size * rng.uniform(1, 2))

    def _fill(self, command: Command, rng: random.Random) -> None:
        """Fill the disk at a random moment; in half of the trials, take all freed space too."""
        if rng.random() < 0.5:
            time.sleep(rng.uniform(0, self.done.seconds))
        else:
            work = self.disk.path / "work"
            folders = [path for path in work.rglob("*") if path.is_dir()]
            command.until_writing(work, *folders, work / "results/plan/shards")
            time.sleep(self.done.short_delay(rng))
        again = rng.random() < 0.5
        self.disk.fill()
        while again and command.running:
            time.sleep(0.001)
            self.disk.fill()

    def _check(self, ended: Ended, work) -> None:
        ended.assert_no_debris()
        self.done.assert_whole(work)
        assert ended.code in (0, 4), ended
        if ended.code == 0:
            self.done.assert_done(work, ended)
        else:
            (line,) = ended.stderr.splitlines()
            assert "No space left on device" in line or "GB are free" in line


@pytest.mark.parametrize(("name", "numbers"), daily_and_long(dict.fromkeys(CASES, (2, 50))))
def test_a_disk_that_is_filled_meanwhile(name, numbers, disk, undisturbed):
    trials = Trials(undisturbed(name), disk)
    for number in numbers:
        trials.run(number)
