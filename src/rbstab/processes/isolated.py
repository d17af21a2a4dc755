"""Calls in a worker process with a time limit and a memory limit, for input that may be hostile.

A library that reads a damaged file may hang, crash or fill the memory. In a worker it does no harm:
this process kills the worker and continues.
"""

import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from multiprocessing.util import Finalize
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import Any, NamedTuple, Self

from rbstab.processes.workers import Worker, WorkerDiedError

START_LIMIT = 60.0
"""s; the longest time to start a worker and to import its function."""

ALARM_DELAY = 2.0
"""s; the system kills a worker this long after its deadline, if the parent has not done so."""


class IsolatedCallError(Exception):
    """A call has no outcome, because its worker was killed or crashed."""


class DeadlineError(IsolatedCallError):
    """A call took longer than its deadline."""


class CrashError(IsolatedCallError):
    """The worker crashed during a call."""


class Limits(NamedTuple):
    """The limits of a call.

    Args:
        deadline: The longest time of the call, s.
        memory: The most memory that the worker may add to what it has, bytes. Only Linux enforces
            this limit.
    """

    deadline: float
    memory: int


class IsolatedFunction:
    """A function that is called in a worker process, one call at a time.

    The first call starts the worker; so does the first call after a worker was killed. Inside such
    a worker all functions are called directly, because it is isolated already.

    Args:
        function: A function of one argument, at the top level of a module. The argument and the
            returned value must be picklable.
    """

    def __init__(self, function: Callable[[Any], Any]) -> None:
        self._function = function
        self._worker: Worker | None = None

    def __call__(self, argument: Any, limits: Limits) -> Any:
        """Call the function and return its value.

        Raises:
            DeadlineError: The call took longer than its deadline.
            CrashError: The worker crashed.
            WorkerDiedError: No worker can be started.
            MemoryError: The worker needed more memory than its limit.
            Exception: The function raised this exception.
        """
        if _is_worker:
            return self._function(argument)
        if self._worker is None:
            self._worker = _start(self._function)
            # Ends the worker with this object, or at exit, where multiprocessing waits for workers.
            self._end_worker = Finalize(self, self._worker.close, exitpriority=0)
        try:
            is_error, outcome = _request(self._worker, argument, limits)
        except BaseException:
            # The worker is dead, late, or busy with a call that was interrupted.
            self.close()
            raise
        if is_error:
            raise outcome
        return outcome

    def close(self) -> None:
        """End the worker at once."""
        if self._worker is not None:
            self._worker = None
            self._end_worker()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def isolated(function: Callable[[Any], Any], argument: Any, limits: Limits) -> Any:
    """Call a function once in a worker process.

    Raises:
        Exception: As `IsolatedFunction.__call__`.
    """
    with IsolatedFunction(function) as call:
        return call(argument, limits)


_Request = tuple[Any, Limits, str]
"""The argument of a call, its limits, and the folder to which its relative paths refer."""

_is_worker = False
"""Whether this process is a worker of this module."""


def _start(function: Callable[[Any], Any]) -> Worker:
    worker = Worker(_serve, function)
    try:
        if not worker.has_answer(START_LIMIT):
            raise WorkerDiedError(f"its process did not start within {START_LIMIT:g} s")
        worker.receive()
    except BaseException:
        worker.close()
        raise
    return worker


def _request(worker: Worker, argument: Any, limits: Limits) -> tuple[bool, Any]:
    """Return whether the call raised an exception, and the exception or the value."""
    try:
        worker.send((argument, limits, _current_folder()))
        if not worker.has_answer(limits.deadline):
            raise DeadlineError(f"it took more than {limits.deadline:.3g} s")
        is_error, outcome = worker.receive()
    except WorkerDiedError as error:
        raise CrashError("its process crashed") from error
    return is_error, outcome


def _current_folder() -> str:
    try:
        return str(Path.cwd())
    except OSError:
        # It was removed.
        return "."


def _serve(connection: Connection, function: Callable[[Any], Any]) -> None:
    """Call the function in the main thread; another thread receives the arguments."""
    global _is_worker  # noqa: PLW0603 (a fact about the process)
    _is_worker = True
    _be_silent()
    requests: SimpleQueue[_Request] = SimpleQueue()
    Thread(target=_receive, args=(connection, requests), daemon=True).start()
    connection.send(None)
    while True:
        argument, limits, folder = requests.get()
        with suppress(OSError):
            os.chdir(folder)
        with _limited(limits):
            answer = _answer(function, argument)
        # If the parent has died, the other thread ends the process.
        with suppress(OSError):
            connection.send_bytes(answer)
        del answer


def _receive(connection: Connection, requests: SimpleQueue[_Request]) -> None:
    """Pass on the requests; exit when the parent dies, even during a call."""
    with suppress(EOFError, OSError):
        while True:
            requests.put(connection.recv())
    os._exit(0)


def _answer(function: Callable[[Any], Any], argument: Any) -> bytes:
    try:
        return pickle.dumps((False, function(argument)))
    except Exception as error:
        return _pickled_error(error)


def _pickled_error(error: Exception) -> bytes:
    """Return a pickled exception; one that cannot be pickled becomes a RuntimeError."""
    try:
        content = pickle.dumps((True, error))
        pickle.loads(content)  # noqa: S301 (our own bytes)
    except Exception:
        return pickle.dumps((True, RuntimeError(f"{type(error).__name__}: {error}")))
    return content


def _be_silent() -> None:
    """Hide the messages and core dumps of crashing libraries; the parent reports the crash."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


@contextmanager
def _limited(limits: Limits) -> Iterator[None]:
    """Return a context in which the system enforces the limits of a call.

    A library that hangs may stop all threads of Python, so that none sees the parent die. The alarm
    then kills the process.
    """
    if sys.platform == "win32":
        yield
        return
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_REAL, limits.deadline + ALARM_DELAY)
    with _limited_memory(limits.memory):
        yield
    signal.setitimer(signal.ITIMER_REAL, 0)


@contextmanager
def _limited_memory(memory: int) -> Iterator[None]:
    """Return a context in which the address space of the process may grow by `memory` bytes."""
    if sys.platform != "linux":
        # Other systems accept the limit and ignore it.
        yield
        return
    import resource

    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    wanted = pages * resource.getpagesize() + memory
    before = resource.getrlimit(resource.RLIMIT_AS)
    lowest = min(limit for limit in (wanted, *before) if limit != resource.RLIM_INFINITY)
    resource.setrlimit(resource.RLIMIT_AS, (lowest, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)
