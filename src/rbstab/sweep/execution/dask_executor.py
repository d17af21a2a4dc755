"""Shards by the workers of a Dask cluster; this process alone writes them.

Dask is given no more than its workers need for the moment, and knows nothing of what is done: a
sweep goes on from its own files. Whatever happens to workers, each shard is computed at last, here
if need be.
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

from rbstab.integrate.engines import EngineMissingError
from rbstab.sweep.execution.compute_shard import compute_shard
from rbstab.sweep.execution.dask_worker import (
    Computed,
    Order,
    SweepPlugin,
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
from rbstab.sweep.execution.execute import ExecutorError, WorkQueue
from rbstab.sweep.execution.machine_properties import processor, versions
from rbstab.sweep.members.engine import EngineFactory, MemberEngine
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.dump import plan_data
from rbstab.sweep.plan.plan import plan_id

TIME_LIMIT = 10.0
"""s in which a scheduler must answer."""

TICK = 0.2
"""s between two looks at a silent cluster."""

LOOK = 2.0
"""s between two looks at how many workers there are."""

IN_STOCK = 2
"""Shards for each thread of a worker: one that it computes, and one that waits beside it."""

SPARE = 2
"""Shards on their way."""

SENDINGS = 3
"""How often a shard is given to the cluster, which tries several workers each time."""


class ClusterError(ExecutorError):
    """A cluster cannot be reached, or is gone."""


@contextmanager
def cluster(
    address: str,
    engine: str,
    factory: EngineFactory | None = None,
    time_limit: float | None = None,
) -> Iterator["DaskCluster"]:
    """The connection to a cluster.

    Args:
        address: Of its scheduler, as tcp://host:8786, or the path of its JSON file.
        engine: What members are to be followed with.
        factory: Makes engines on the workers; default what belongs to the engine.
        time_limit: In which the scheduler must answer, s; default `TIME_LIMIT`.

    Raises:
        ClusterError: The scheduler does not answer, or the address is none.
        WorkerDiffersError: A worker has other versions than this process.
    """
    time_limit = time_limit or TIME_LIMIT
    client = _client(address, time_limit)
    try:
        _check_workers(client, engine)
        yield DaskCluster(client, address, factory)
    finally:
        # A scheduler that is gone is told nothing any more.
        with suppress(OSError, TimeoutError):
            client.close(timeout=time_limit)


def _client(address: str, time_limit: float) -> Client:
    where = {"address": address}
    if address.endswith(".json"):
        if not Path(address).is_file():
            raise ClusterError("there is no such file")
        where = {"scheduler_file": address}
    try:
        return Client(**where, timeout=time_limit, set_as_default=False)
    except (OSError, TimeoutError, ValueError, KeyError, ImportError) as error:
        raise ClusterError(f"the scheduler cannot be reached: {error}") from error


def _check_workers(client: Client, engine: str) -> None:
    """Refuses workers of other versions; those that come later are asked with their first shard."""
    ours = versions(engine)
    try:
        found = client.run(versions, engine, on_error="return")
    except Exception as error:
        # Of any kind: it may be what a worker says that has no rbstab.
        raise ClusterError(f"the workers cannot be asked: {error}") from error
    for worker, theirs in found.items():
        if isinstance(theirs, OSError):
            continue  # it is gone
        if isinstance(theirs, BaseException):
            raise ClusterError(
                f"the worker {worker} cannot compute: {type(theirs).__name__}: {theirs}"
            )
        refuse_other_versions(ours, theirs, worker)


class DaskCluster:
    """An executor: the workers of a Dask cluster compute shards, and this process writes them.

    Args:
        client: Connected to the cluster.
        address: Of its scheduler, for messages.
        factory: Makes engines; default what belongs to the engine of the plan.
    """

    def __init__(self, client: Client, address: str, factory: EngineFactory | None = None) -> None:
        self.client = client
        self.address = address
        self.factory = factory

    def events(self, work: WorkQueue) -> Generator[ExecutionEvent | None]:
        """What comes of the shards; None for each idle tick."""
        plan = work.plan
        here = versions(plan.engine)
        order = Order(plan_data(plan), plan_id(plan), plan.engine, here, self.factory)
        name = f"rbstab-{order.plan_id[:8]}-{token_hex(4)}"
        try:
            self.client.register_plugin(SweepPlugin(order), name=name)
        except (OSError, TimeoutError) as error:
            raise self._lost() from error
        flight = _PendingShards(self.client, name, work, self.factory or factory_for(plan.engine))
        try:
            yield from flight.events()
        except (OSError, TimeoutError) as error:
            raise self._lost() from error
        finally:
            flight.cancel()
            with suppress(OSError, TimeoutError, ValueError):
                if self.client.status == "running":
                    self.client.unregister_worker_plugin(name)

    def _lost(self) -> ClusterError:
        return ClusterError(f"the scheduler at {self.address} does not answer any more")


class _SchedulerGoneError(OSError):
    """The connection to the scheduler is lost."""


@dataclass
class _PendingShards:
    """The shards that are with the cluster, and what comes back."""

    client: Client
    name: str
    work: WorkQueue
    factory: EngineFactory
    flying: dict[Any, tuple[int, Future[Computed]]] = field(default_factory=dict)
    sendings: Counter[int] = field(default_factory=Counter)
    back: SimpleQueue[Future[Computed]] = field(default_factory=SimpleQueue)
    room: int = SPARE
    looked: float = float("-inf")
    deserted: bool = False
    engine: MemberEngine | None = None
    processors: set[str] = field(default_factory=lambda: {processor()})

    def events(self) -> Generator[ExecutionEvent | None]:
        """Sends what there is room for, and takes what comes, until nothing is left."""
        while True:
            threads = self._look()
            if threads == 0 and not self.deserted:
                yield NoWorkers()
            self.deserted = threads == 0 if threads is not None else self.deserted
            while len(self.flying) < self.room and (number := self.work.next()) is not None:
                self._send(number)
            if not self.flying:
                return
            try:
                future = self.back.get(timeout=TICK)
            except Empty:
                yield None
                continue
            yield from self._landed(future)

    def cancel(self) -> None:
        """Takes back what is with the cluster."""
        futures = [future for _, future in self.flying.values()]
        self.flying.clear()
        with suppress(OSError, TimeoutError, ValueError):
            if futures and self.client.status == "running":
                self.client.cancel(futures)

    def _look(self) -> int | None:
        """Whether the scheduler is there, and now and then how many threads the workers have."""
        if self.client.status != "running":
            raise _SchedulerGoneError
        now = time.monotonic()
        if now - self.looked < LOOK:
            return None
        threads = sum(self.client.nthreads().values())
        self.room, self.looked = IN_STOCK * threads + SPARE, now
        return threads

    def _send(self, number: int) -> None:
        self.sendings[number] += 1
        key = f"{self.name}-{number}-{self.sendings[number]}"
        bounds = self.work.folder.bounds(number)
        future = self.client.submit(compute, self.name, *bounds, key=key, pure=False)
        self.flying[key] = number, future
        future.add_done_callback(self.back.put)

    def _landed(self, future: Future[Computed]) -> Iterator[ExecutionEvent | None]:
        """What has become of a shard."""
        number, _ = self.flying.pop(future.key)
        start, stop = self.work.folder.bounds(number)
        try:
            found = future.result()
        except ExecutorError:
            raise
        except EngineMissingError as error:
            raise ClusterError(f"a worker cannot compute: {error}") from error
        except (Exception, CancelledError) as error:
            if self.client.status != "running":
                raise _SchedulerGoneError from error
            here = self.sendings[number] >= SENDINGS
            yield Rescheduled(start, stop, error, here)
            if here:
                yield from self._compute_here(number)
            else:
                self._send(number)
            return
        if found.processor not in self.processors:
            self.processors.add(found.processor)
            yield ProcessorDiffers(found.processor)
        if found.trouble is not None:
            yield EngineFailed(start, stop, found.trouble)
        yield self.work.keep(number, found.shard)

    def _compute_here(self, number: int) -> Iterator[ExecutionEvent]:
        """Computes a shard of which the cluster has made nothing."""
        plan = self.work.plan
        self.engine = self.engine or self.factory(plan)
        for event in compute_shard(plan, self.work.folder, number, self.engine):
            if isinstance(event, ShardDone):
                self.work.stop_if_failed(event)
            yield event
