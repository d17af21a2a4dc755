"""The queue of missing shards, and the interface of executors."""

from collections import deque
from collections.abc import Generator
from dataclasses import dataclass
from threading import Event
from typing import Protocol

from rbstab.sweep.execution.compute_shard import store_shard
from rbstab.sweep.execution.events import ExecutionEvent, ShardDone
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.engine import Shard
from rbstab.sweep.plan.plan import Plan


@dataclass(frozen=True)
class WorkQueue:
    """The shards that an executor has to compute, and the folder that stores them.

    Args:
        plan: The plan.
        folder: The folder that stores the shards.
        missing: The numbers of the shards to compute, ascending.
        stop: Any thread may set it; then no further shard is started.
        fail_fast: Stop at the first member that failed.
    """

    plan: Plan
    folder: SweepFolder
    missing: deque[int]
    stop: Event
    fail_fast: bool = False

    @property
    def exhausted(self) -> bool:
        """Whether no further shard will be started."""
        return self.stop.is_set() or not self.missing

    def next(self) -> int | None:
        """Remove and return the number of the next shard; None if no more are to be started."""
        if self.stop.is_set():
            return None
        try:
            return self.missing.popleft()
        except IndexError:
            return None

    def put_back(self, number: int) -> None:
        """Put back a shard that could not be computed; it becomes the next shard."""
        self.missing.appendleft(number)

    def stop_if_failed(self, done: ShardDone) -> None:
        """Stop the sweep if `fail_fast` is set and a member of the shard failed."""
        if self.fail_fast and done.facts.first_failed is not None:
            self.stop.set()

    def store(self, number: int, shard: Shard) -> ShardDone:
        """Write a shard that was computed elsewhere.

        Raises:
            StoreError: The shard cannot be written.
        """
        done = store_shard(self.folder, number, shard)
        self.stop_if_failed(done)
        return done


class Executor(Protocol):
    """Interface of executors, which compute shards: threads of this machine, or a cluster."""

    def events(self, queue: WorkQueue) -> Generator[ExecutionEvent | None]:
        """Compute and store the shards of the queue; yield the events, and None when idle.

        The generator ends when all shards are stored or, after a stop, when all started shards are
        stored.
        """
        ...


class ExecutorError(Exception):
    """The executor cannot continue; stored shards are kept."""
