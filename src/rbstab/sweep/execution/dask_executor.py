"""Executor on a Dask cluster: its workers compute the shards, and this process writes them.

The cluster gets only as many shards as its workers need at the moment, and keeps no record of
finished shards: a sweep resumes from its own files. If the workers fail to
compute a shard, this process computes it.
"""

import time
from asyncio import CancelledError
from collections import Counter
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, SimpleQueue
from secrets import token_hex
from typing import Any

from distributed import Client, Future

from rbstab.files.existence import is_file
from rbstab.integrate.engines import EngineMissingError
from rbstab.sweep.execution.compute_shard import compute_shard
from rbstab.sweep.execution.dask_worker import (
    Computed,
    SweepPlugin,
    SweepTask,
    compute,
    refuse_other_versions,
)
from rbstab.sweep.execution.events import (
    EngineFailed,
    ExecutionEvent,
    NoWorkers,
    ProcessorDiffers,
    Rescheduled,
    ShardDone,
)
from rbstab.sweep.execution.machine_properties import processor, versions
from rbstab.sweep.execution.work_queue import ExecutorError, WorkQueue
from rbstab.sweep.members.engine import EngineFactory, MemberEngine
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.dump import plan_data
from rbstab.sweep.plan.plan import plan_id

TIME_LIMIT = 10.0
"""s in which a scheduler must answer."""

POLL_INTERVAL = 0.2
"""s; the longest wait for a finished shard."""

COUNT_INTERVAL = 2.0
"""s between two counts of the workers' threads."""

SHARDS_PER_THREAD = 2
"""Shards for each thread of a worker: one being computed, and one waiting on the worker."""

SPARE_SHARDS = 2
"""Shards in transit."""

MAX_SUBMISSIONS = 3
"""How many times a shard is submitted at most. Each time, the cluster tries several workers."""


class ClusterError(ExecutorError):
    """A cluster cannot be reached, or the connection is lost."""


@contextmanager
def cluster(
    address: str,
    engine: str,
    factory: EngineFactory | None = None,
    time_limit: float | None = None,
) -> Iterator["DaskCluster"]:
    """Connect to a cluster.

    Args:
        address: The scheduler's address, such as tcp://host:8786, or the path of its JSON file.
        engine: The name of the engine that integrates members.
        factory: Makes engines on the workers; default the factory of `engine`.
        time_limit: The scheduler must answer in this time, s; default `TIME_LIMIT`.

    Raises:
        ClusterError: The scheduler does not answer, or the address is wrong.
        WorkerDiffersError: A worker has other versions than this process.
    """
    time_limit = time_limit or TIME_LIMIT
    client = _client(address, time_limit)
    try:
        _check_workers(client, engine)
        yield DaskCluster(client, address, factory)
    finally:
        # The scheduler may be gone; then there is nothing to close.
        with suppress(OSError, TimeoutError):
            client.close(timeout=time_limit)


def _client(address: str, time_limit: float) -> Client:
    target = {"address": address}
    if address.endswith(".json"):
        try:
            if not is_file(Path(address)):
                raise ClusterError("there is no such file")
        except OSError as error:
            raise ClusterError(f"the file cannot be read: {error.strerror or error}") from error
        target = {"scheduler_file": address}
    try:
        return Client(**target, timeout=time_limit, set_as_default=False)
    except (OSError, TimeoutError, ValueError, KeyError, ImportError) as error:
        raise ClusterError(f"the scheduler cannot be reached: {error}") from error


def _check_workers(client: Client, engine: str) -> None:
    """Reject workers with other versions. Later workers are checked at their first shard."""
    ours = versions(engine)
    try:
        found = client.run(versions, engine, on_error="return")
    except Exception as error:
        # The error may have any type: a worker without rbstab raises its own.
        raise ClusterError(f"the versions of the workers cannot be read: {error}") from error
    for worker, theirs in found.items():
        if isinstance(theirs, OSError):
            continue  # this worker is gone
        if isinstance(theirs, BaseException):
            raise ClusterError(
                f"the worker {worker} cannot compute: {type(theirs).__name__}: {theirs}"
            )
        refuse_other_versions(ours, theirs, worker)


class DaskCluster:
    """An executor: the workers of a Dask cluster compute shards, and this process writes them.

    Args:
        client: The connection to the cluster.
        address: The address of the scheduler, for messages.
        factory: Makes engines; default the factory of the plan's engine.
    """

    def __init__(self, client: Client, address: str, factory: EngineFactory | None = None) -> None:
        self.client = client
        self.address = address
        self.factory = factory

    def events(self, queue: WorkQueue) -> Generator[ExecutionEvent | None]:
        """Yield the events of the shards, and None when idle."""
        plan = queue.plan
        here = versions(plan.engine)
        data, name = plan_data(plan), plan_id(plan)
        task = SweepTask(data, name, plan.engine, here, self.factory, plan.may_run_code)
        name = f"rbstab-{task.plan_id[:8]}-{token_hex(4)}"
        try:
            self.client.register_plugin(SweepPlugin(task), name=name)
        except (OSError, TimeoutError) as error:
            raise self._lost() from error
        factory = self.factory or factory_for(plan.engine)
        pending = _PendingShards(self.client, name, queue, factory)
        try:
            yield from pending.events()
        except (OSError, TimeoutError) as error:
            raise self._lost() from error
        finally:
            pending.cancel()
            with suppress(OSError, TimeoutError, ValueError):
                if self.client.status == "running":
                    self.client.unregister_worker_plugin(name)

    def _lost(self) -> ClusterError:
        return ClusterError(f"the scheduler at {self.address} does not answer any more")


class _SchedulerGoneError(OSError):
    """The connection to the scheduler is lost."""


@dataclass
class _PendingShards:
    """The shards that were submitted to the cluster, and the queue of finished futures."""

    client: Client
    name: str
    queue: WorkQueue
    factory: EngineFactory
    # In quotes: older versions of distributed have no generic `Future`.
    submitted: "dict[Any, tuple[int, Future[Computed]]]" = field(default_factory=dict)
    submissions: Counter[int] = field(default_factory=Counter)
    finished: "SimpleQueue[Future[Computed]]" = field(default_factory=SimpleQueue)
    capacity: int = SPARE_SHARDS
    counted_at: float = float("-inf")
    without_workers: bool = False
    engine: MemberEngine | None = None
    processors: set[str] = field(default_factory=lambda: {processor()})

    def events(self) -> Generator[ExecutionEvent | None]:
        """Submit shards up to the capacity and take finished ones, until none is left."""
        while True:
            threads = self._count_threads()
            if threads == 0 and not self.without_workers:
                yield NoWorkers()
            self.without_workers = threads == 0 if threads is not None else self.without_workers
            while len(self.submitted) < self.capacity and (number := self.queue.next()) is not None:
                self._submit(number)
            if not self.submitted:
                return
            try:
                future = self.finished.get(timeout=POLL_INTERVAL)
            except Empty:
                yield None
                continue
            yield from self._take(future)

    def cancel(self) -> None:
        """Cancel the submitted shards."""
        futures = [future for _, future in self.submitted.values()]
        self.submitted.clear()
        with suppress(OSError, TimeoutError, ValueError):
            if futures and self.client.status == "running":
                self.client.cancel(futures)

    def _count_threads(self) -> int | None:
        """Return the number of threads of all workers; None if counted within `COUNT_INTERVAL`."""
        if self.client.status != "running":
            raise _SchedulerGoneError
        now = time.monotonic()
        if now - self.counted_at < COUNT_INTERVAL:
            return None
        threads = sum(self.client.nthreads().values())
        self.capacity, self.counted_at = SHARDS_PER_THREAD * threads + SPARE_SHARDS, now
        return threads

    def _submit(self, number: int) -> None:
        self.submissions[number] += 1
        key = f"{self.name}-{number}-{self.submissions[number]}"
        bounds = self.queue.folder.bounds(number)
        future = self.client.submit(compute, self.name, *bounds, key=key, pure=False)
        self.submitted[key] = number, future
        future.add_done_callback(self.finished.put)

    def _take(self, future: "Future[Computed]") -> Iterator[ExecutionEvent | None]:
        """Write a finished shard, or run it again if its worker died."""
        number, _ = self.submitted.pop(future.key)
        start, stop = self.queue.folder.bounds(number)
        try:
            found = future.result()
        except ExecutorError:
            raise
        except EngineMissingError as error:
            raise ClusterError(f"a worker cannot compute: {error}") from error
        except (Exception, CancelledError) as error:
            if self.client.status != "running":
                raise _SchedulerGoneError from error
            here = self.submissions[number] >= MAX_SUBMISSIONS
            yield Rescheduled(start, stop, error, here)
            if here:
                yield from self._compute_here(number)
            else:
                self._submit(number)
            return
        if found.processor not in self.processors:
            self.processors.add(found.processor)
            yield ProcessorDiffers(found.processor)
        if found.error is not None:
            yield EngineFailed(start, stop, found.error)
        yield self.queue.store(number, found.shard)

    def _compute_here(self, number: int) -> Iterator[ExecutionEvent]:
        """Compute in this process a shard that the cluster could not compute."""
        plan = self.queue.plan
        self.engine = self.engine or self.factory(plan)
        for event in compute_shard(plan, self.queue.folder, number, self.engine):
            if isinstance(event, ShardDone):
                self.queue.stop_if_failed(event)
            yield event
