"""An executor on this machine: threads, of which all but the first have a worker process."""

from collections.abc import Callable, Generator, Iterable
from contextlib import closing, suppress
from queue import Empty, SimpleQueue
from threading import Thread
from typing import NamedTuple

from rbstab.processes.workers import WorkerDiedError
from rbstab.sweep.execution.compute_shard import compute_shard
from rbstab.sweep.execution.events import EngineFailed, ExecutionEvent, Rescheduled, ShardDone
from rbstab.sweep.execution.shard_worker import ShardWorker
from rbstab.sweep.execution.work_queue import WorkQueue
from rbstab.sweep.members.engine import EngineError, EngineFactory
from rbstab.sweep.plan.plan import Plan

POLL_INTERVAL = 0.2
"""s between two looks at silent threads: not every system lets a wait be interrupted."""


class _Ended(NamedTuple):
    """A thread has ended, and with which error, if any."""

    error: BaseException | None


Report = Callable[[ExecutionEvent], None]
"""Passes an event from a thread to the executor."""


class ThreadExecutor:
    """An executor whose threads compute and write shards, each with an engine of its own.

    Args:
        factory: Makes the engine of a thread.
        count: How many threads.
        start_worker: Starts the worker process of each thread but the first; by default all threads
            compute in this process.
    """

    def __init__(
        self,
        factory: EngineFactory,
        count: int,
        start_worker: Callable[[Plan], ShardWorker] | None = None,
    ) -> None:
        self.factory = factory
        self.count = count
        self.start_worker = start_worker

    def events(self, queue: WorkQueue) -> Generator[ExecutionEvent | None]:
        """Yield the events of all threads until the last one has ended, and None when idle."""
        reports: SimpleQueue[ExecutionEvent | _Ended] = SimpleQueue()
        running, errors = min(self.count, len(queue.missing)), []
        for index in range(running):
            run = self._run_here if index == 0 or self.start_worker is None else self._run_worker
            # Daemons: a second interrupt must not wait for them. A file is whole at any instant.
            Thread(target=_run_thread, args=(run, queue, reports.put), daemon=True).start()
        try:
            while running:
                try:
                    report = reports.get(timeout=POLL_INTERVAL)
                except Empty:
                    yield None
                    continue
                if isinstance(report, _Ended):
                    running -= 1
                    errors += [report.error] if report.error is not None else []
                else:
                    yield report
        finally:
            # The receiver of the events may have ended early, with an error of its own.
            if running:
                queue.stop.set()
        if errors:
            raise errors[0]

    def _run_here(self, queue: WorkQueue, report: Report) -> None:
        """Compute one shard after the other with an engine of this process."""
        engine = None
        while (number := queue.next()) is not None:
            engine = engine or self.factory(queue.plan)
            _report(compute_shard(queue.plan, queue.folder, number, engine), queue, report)

    def _run_worker(self, queue: WorkQueue, report: Report) -> None:
        """Let a worker process compute the shards; once it has died, compute them here."""
        assert self.start_worker is not None
        # A system that cannot start another process still has this one.
        with (
            suppress(WorkerDiedError, EngineError),
            closing(self.start_worker(queue.plan)) as worker,
        ):
            # No shard waits for a worker to start: other threads take it sooner.
            while not worker.ready(POLL_INTERVAL):
                if queue.exhausted:
                    return
            while (number := queue.next()) is not None:
                try:
                    _report(worker.compute(queue.folder, number), queue, report)
                except (WorkerDiedError, EngineError) as error:
                    report(Rescheduled(*queue.folder.bounds(number), error, here=True))
                    queue.put_back(number)
                    break
        self._run_here(queue, report)


def _report(events: Iterable[EngineFailed | ShardDone], queue: WorkQueue, report: Report) -> None:
    for event in events:
        if isinstance(event, ShardDone):
            queue.stop_if_failed(event)
        report(event)


def _run_thread(
    run: Callable[[WorkQueue, Report], None], queue: WorkQueue, report: Callable[..., None]
) -> None:
    """Run one thread to its end, and report that end."""
    error = None
    try:
        run(queue, report)
    except BaseException as caught:
        # The executing thread raises it.
        queue.stop.set()
        error = caught
    finally:
        report(_Ended(error))
