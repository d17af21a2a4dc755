"""Worker processes, started by loky: a pool, and a single worker at the end of a pipe.

A terminal sends an interrupt to all processes. Workers ignore it: only the parent decides what an
interrupt means. A worker whose parent has died exits at once, however the parent ended.
"""

import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib import import_module
from multiprocessing.connection import Connection
from typing import Any

from rbstab.processes.parent_watch import exit_with_parent, parent_watch


class WorkerDiedError(Exception):
    """A worker process has ended, or could not be started."""


@contextmanager
def worker_pool(
    count: int, setup: Callable[..., None] | None = None, *arguments: Any
) -> Iterator[Executor]:
    """Start a pool of worker processes, and kill them at the end of the block.

    Args:
        count: How many workers.
        setup: Called with `arguments` once in each worker, before its first task.
        arguments: See `setup`.

    Yields:
        The pool. A worker that dies breaks it: then its futures raise `BrokenProcessPool`.
    """
    # Imported late: only long tasks are worth a pool.
    from loky import ProcessPoolExecutor

    with parent_watch() as line:
        pool = ProcessPoolExecutor(count, initializer=_set_up, initargs=(line, setup, *arguments))
        try:
            yield pool
        finally:
            pool.shutdown(wait=True, kill_workers=True)


class Worker:
    """One worker process, which answers requests through a pipe.

    Args:
        serve: Runs in the worker, with its end of the pipe and `arguments`.
        arguments: See `serve`.

    Raises:
        WorkerDiedError: The system cannot start another process.
    """

    def __init__(self, serve: Callable[..., None], *arguments: Any) -> None:
        try:
            # Imported late: not every system that runs rbstab can start processes.
            from loky.backend import get_context

            context = get_context("loky")
            self._connection, theirs = context.Pipe()
        except (ImportError, OSError) as error:
            raise WorkerDiedError(str(error)) from error
        self._process = context.Process(
            target=_serve, args=(serve, theirs, *arguments), daemon=True
        )
        try:
            with _interrupts_blocked():
                self._process.start()
        except (OSError, AttributeError) as error:
            # loky flushes stdout, and raises AttributeError where this process has none.
            self._connection.close()
            raise WorkerDiedError(str(error)) from error
        finally:
            theirs.close()

    def has_answer(self, wait: float) -> bool:
        """Whether an answer is there, waiting for it up to `wait` seconds."""
        return bool(self._connection.poll(wait))

    def send(self, request: Any) -> None:
        """Send a request.

        Raises:
            WorkerDiedError: The worker has ended.
        """
        try:
            self._connection.send(request)
        except OSError as error:
            raise self._died() from error

    def receive(self) -> Any:
        """Wait for an answer and return it.

        Raises:
            WorkerDiedError: The worker has ended.
            Exception: Any that the worker sent as its answer.
        """
        try:
            answer = self._connection.recv()
        except (EOFError, OSError) as error:
            raise self._died() from error
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self) -> None:
        """End the worker at once; what it has not finished is lost."""
        # The pipe first: a worker that ignores the signal exits when its pipe is closed.
        self._connection.close()
        self._process.terminate()
        self._process.join()

    def _died(self) -> WorkerDiedError:
        self.close()
        return WorkerDiedError(f"its process has ended (exit code {self._process.exitcode})")


def _set_up(line: Connection, setup: Callable[..., None] | None, *arguments: Any) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    exit_with_parent(line)
    if setup is not None:
        setup(*arguments)


def _serve(serve: Callable[..., None], connection: Connection, *arguments: Any) -> None:
    # Interrupts cannot be blocked on every system before a process starts.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # A worker inherits the signals that a job script ignores, but `close` must be able to end it.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    serve(connection, *arguments)


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block interrupts, so that a process started in this block never sees one."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # The first process starts the resource trackers, which would unblock interrupts again.
    for module in ("multiprocessing", "loky.backend"):
        import_module(f"{module}.resource_tracker").ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
