"""What keeping the traces of all members costs, against computing their summaries alone."""

import tempfile
import time
from pathlib import Path

from benchmarks.measure import by_turns, line
from benchmarks.swept import plan_of
from rbstab.sweep.begin import begun, good_shard_size
from rbstab.sweep.engine import Shard, factory_for
from rbstab.sweep.folder import SweepFolder
from rbstab.sweep.plan import Plan
from rbstab.sweep.room import trace_size

MEMBERS = 10**6

SHARDS = 2
"""As many of these are computed and written."""


def main() -> None:
    """Measures members of 201 samples on one core, in shards as those of a million members."""
    summary, traces = plan_of(MEMBERS), plan_of(MEMBERS, keep="traces")
    size = good_shard_size(MEMBERS, one_by_one=False, trace_bytes=trace_size(traces))
    with (
        tempfile.TemporaryDirectory() as place,
        begun(Path(place) / "summary", summary, size) as of_summary,
        begun(Path(place) / "traces", traces, size) as of_traces,
    ):
        alone = _Sweep(summary, of_summary.folder)
        kept = _Sweep(traces, of_traces.folder)
        both = by_turns(5, alone.compute, alone.write, kept.compute, kept.write)
        written = of_traces.folder.traces_file(kept.first).stat().st_size
    computing, writing, computing_kept, writing_kept = both
    total = computing_kept + writing_kept
    line("traces: members with all motions kept", 1 / total, "runs/s", "")
    line("  written", written / size / writing_kept / 1e6, "MB/s", "")
    line("  share of writing in the total", writing_kept / total, "", "at most 0.33")
    line("  ratio to the summaries alone", total / (computing + writing), "", "at most 2")


class _Sweep:
    """Computes and writes shards from the middle of a plan as a thread of a sweep does."""

    def __init__(self, plan: Plan, folder: SweepFolder) -> None:
        self.engine = factory_for("heyoka")(plan)
        self.folder = folder
        self.size = folder.manifest.shard_size
        self.first = folder.shards // 3
        self.computed = [self._shard(number) for number in self._numbers()]

    def _numbers(self) -> range:
        return range(self.first, self.first + SHARDS)

    def _shard(self, number: int) -> Shard:
        return self.engine.compute(*self.folder.bounds(number))

    def compute(self) -> float:
        """Seconds a member."""
        begin = time.perf_counter()
        self.computed = [self._shard(number) for number in self._numbers()]
        return (time.perf_counter() - begin) / (SHARDS * self.size)

    def write(self) -> float:
        """Seconds a member, until it is on the disk."""
        begin = time.perf_counter()
        for number, shard in zip(self._numbers(), self.computed, strict=True):
            self.folder.write(number, shard.outcome, shard.traces)
        return (time.perf_counter() - begin) / (SHARDS * self.size)
