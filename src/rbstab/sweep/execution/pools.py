"""Where the members of a sweep are computed: any executor of `concurrent.futures`."""

from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack

from rbstab.processes.imports import keep_imports
from rbstab.processes.workers import worker_pool
from rbstab.sweep.execution.computing import (
    ChangedOnTheWayError,
    Computed,
    Computing,
    ExecutorError,
    Task,
)
from rbstab.sweep.members.engine import EngineFactory
from rbstab.sweep.plan.plan import Plan

MAX_STARTS = 3
"""How many times worker processes are started in a row that cannot make their engines."""


class Pool:
    """Workers of a sweep: an executor, and a new one when that is broken.

    Args:
        start: Starts an executor.
        threads: How many members it computes at once.
    """

    lost: tuple[type[Exception], ...] = (
        *(BrokenExecutor, CancelledError, MemoryError),
        ChangedOnTheWayError,
    )
    """The errors of a task whose members another worker may compute."""

    is_here = False
    """Whether it computes in this process."""

    may_grow = False
    """Whether workers may join at any time, so that none are waited for."""

    def __init__(self, start: Callable[[], Executor], threads: int) -> None:
        self._start = start
        self._threads = threads
        self.executor: Executor | None = None

    def begin(self, plan: Plan, factory: EngineFactory | None) -> None:
        """Prepare for a sweep."""
        self._task: Callable[[int, int], Computed] = Task.of(plan, factory, elsewhere=True)

    def threads(self) -> int:
        """Return how many threads are ready to compute.

        Raises:
            ExecutorError: There will be none.
        """
        return self._threads

    def submit(self, start: int, stop: int) -> "Future[Computed]":
        """Let a worker compute the members from number `start` up to `stop`."""
        self.executor = self.executor or self._start()
        return self.executor.submit(self._task, start, stop)

    def close(self) -> None:
        """End the executor without waiting; a later use starts a new one."""
        if self.executor is not None:
            self.executor.shutdown(wait=False)
            self.executor = None


class Threads(Pool):
    """Threads of this process."""

    is_here = True

    def __init__(self, count: int = 1) -> None:
        super().__init__(lambda: ThreadPoolExecutor(count), count)

    def begin(self, plan: Plan, factory: EngineFactory | None) -> None:
        """Prepare for a sweep."""
        self._task = Computing(plan, factory)


class Processes(Pool):
    """Worker processes of this machine. They count as soon as their engines are made.

    Args:
        count: How many.
    """

    def __init__(self, count: int) -> None:
        super().__init__(self._start_workers, count)
        self._stack = ExitStack()
        self._ready: list[Future[None]] = []
        self._starts = 0

    def begin(self, plan: Plan, factory: EngineFactory | None) -> None:
        """Prepare for a sweep."""
        self._task = self._engine = Task.of(plan, factory, elsewhere=False)

    def _start_workers(self) -> Executor:
        executor = self._stack.enter_context(worker_pool(self._threads))
        self._ready = [executor.submit(_make_engine, self._engine) for _ in range(self._threads)]
        return executor

    def threads(self) -> int:
        """Return how many workers have made their engines.

        Raises:
            ExecutorError: No worker can be started, again and again.
        """
        try:
            if self.executor is None:
                self._starts += 1
                self.executor = self._start()
            ready = [future for future in self._ready if future.done()]
            for future in ready:
                future.result()
        except Exception as error:
            self.close()
            if self._starts >= MAX_STARTS:
                raise ExecutorError(f"no worker process can compute: {error}") from error
            return 0
        if ready:
            self._starts = 0
        return len(ready)

    def close(self) -> None:
        """Kill the workers; a later use starts new ones."""
        self.executor = None
        self._stack.close()


def _make_engine(task: Task) -> None:
    with keep_imports():
        task.make_engine()
