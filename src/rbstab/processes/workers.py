"""Worker processes: a pool of them, started by loky.

A terminal sends an interrupt to all processes, and a job system may send SIGTERM to all. Workers
ignore both; only the parent reacts. A worker exits at once when its parent dies for any reason.
"""

import os
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any, TypeVar

POLL_INTERVAL = 0.1
"""s; the longest wait for a task of a pool."""

WORKERS = {"MALLOC_TOP_PAD_": str(1 << 26), "LOKY_MAX_MEMORY_LEAK_SIZE": "1e15"}
"""The environment of the workers of a pool. glibc gives freed memory back at once in the main
thread, and computing takes a tenth longer; loky ends a worker that has grown."""

A = TypeVar("A")
S = TypeVar("S")
T = TypeVar("T")

_INTERRUPTS = {signal.SIGINT, signal.SIGTERM}


@contextmanager
def worker_pool(
    count: int, setup: Callable[..., None] | None = None, *arguments: Any
) -> Iterator[Executor]:
    """Start a pool of worker processes, and kill them at the end of the block.

    Args:
        count: The number of workers.
        setup: Called with `arguments` once in each worker, before its first task.
        arguments: See `setup`.

    Yields:
        The pool. If a worker dies, all futures of the pool raise `BrokenProcessPool`.

    Raises:
        BrokenProcessPool: The system cannot start processes.
    """
    with ExitStack() as stack:
        try:
            # Imported late: only long tasks are worth a pool, and not every system can start one.
            from loky import ProcessPoolExecutor
            from loky.backend import get_context

            # Only this process has the other end of the pipe: if it dies, the system closes it.
            pipe, writer = get_context("loky").Pipe(duplex=False)
            stack.enter_context(pipe)
            stack.enter_context(writer)
            arguments = (pipe, setup, *arguments)
            pool = ProcessPoolExecutor(count, initializer=_set_up, initargs=arguments, env=WORKERS)
            stack.callback(pool.shutdown, wait=True, kill_workers=True)
            with _interrupts_blocked():
                # The first task starts all workers.
                pool.submit(os.getpid)
        except (ImportError, OSError, AttributeError) as error:
            # loky flushes stdout, and raises AttributeError if this process has no stdout.
            raise BrokenProcessPool(str(error)) from error
        yield pool


def worked(  # noqa: PLR0913 (options by name)
    function: Callable[[A], T],
    items: Iterable[S],
    argument: Callable[[S], A],
    *,
    workers: int,
    may_begin: Callable[[], bool],
    is_given_up: Callable[[], bool],
    setup: Callable[[], None] | None = None,
) -> Iterator[tuple[S, T]]:
    """Yield items in order, each with what a function makes of its argument.

    If a worker dies (out of memory, say), its pool breaks: the rest is done in this process.

    Args:
        function: At the top level of a module, or a `partial` of such a function.
        items: The items.
        argument: Returns the argument of an item; it is called when the item is begun.
        workers: The number of worker processes; up to 1: this process does all.
        may_begin: Whether another item may be begun.
        is_given_up: Whether items that workers have begun are given up.
        setup: Called once in each process, before its first item.

    Raises:
        Exception: The function raised it.
    """
    queue = deque(items)
    if workers > 1:
        with suppress(BrokenProcessPool), worker_pool(workers, setup) as pool:
            running = deque[Future[T]]()
            while queue:
                while len(running) < min(len(queue), workers + 1) and may_begin():
                    running.append(pool.submit(function, argument(queue[len(running)])))
                # Windows does not interrupt a longer wait; and `pool.map` would cancel its futures
                # at an interrupt, at which loky prints a traceback.
                while running and not running[0].done() and not is_given_up():
                    wait([running[0]], timeout=POLL_INTERVAL)
                if not (running and running[0].done()):
                    return
                result = running.popleft().result()
                yield queue.popleft(), result
    if queue and setup is not None:
        setup()
    while queue and may_begin():
        item = queue.popleft()
        yield item, function(argument(item))


def _set_up(pipe: Connection, setup: Callable[..., None] | None, *arguments: Any) -> None:
    _ignore_interrupts()
    Thread(target=_exit_with_parent, args=(pipe,), daemon=True).start()
    if setup is not None:
        setup(*arguments)


def _exit_with_parent(pipe: Connection) -> None:
    with suppress(EOFError, OSError):
        pipe.recv_bytes()
    os._exit(1)


def _ignore_interrupts() -> None:
    for number in _INTERRUPTS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block interrupts, so that a process started in this block never sees one."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # Start the resource trackers first: they would start with the process, and unblock interrupts.
    for module in ("multiprocessing", "loky.backend"):
        import_module(f"{module}.resource_tracker").ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _INTERRUPTS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
