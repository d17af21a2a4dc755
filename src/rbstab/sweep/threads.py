"""Shards by the threads of this process."""

from collections.abc import Callable, Generator
from queue import Empty, SimpleQueue
from threading import Thread
from typing import NamedTuple

from rbstab.sweep.engine import EngineFactory
from rbstab.sweep.execute import Happened, Trouble, Work, computed

TICK = 0.2
"""s between two looks at silent threads: not every system lets a wait be interrupted."""


class _Ended(NamedTuple):
    """A thread has ended, and by what error, if by one."""

    error: BaseException | None


Report = Happened | _Ended
"""What a thread says."""


class Threads:
    """An executor: each shard is computed and written by one thread, which has its own engine.

    Args:
        factory: Makes the engine of each thread.
        count: How many there are.
    """

    def __init__(self, factory: EngineFactory, count: int) -> None:
        self.factory = factory
        self.count = count

    def happenings(self, work: Work) -> Generator[Happened | None]:
        """What the threads report, until all of them have ended; None for each idle tick."""
        reports: SimpleQueue[Report] = SimpleQueue()
        left, errors = min(self.count, len(work.wanted)), []
        for _ in range(left):
            # Daemons: a second interrupt must not wait for them. A file is whole at any instant.
            Thread(target=self._work, args=(work, reports.put), daemon=True).start()
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

    def _work(self, work: Work, report: Callable[[Report], None]) -> None:
        """What one thread does: one shard after the other."""
        error = None
        try:
            engine = None
            while (number := work.next()) is not None:
                start, stop = work.folder.bounds(number)

                def troubled(raised: Exception, start: int = start, stop: int = stop) -> None:
                    report(Trouble(start, stop, raised))

                engine = engine or self.factory(work.plan)
                report(work.keep(number, computed(work.plan, engine, start, stop, troubled)))
        except BaseException as caught:
            # Told to the thread that executes, which raises it.
            work.stop.set()
            error = caught
        finally:
            report(_Ended(error))
