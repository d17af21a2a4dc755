"""Shards by this machine: by threads of this process, or by processes beside it."""

from collections.abc import Callable, Generator, Iterable
from contextlib import closing, suppress
from queue import Empty, SimpleQueue
from threading import Thread
from typing import NamedTuple

from rbstab.sweep.execution.compute_shard import compute_shard
from rbstab.sweep.execution.events import EngineFailed, ExecutionEvent, Rescheduled, ShardDone
from rbstab.sweep.execution.execute import WorkQueue
from rbstab.sweep.execution.shard_process import ShardProcess, WorkerDiedError
from rbstab.sweep.members.engine import EngineError, EngineFactory
from rbstab.sweep.plan.plan import Plan

TICK = 0.2
"""s between two looks at silent threads: not every system lets a wait be interrupted."""


class _Ended(NamedTuple):
    """A thread has ended, and by what error, if by one."""

    error: BaseException | None


Report = ExecutionEvent | _Ended
"""What a thread says."""

Say = Callable[[ExecutionEvent], None]
"""Says it."""


class ThreadExecutor:
    """An executor: each shard is computed and written by one thread, which has its own engine.

    Args:
        factory: Makes the engine of a thread.
        count: How many there are.
        elsewhere: Begins a process, in which the shards of a thread are computed and written; those
            of the first are here. By default all are.
    """

    def __init__(
        self,
        factory: EngineFactory,
        count: int,
        elsewhere: Callable[[Plan], ShardProcess] | None = None,
    ) -> None:
        self.factory = factory
        self.count = count
        self.elsewhere = elsewhere

    def events(self, work: WorkQueue) -> Generator[ExecutionEvent | None]:
        """What the threads report, until all of them have ended; None for each idle tick."""
        reports: SimpleQueue[Report] = SimpleQueue()
        left, errors = min(self.count, len(work.wanted)), []
        for place in range(left):
            does = self._work if place == 0 or self.elsewhere is None else self._work_elsewhere
            # Daemons: a second interrupt must not wait for them. A file is whole at any instant.
            Thread(target=_reporting, args=(does, work, reports.put), daemon=True).start()
        try:
            while left:
                try:
                    report = reports.get(timeout=TICK)
                except Empty:
                    yield None
                    continue
                if isinstance(report, _Ended):
                    left -= 1
                    errors += [report.error] if report.error is not None else []
                else:
                    yield report
        finally:
            # Whoever listens may have ended early, by an error of its own.
            if left:
                work.stop.set()
        if errors:
            raise errors[0]

    def _work(self, work: WorkQueue, report: Say) -> None:
        """One shard after the other, by an engine of this process."""
        engine = None
        while (number := work.next()) is not None:
            engine = engine or self.factory(work.plan)
            _tell(compute_shard(work.plan, work.folder, number, engine), work, report)

    def _work_elsewhere(self, work: WorkQueue, report: Say) -> None:
        """The same by another process, and here once that is lost."""
        assert self.elsewhere is not None
        # A system that has no room for another process, or lets none begin, still has this one.
        with suppress(WorkerDiedError, EngineError), closing(self.elsewhere(work.plan)) as process:
            # No shard waits for a process to begin: others are faster with it.
            while not process.ready(TICK):
                if work.over:
                    return
            while (number := work.next()) is not None:
                try:
                    _tell(process.make(work.folder, number), work, report)
                except (WorkerDiedError, EngineError) as lost:
                    report(Rescheduled(*work.folder.bounds(number), lost, here=True))
                    work.wanted.appendleft(number)
                    break
        self._work(work, report)


def _tell(events: Iterable[EngineFailed | ShardDone], work: WorkQueue, report: Say) -> None:
    for event in events:
        if isinstance(event, ShardDone):
            work.stop_if_failed(event)
        report(event)


def _reporting(
    does: Callable[[WorkQueue, Say], None], work: WorkQueue, report: Callable[..., None]
) -> None:
    """What one thread does, to its end."""
    error = None
    try:
        does(work, report)
    except BaseException as caught:
        # Told to the thread that executes, which raises it.
        work.stop.set()
        error = caught
    finally:
        report(_Ended(error))
