"""Protects results against a disk that another process fills while a command writes.

Each trial has a disk of another size, which is filled at another moment. The command ends with
exit code 0 and right results, or with exit code 4 and one clear line. Every file is whole then.
Once there is space, the same command gives the same results as if nothing had happened.
"""

import time

import pytest
from faults.disturbed_commands import CASES, daily_and_long
from faults.full_disks import PLENTY, small_disk

PAGE = 4096

SPARE = 1 << 21
"""Bytes; a command with so many free bytes more than it writes begins to write."""


@pytest.fixture(scope="module")
def disk(tmp_path_factory):
    with small_disk(tmp_path_factory.mktemp("disk") / "disk") as mounted:
        yield mounted


def start(done, disk):
    # The data of a report go to stdout, which is on the disk too.
    stdout = disk.inside / "data.txt" if done.name == "data" else None
    return disk.server.start(disk.inside / "work", *done.words, stdout=stdout)


def size_of(disk, done, rng):
    """Return a size of the disk: in half of the trials it is large enough at first."""
    if rng.random() < 0.5:
        return disk.used + PAGE + int(done.size * rng.uniform(0, 1))
    return disk.used + SPARE + int(done.size * rng.uniform(1, 2))


def fill(disk, command, done, rng):
    """Fill the disk at a random moment; in half of the trials, take all freed space too."""
    done.wait(command, rng, disk.path / "work")
    again = rng.random() < 0.5
    disk.fill()
    while again and command.running:
        time.sleep(0.001)
        disk.fill()


def assert_done_or_refused(done, ended, work):
    ended.assert_no_debris()
    assert done.problems(work) == []
    assert ended.code in (0, 4), ended
    if ended.code == 0:
        done.assert_done(work, ended)
    else:
        # A warning of the config may stand before the error.
        (line,) = (row for row in ended.stderr.splitlines() if not row.startswith("warning: "))
        assert "No space left on device" in line or "GB are free" in line


@pytest.mark.parametrize(("name", "numbers"), daily_and_long(dict.fromkeys(CASES, (2, 50))))
def test_a_disk_that_is_filled_meanwhile(name, numbers, disk, undisturbed):
    done, work = undisturbed(name), disk.path / "work"
    for number in numbers:
        rng = done.generator(number)
        disk.mount(PLENTY)
        try:
            done.copy_to(work)
            disk.resize(size_of(disk, done, rng) // PAGE * PAGE)
            command = start(done, disk)
            fill(disk, command, done, rng)
            assert_done_or_refused(done, command.wait(), work)
            disk.free()
            done.assert_done(work, start(done, disk).wait())
        finally:
            disk.unmount()
