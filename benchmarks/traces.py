"""Cost of storing the traces of all members, and the share of writing them."""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

from benchmarks.measure import by_turns, line
from benchmarks.swept import Sweeping, plan_of
from rbstab.store.dataset import Dataset, Motions
from rbstab.store.dataset_file import Checksum, write_dataset
from rbstab.store.disk.atomic import write_all
from rbstab.sweep.folder import sweep_folder
from rbstab.sweep.members.traces import layout_of

MEMBERS = 16_384
MEMBERS_OF_FILE = 1024


def main() -> None:
    """Measure members of 201 samples, stored on disk."""
    kept, alone = Sweeping(plan_of(MEMBERS, keep="traces"), 1), Sweeping(plan_of(MEMBERS), 1)
    both = Sweeping(plan_of(MEMBERS, keep="traces"), 2)

    def seconds(sweeping: Sweeping) -> float:
        return sweeping.seconds(gathered=False)[0] / MEMBERS

    def unwritten() -> float:
        with _without_writing():
            return seconds(kept)

    by_kept, by_unwritten, by_disk, by_alone, by_both, by_loop = by_turns(
        5,
        lambda: seconds(kept),
        unwritten,
        lambda: _seconds_of_disk(layout_of(kept.plan).size),
        lambda: seconds(alone),
        lambda: seconds(both),
        alone.bare_loop(),
    )
    line("traces: all motions kept, one thread", 1 / by_kept, "1/s", "")
    line("  share of writing them", 1 - by_unwritten / by_kept, "", "at most 0.15")
    line("  share of the disk alone, without any program", by_disk / by_kept, "", "")
    line("  ratio to the bare loop", by_loop / by_kept, "", "at least 0.6")
    line("  ratio to summaries alone", by_kept / by_alone, "", "")
    line("  two threads: ratio to one", by_kept / by_both, "", "at least 1.8")


def _seconds_of_disk(size: int) -> float:
    """Return the seconds that the disk takes for each member: bytes are written and synced.

    Args:
        size: The bytes of the motions of a member.
    """
    content = os.urandom(MEMBERS_OF_FILE * size)
    with tempfile.TemporaryDirectory(dir="results") as folder:
        begin = time.perf_counter()
        for number in range(MEMBERS // MEMBERS_OF_FILE):
            with (Path(folder) / str(number)).open("xb", buffering=0) as file:
                write_all(file, content)
                os.fsync(file.fileno())
        return (time.perf_counter() - begin) / MEMBERS


@contextmanager
def _without_writing() -> Iterator[None]:
    """Make this process compute motions without writing them."""

    def nothing(path: Path, dataset: Dataset, *, replace: bool = False) -> Checksum:
        if isinstance(dataset, Motions):
            return Checksum("", 0)
        return write_dataset(path, dataset, replace=replace)

    with patch.object(sweep_folder, "write_dataset", nothing):
        yield


if __name__ == "__main__":
    main()
