"""Following the members of a sweep: shard by shard, as far as it is not done.

What a shard holds depends on the plan and on nothing else, so neither who computes it nor an
interruption shows in the results.
"""

from collections import deque
from collections.abc import Generator, Iterable
from contextlib import closing
from dataclasses import dataclass, field
from threading import Event
from typing import Protocol

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.sweep.execution.compute_shard import written
from rbstab.sweep.execution.events import EventCallback, ExecutionEvent, ShardDone
from rbstab.sweep.folder.sweep_folder import ShardFacts, SweepFolder
from rbstab.sweep.members.engine import Shard
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.plan.plan import Plan


@dataclass
class ShardInventory:
    """What is there of a sweep: the facts of each whole shard, and the numbers of all others."""

    done: dict[int, ShardFacts] = field(default_factory=dict)
    missing: list[int] = field(default_factory=list)

    @property
    def counts(self) -> Array:
        """How many members ended how, by the code of the status."""
        found = np.zeros(len(STATUSES), dtype=np.int64)
        return found + sum(facts.counts for facts in self.done.values())

    @property
    def members(self) -> int:
        """How many members are done."""
        return int(self.counts.sum())

    @property
    def first_failed(self) -> int | None:
        """The first member known to have failed."""
        found = [f.first_failed for f in self.done.values() if f.first_failed is not None]
        return min(found, default=None)

    def counting_failed_as_missing(self) -> "ShardInventory":
        """The same where shards with members that failed count as missing."""
        failed = [k for k, facts in self.done.items() if facts.first_failed is not None]
        done = {k: facts for k, facts in self.done.items() if k not in failed}
        return ShardInventory(done, sorted([*self.missing, *failed]))

    def add_from(self, other: "ShardInventory") -> None:
        """Takes what another inventory has and this one misses."""
        self.done = other.done | self.done
        self.missing = [k for k in self.missing if k not in self.done]


def shard_inventory(folder: SweepFolder, numbers: Iterable[int] | None = None) -> ShardInventory:
    """What is there of a sweep; every shard is read and verified.

    Args:
        folder: Its folder.
        numbers: Those of the shards that are wanted; default all.

    Raises:
        StoreError: A shard cannot be read.
    """
    inventory = ShardInventory()
    for number in range(folder.shards) if numbers is None else numbers:
        facts = folder.facts(number)
        if facts is None:
            inventory.missing.append(number)
        else:
            inventory.done[number] = facts
    return inventory


@dataclass(frozen=True)
class WorkQueue:
    """What an executor has to do, and where to leave it.

    Args:
        plan: The plan.
        folder: Where its shards are stored.
        wanted: The numbers of those that are missing, ascending.
        stop: Set (by anybody) when no further shard is to be begun.
        fail_fast: Stop at the first member that failed.
    """

    plan: Plan
    folder: SweepFolder
    wanted: deque[int]
    stop: Event
    fail_fast: bool = False

    @property
    def over(self) -> bool:
        """Whether no further shard is to be begun."""
        return self.stop.is_set() or not self.wanted

    def next(self) -> int | None:
        """The number of a shard that nobody else takes; None where no more is to be begun."""
        if self.stop.is_set():
            return None
        try:
            return self.wanted.popleft()
        except IndexError:
            return None

    def stop_if_failed(self, done: ShardDone) -> None:
        """Stops, if that is wanted, at the first shard with a member that failed."""
        if self.fail_fast and done.facts.first_failed is not None:
            self.stop.set()

    def keep(self, number: int, shard: Shard) -> ShardDone:
        """Writes a shard, and heeds what is in it.

        Raises:
            StoreError: It cannot be written.
        """
        done = written(self.folder, number, shard)
        self.stop_if_failed(done)
        return done


class Executor(Protocol):
    """Who computes shards: this machine, or a cluster."""

    def events(self, work: WorkQueue) -> Generator[ExecutionEvent | None]:
        """Computes and keeps the wanted shards, and tells what happens; None now and then.

        It ends when all are kept, or none is wanted any more and those that were begun are kept.
        """
        ...


class ExecutorError(Exception):
    """Those who compute cannot go on; what is stored stays."""


@dataclass
class Execution:
    """The execution of a sweep.

    Args:
        plan: The plan.
        folder: Where it is stored; its lock is held.
        executor: Computes the shards.
        on_event: Learns what happens.
        stop: Set (by anybody) when no further shard is to be begun.
        fail_fast: Stop at the first member that failed.
    """

    plan: Plan
    folder: SweepFolder
    executor: Executor
    on_event: EventCallback = lambda _: None
    stop: Event = field(default_factory=Event)
    fail_fast: bool = False

    def run(self, inventory: ShardInventory) -> None:
        """Computes what is missing, and puts it into the inventory.

        Args:
            inventory: Of the folder.

        Raises:
            StoreError: A shard cannot be written.
            EngineMissingError: An engine cannot be used.
            ExecutorError: The executor cannot go on.
        """
        if self.fail_fast and inventory.first_failed is not None:
            return
        wanted = deque(sorted(inventory.missing))
        work = WorkQueue(self.plan, self.folder, wanted, self.stop, self.fail_fast)
        with closing(self.executor.events(work)) as events:
            for happened in events:
                if isinstance(happened, ShardDone):
                    inventory.done[happened.number] = happened.facts
                self.on_event(happened)
        inventory.missing = [k for k in inventory.missing if k not in inventory.done]
