"""Executor on this machine: threads, each with its worker process except the first."""

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
"""s; the longest wait for an event, because some systems cannot interrupt a wait."""


class _Ended(NamedTuple):
    """The end of a thread, with the error that ended it, if any."""

    error: BaseException | None


Report = Callable[[ExecutionEvent], None]
"""Passes an event from a thread to the executor."""


class ThreadExecutor:
    """An executor whose threads compute and write shards, each with its own engine.

    Args:
        factory: Makes the engine of a thread.
        count: The number of threads.
        start_worker: Starts the worker process of each thread except the first; by default all
            threads compute in this process.
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
            # Daemon threads: a second interrupt does not wait for them. File writes are atomic.
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
            # The caller may have closed this generator early, as after an error.
            if running:
                queue.stop.set()
        if errors:
            raise errors[0]

    def _run_here(self, queue: WorkQueue, report: Report) -> None:
        """Compute shards one by one with an engine in this process."""
        engine = None
        while (number := queue.next()) is not None:
            engine = engine or self.factory(queue.plan)
            _report(compute_shard(queue.plan, queue.folder, number, engine), queue, report)

    def _run_worker(self, queue: WorkQueue, report: Report) -> None:
        """Compute shards in a worker process; if it dies, compute the others in this process."""
        assert self.start_worker is not None
        # If the worker cannot start or dies, this process computes the shards below.
        with (
            suppress(WorkerDiedError, EngineError),
            closing(self.start_worker(queue.plan)) as worker,
        ):
            # Take no shard before the worker has started: other threads compute it sooner.
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
    """Run a thread to its end, then report the end with its error."""
    error = None
    try:
        run(queue, report)
    except BaseException as caught:
        # `events` raises the error in the executing thread.
        queue.stop.set()
        error = caught
    finally:
        report(_Ended(error))
