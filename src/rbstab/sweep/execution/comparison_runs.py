"""Single runs of the members to compare: in worker processes beside a sweep, and in this one."""

from collections import deque
from collections.abc import Callable
from contextlib import closing, suppress
from threading import Event, Lock, Thread
from types import TracebackType
from typing import Self

from rbstab.mechanics.numbers import Array
from rbstab.processes.workers import Worker, WorkerDiedError
from rbstab.sweep.execution.comparison_worker import start_comparison_worker
from rbstab.sweep.members.scipy_comparison import ENGINE
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.plan import Plan

POLL_INTERVAL = 0.02
"""s; how often the end of the runs is looked for while a worker computes."""

MEMBERS_PER_WORKER = 16
"""Another worker process is started for every so many members."""

MEMBERS_WHILE_IMPORTING = 4
"""A worker runs about so many members while this process would import SciPy to help it."""

Outcome = dict[str, Array]


class ComparisonRuns:
    """Single runs of some members by SciPy. It is a context manager, which ends its workers.

    Args:
        plan: The plan.
        members: The numbers of the members.
        workers: The largest number of worker processes; 0 runs all members in this process.
        started: A worker process that was started before, from `start_comparison_worker`.
    """

    def __init__(
        self, plan: Plan, members: list[int], workers: int, started: Worker | None = None
    ) -> None:
        self.plan = plan
        self.members = members
        self.outcomes: dict[int, Outcome] = {}
        self._left = deque(members)
        self._closed = Event()
        self._count = min(workers, -(-len(members) // MEMBERS_PER_WORKER))
        self._threads: list[Thread] = []
        self._lock = Lock()
        self._started = started

    def __enter__(self) -> Self:
        """Start the workers, and return the runs."""
        # If the system starts no further thread, there are fewer workers.
        with suppress(RuntimeError):
            for _ in range(self._count):
                thread = Thread(target=self._run_in_worker, daemon=True)
                thread.start()
                self._threads.append(thread)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """End the workers at once."""
        self._closed.set()
        for thread in self._threads:
            thread.join()

    def finish(self, stop: Event, on_done: Callable[[int], None]) -> dict[int, Outcome] | None:
        """Run the members that are left, and return all outcomes; None if stopped.

        Args:
            stop: Any thread may set it to end early.
            on_done: Called with the number of members that are done, whenever it has grown.
        """
        singles, told = None, -1
        while not stop.is_set():
            if len(self.outcomes) > told:
                told = len(self.outcomes)
                on_done(told)
            if told == len(self.members):
                return self.outcomes
            member = self._next_here()
            if member is None:
                self._wait()
                continue
            singles = singles or SingleRuns(self.plan, ENGINE, with_largest=True)
            self.outcomes[member] = singles.compute(member, member + 1).outcome
        return None

    def _next_here(self) -> int | None:
        """Return a member to run in this process; None if it is better to wait for the workers."""
        working = sum(thread.is_alive() for thread in self._threads)
        if len(self._left) <= MEMBERS_WHILE_IMPORTING * working:
            return None
        with suppress(IndexError):
            return self._left.popleft()
        return None

    def _wait(self) -> None:
        """Wait for a worker that still runs a member."""
        for thread in self._threads:
            thread.join(POLL_INTERVAL)

    def _worker(self) -> Worker:
        """Return the worker that was started before, once, and then new ones."""
        with self._lock:
            worker, self._started = self._started, None
        return worker or start_comparison_worker()

    def _run_in_worker(self) -> None:
        """Run members in a worker process, one by one. If it dies, its member is put back."""
        member = None
        try:
            # If no process can be started, all members run in this one.
            with suppress(WorkerDiedError), closing(self._worker()) as worker:
                worker.send(self.plan)
                # A worker takes no member before it is ready: this process may be sooner.
                while not worker.has_answer(POLL_INTERVAL):
                    if self._closed.is_set() or not self._left:
                        return
                worker.receive()
                while self._left:
                    member = self._left.popleft()
                    worker.send(member)
                    while not worker.has_answer(POLL_INTERVAL):
                        if self._closed.is_set():
                            return
                    self.outcomes[member] = worker.receive()
                    member = None
        except Exception:  # noqa: S110 (whatever happened, its member is run again below)
            pass
        finally:
            if member is not None:
                self._left.append(member)
