"""Following the members of a sweep: shard by shard, by several threads, as far as it is not done.

A shard is computed and written by one thread, which has an engine of its own. What a shard holds
depends on the plan and on nothing else, so neither the number of threads nor an interruption shows
in the results.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from threading import Event, Thread
from typing import NamedTuple

import numpy as np

from rbstab.integrate.engines import EngineMissingError
from rbstab.mechanics.numbers import Array
from rbstab.sweep.engine import EngineFactory, MemberEngine, Shard
from rbstab.sweep.folder import ShardFacts, SweepFolder
from rbstab.sweep.outcome import COLUMNS, STATUSES
from rbstab.sweep.plan import Plan
from rbstab.sweep.single import SingleRuns
from rbstab.sweep.traces import checked_traces

TICK = 0.2
"""s between two looks at silent threads: not every system lets a wait be interrupted."""


class ShardDone(NamedTuple):
    """A shard was computed and written: its number, how many members it has, and its facts."""

    number: int
    members: int
    facts: ShardFacts


class Trouble(NamedTuple):
    """An engine raised an error on members start to stop, which are followed one by one instead."""

    start: int
    stop: int
    error: Exception


Told = Callable[[ShardDone | Trouble | None], None]
"""Called, in the thread that executes, for everything that happens; None: nothing for a while."""


@dataclass
class Survey:
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

    def without_failed(self) -> "Survey":
        """The same where shards with members that failed count as missing."""
        failed = [k for k, facts in self.done.items() if facts.first_failed is not None]
        done = {k: facts for k, facts in self.done.items() if k not in failed}
        return Survey(done, sorted([*self.missing, *failed]))

    def filled_from(self, other: "Survey") -> None:
        """Takes what another survey has and this one misses."""
        self.done = other.done | self.done
        self.missing = [k for k in self.missing if k not in self.done]


def survey_of(folder: SweepFolder) -> Survey:
    """What is there of a sweep; every shard is read and verified.

    Raises:
        StoreError: A shard cannot be read.
    """
    survey = Survey()
    for number in range(folder.shards):
        facts = folder.facts(number)
        if facts is None:
            survey.missing.append(number)
        else:
            survey.done[number] = facts
    return survey


class _Ended(NamedTuple):
    """A thread has ended, and by what error, if by one."""

    error: BaseException | None


Report = ShardDone | Trouble | _Ended
"""What a thread says."""


@dataclass
class Execution:
    """The execution of a sweep.

    Args:
        plan: The plan.
        folder: Where it is stored; its lock is held.
        factory: Makes the engine of each thread.
        threads: How many there are.
        told: Learns what happens.
        stop: Set (by anybody) when no further shard is to be begun.
        fail_fast: Stop at the first member that failed.
    """

    plan: Plan
    folder: SweepFolder
    factory: EngineFactory
    threads: int
    told: Told = lambda _: None
    stop: Event = field(default_factory=Event)
    fail_fast: bool = False

    def run(self, survey: Survey) -> None:
        """Computes what is missing, and puts it into the survey.

        Args:
            survey: Of the folder.

        Raises:
            StoreError: A shard cannot be written.
            EngineMissingError: As the factory.
        """
        if self.fail_fast and survey.first_failed is not None:
            return
        wanted = deque(sorted(survey.missing))
        for happened in self._reports(wanted):
            if isinstance(happened, ShardDone):
                survey.done[happened.number] = happened.facts
            self.told(happened)
        survey.missing = [k for k in survey.missing if k not in survey.done]

    def _reports(self, wanted: "deque[int]") -> Iterator[ShardDone | Trouble | None]:
        """What the threads report, until all of them have ended; None for each idle tick."""
        reports: SimpleQueue[Report] = SimpleQueue()
        left, errors = min(self.threads, len(wanted)), []
        for _ in range(left):
            # Daemons: a second interrupt must not wait for them. A file is whole at any instant.
            Thread(target=self._work, args=(wanted, reports.put), daemon=True).start()
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
                self.stop.set()
        if errors:
            raise errors[0]

    def _work(self, wanted: "deque[int]", report: "Callable[[Report], None]") -> None:
        """What one thread does: one shard after the other."""
        error = None
        try:
            engine = None
            while wanted and not self.stop.is_set():
                try:
                    number = wanted.popleft()
                except IndexError:
                    break  # another thread was faster
                engine = engine or self.factory(self.plan)
                report(self._shard(engine, number, report))
        except BaseException as caught:
            # Told to the thread that executes, which raises it.
            self.stop.set()
            error = caught
        finally:
            report(_Ended(error))

    def _shard(
        self, engine: MemberEngine, number: int, report: "Callable[[Report], None]"
    ) -> ShardDone:
        """Computes and writes one shard."""
        start, stop = self.folder.bounds(number)
        try:
            shard = self._checked(engine, start, stop)
        except EngineMissingError:
            raise
        except Exception as error:
            # No member may end the sweep: they are followed alone, each with a status of its own.
            report(Trouble(start, stop, error))
            shard = self._checked(SingleRuns(self.plan), start, stop)
        facts = self.folder.write(number, shard.outcome, shard.traces)
        if self.fail_fast and facts.first_failed is not None:
            self.stop.set()
        return ShardDone(number, stop - start, facts)

    def _checked(self, engine: MemberEngine, start: int, stop: int) -> Shard:
        shard = engine.compute(start, stop)
        traces = checked_traces(shard.traces, self.plan, start, stop)
        return Shard(checked(shard, stop - start), traces)


def checked(shard: Shard, members: int) -> dict[str, Array]:
    """The columns of a shard in their types.

    Raises:
        ValueError: A column is missing, or has not an entry for each member.
    """
    found = {}
    for column in COLUMNS:
        data = np.asarray(shard.outcome.get(column.name))
        if data.shape != (members, *column.shape):
            raise ValueError(f"{column.name} has the shape {data.shape} for {members} members")
        found[column.name] = data.astype(column.dtype, copy=False)
    return found
