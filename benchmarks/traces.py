"""Cost of storing the traces of all members, and the share of writing them."""

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from benchmarks.measure import by_turns, line
from benchmarks.swept import Sweeping, plan_of
from rbstab.store.motions import Motions
from rbstab.store.motions_file import FileChecksum
from rbstab.sweep.folder import sweep_folder as folder

MEMBERS = 16_384


def main() -> None:
    """Measure members of 201 samples, stored on disk."""
    kept, alone = Sweeping(plan_of(MEMBERS, keep="traces"), 1), Sweeping(plan_of(MEMBERS), 1)
    both = Sweeping(plan_of(MEMBERS, keep="traces"), 2)

    def seconds(sweeping: Sweeping) -> float:
        return sweeping.seconds(gathered=False)[0] / MEMBERS

    def unwritten() -> float:
        with _without_writing():
            return seconds(kept)

    by_kept, by_unwritten, by_alone, by_both, by_loop = by_turns(
        5,
        lambda: seconds(kept),
        unwritten,
        lambda: seconds(alone),
        lambda: seconds(both),
        alone.bare_loop(),
    )
    line("traces: all motions kept, one thread", 1 / by_kept, "1/s", "")
    line("  share of writing them", 1 - by_unwritten / by_kept, "", "at most 0.15")
    line("  ratio to the bare loop", by_loop / by_kept, "", "at least 0.6")
    line("  ratio to summaries alone", by_kept / by_alone, "", "")
    line("  two threads: ratio to one", by_kept / by_both, "", "at least 1.8")


@contextmanager
def _without_writing() -> Iterator[None]:
    """Make this process compute motions without writing them."""

    def nothing(_path: object, _motions: Motions) -> FileChecksum:
        return FileChecksum("", 0)

    with patch.object(folder, "write_motions", nothing):
        yield
