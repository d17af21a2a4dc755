"""Compute the missing shards of a sweep in some pools, and write them.

Only this process writes, and only columns that have the digest that their worker made. With equal
versions and processors, the content of a shard depends on the plan alone: neither workers, nor
parts, nor interruptions change it.

If a worker is lost, its members are computed again: alone in the pool, so that no others are lost
with them. If that fails, too, the members are halved until the one is found that ends its workers.
"""

from collections import deque
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from threading import Event
from typing import NamedTuple

from rbstab.integrate.engines import EngineMissingError
from rbstab.sweep.execution.computing import (
    ChangedOnTheWayError,
    Computed,
    ExecutorError,
    crashed_member,
    digest_of,
    joined,
    processor,
)
from rbstab.sweep.execution.events import EventCallback, ShardDone, Warned
from rbstab.sweep.execution.pools import Pool
from rbstab.sweep.folder.shard_inventory import ShardFacts, ShardInventory
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.engine import EngineFactory, Shard
from rbstab.sweep.plan.plan import Plan

POLL_INTERVAL = 0.2
"""s; the longest wait for members, because some systems cannot interrupt a wait."""

AHEAD = 2
"""Tasks for each thread of a worker: one being computed, and one waiting."""

MAX_LOST = 3
"""How many times the members of a task are lost before they are halved."""


class _Members(NamedTuple):
    """Consecutive members of one shard, and how many times they were lost."""

    shard: int
    start: int
    stop: int
    lost: int = 0

    def __str__(self) -> str:
        return f"members {self.start} to {self.stop - 1}"


@dataclass
class ShardRun:
    """Computes and writes missing shards.

    Args:
        plan: The plan.
        folder: The folder of the sweep; the caller holds its lock.
        pools: Where members are computed. Members that were lost go to the last one only.
        on_event: Called with each event, and with None when idle.
        stop: Any thread may set it; then no further members are begun.
        fail_fast: Whether to stop at the first member that failed.
        factory: Makes the engines; default those of the plan.
    """

    plan: Plan
    folder: SweepFolder
    pools: Sequence[Pool]
    on_event: EventCallback = lambda _: None
    stop: Event = field(default_factory=Event)
    fail_fast: bool = False
    factory: EngineFactory | None = None

    def __post_init__(self) -> None:
        """Begin with nothing computed."""
        self._waiting: deque[_Members] = deque()
        self._lost: deque[_Members] = deque()
        self._running: dict[Future[Computed], tuple[Pool, Executor | None, _Members]] = {}
        self._done: SimpleQueue[Future[Computed]] = SimpleQueue()
        self._parts: dict[int, list[Shard]] = {}
        self._processors = {processor()}
        self._has_failed = self._is_idle = False

    def compute(self, inventory: ShardInventory) -> None:
        """Compute the missing shards of an inventory, and add them to it.

        Raises:
            StoreError: A shard cannot be written.
            EngineMissingError: The engine cannot be used.
            ExecutorError: No worker can compute.
        """
        if not inventory.missing or (self.fail_fast and inventory.first_failed is not None):
            return
        self._waiting.extend(_Members(k, *self.folder.bounds(k)) for k in inventory.missing)
        pools = list(self.pools)
        try:
            for pool in pools:
                pool.begin(self.plan, self.factory)
            while self._submit(pools):
                try:
                    future = self._done.get(timeout=POLL_INTERVAL)
                except Empty:
                    self.on_event(None)
                    continue
                pool, executor, members = self._running.pop(future)
                shard: Shard | None
                try:
                    shard = self._result(future, pool, members)
                except pool.lost as error:
                    # The other tasks of a broken executor come here, too; it is ended once.
                    if isinstance(error, BrokenExecutor) and pool.executor is executor:
                        pool.close()
                    shard = self._lose(members, error)
                if shard is not None:
                    # The worker has something to do while this process writes.
                    if not self.fail_fast:
                        self._submit(pools)
                    self._store(members, shard, inventory)
        finally:
            for pool in self.pools:
                pool.close()
        inventory.missing = [k for k in inventory.missing if k not in inventory.done]

    def _submit(self, pools: list[Pool]) -> bool:
        """Give members to idle threads; return whether any members are still to come."""
        is_idle = False
        for pool in list(pools):
            try:
                threads = pool.threads()
            except ExecutorError:
                if len(pools) == 1:
                    raise
                pools.remove(pool)
                continue
            is_idle = is_idle or (pool.may_grow and not threads)
            while (members := self._next(pool, threads, is_last=pool is pools[-1])) is not None:
                try:
                    future = pool.submit(members.start, members.stop)
                except BrokenExecutor:
                    # A worker has just died; the tasks that were lost with it are on their way.
                    pool.close()
                    (self._lost if members.lost else self._waiting).appendleft(members)
                    break
                self._running[future] = pool, pool.executor, members
                future.add_done_callback(self._done.put)
        is_left = bool(self._waiting or self._lost) and not self.stop.is_set()
        if is_idle and is_left and not self._is_idle:
            self._warn("the cluster has no workers; waiting for workers")
        self._is_idle = is_idle
        return is_left or bool(self._running)

    def _next(self, pool: Pool, threads: int, *, is_last: bool) -> _Members | None:
        """Return the next members for a pool; None if it has enough."""
        running = [members for other, _, members in self._running.values() if other is pool]
        if self.stop.is_set() or not threads or any(members.lost for members in running):
            return None
        if is_last and self._lost:
            return None if running else self._lost.popleft()
        ahead = 1 if pool.is_here or len(self._waiting) < AHEAD * threads else AHEAD
        return self._waiting.popleft() if self._waiting and len(running) < ahead * threads else None

    def _result(self, future: "Future[Computed]", pool: Pool, members: _Members) -> Shard:
        """Return the results of some members, and warn of what was unusual."""
        try:
            shard, error, name, digest = future.result()
            if digest_of(shard.outcome) != digest:
                raise ChangedOnTheWayError("their results changed on the way from the worker")
        except Exception as raised:
            expected: tuple[type[Exception], ...] = (ExecutorError, EngineMissingError, *pool.lost)
            if pool.is_here or isinstance(raised, expected):
                raise
            raise ExecutorError(
                f"a worker cannot compute: {type(raised).__name__}: {raised}"
            ) from raised
        if name not in self._processors:
            self._processors.add(name)
            self._warn(f"some shards were computed on another kind of processor: {name}")
        if error and not self._has_failed:
            self._has_failed = True
            self._warn(
                f"the engine failed at {members} ({error}); "
                "the members of such batches are integrated one by one"
            )
        return shard

    def _lose(self, members: _Members, error: BaseException) -> Shard | None:
        """Compute lost members again; if one member was lost too often, return it as crashed."""
        lost, (shard, start, stop, _) = members.lost + 1, members
        reason = str(error) or type(error).__name__
        if lost >= MAX_LOST and stop - start == 1:
            self._warn(f"member {start} was given up ({reason})")
            return crashed_member(self.plan, start)
        self._warn(f"{members} were not computed ({reason}); computing them again")
        if lost < MAX_LOST:
            self._lost.append(members._replace(lost=lost))
        else:
            half = (start + stop) // 2
            for bounds in ((half, stop), (start, half)):
                self._lost.appendleft(_Members(shard, *bounds, MAX_LOST - 1))
        return None

    def _store(self, members: _Members, shard: Shard, inventory: ShardInventory) -> None:
        """Write a shard as soon as all its members are computed."""
        number = members.shard
        start, stop = self.folder.bounds(number)
        # Of halves, the first is computed first.
        parts = self._parts.setdefault(number, [])
        parts.append(shard)
        if sum(len(part.outcome["status"]) for part in parts) < stop - start:
            return
        del self._parts[number]
        whole = shard if len(parts) == 1 else joined(parts)
        facts = ShardFacts.of(self.folder.write(self.plan, number, whole))
        inventory.done[number] = facts
        if self.fail_fast and facts.first_failed is not None:
            self.stop.set()
        self.on_event(ShardDone(number))

    def _warn(self, text: str) -> None:
        self.on_event(Warned(text))
