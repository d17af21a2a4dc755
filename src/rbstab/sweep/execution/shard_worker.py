"""A worker process that computes and writes shards.

Python code of one process runs on one core at a time; so each thread of a sweep except the first
has a worker process.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread

from rbstab.integrate.engines import EngineMissingError
from rbstab.processes.workers import Worker
from rbstab.store.errors import StoreError
from rbstab.sweep.execution.compute_shard import compute_shard
from rbstab.sweep.execution.events import EngineFailed, ShardDone
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.engine import EngineError, EngineFactory
from rbstab.sweep.plan.plan import Plan

ShardRequest = tuple[SweepFolder, int]
"""A folder, and the number of the shard to compute."""


class ShardWorker:
    """A worker process for one thread.

    Args:
        plan: The plan.
        factory: Makes the engine in the worker.

    Raises:
        WorkerDiedError: The system cannot start another process.
    """

    def __init__(self, plan: Plan, factory: EngineFactory) -> None:
        self._worker = Worker(_serve, plan, factory)
        self._ready = False

    def ready(self, wait: float) -> bool:
        """Return whether the engine of the worker is made; wait for it up to `wait` seconds.

        Raises:
            WorkerDiedError: The worker has ended.
            EngineError: The engine cannot be made.
        """
        if not self._ready and self._worker.has_answer(wait):
            self._worker.receive()
            self._ready = True
        return self._ready

    def compute(self, folder: SweepFolder, number: int) -> list[EngineFailed | ShardDone]:
        """Compute and write a shard, and return the events.

        Raises:
            WorkerDiedError: The worker has ended.
            EngineError: The worker could not compute the shard, and has ended.
            StoreError: The shard cannot be written.
            EngineMissingError: The engine cannot be used.
        """
        request: ShardRequest = folder, number
        self._worker.send(request)
        events: list[EngineFailed | ShardDone] = self._worker.receive()
        return events

    def close(self) -> None:
        """End the worker at once; a shard that it has not finished is not stored."""
        self._worker.close()


def _serve(connection: Connection, plan: Plan, factory: EngineFactory) -> None:
    """Receive requests for shards in the main thread; another thread computes them."""
    requests: SimpleQueue[ShardRequest] = SimpleQueue()
    # In the main thread glibc returns freed memory at once, and computing takes a tenth longer.
    arguments = connection, plan, factory, requests.get
    Thread(target=_compute, args=arguments, daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            requests.put(connection.recv())
    os._exit(0)


def _compute(
    connection: Connection,
    plan: Plan,
    factory: EngineFactory,
    next_request: Callable[[], ShardRequest],
) -> None:
    """Compute the requested shards one by one; an unexpected error ends the process."""
    answer: list[EngineFailed | ShardDone] | Exception = []
    try:
        engine = factory(plan)
        while True:
            # If the parent has died, the main thread ends the process.
            with suppress(OSError):
                connection.send(answer)
            folder, number = next_request()
            try:
                answer = [_sendable(event) for event in compute_shard(plan, folder, number, engine)]
            except (StoreError, EngineMissingError) as error:
                answer = error
    except Exception as error:
        connection.send(EngineError.of(error))
    finally:
        os._exit(1)


def _sendable(event: EngineFailed | ShardDone) -> EngineFailed | ShardDone:
    """Return the event with an error that can be pickled."""
    if isinstance(event, EngineFailed):
        return event._replace(error=EngineError.of(event.error))
    return event
