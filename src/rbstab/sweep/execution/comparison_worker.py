"""A worker process that runs single members by SciPy, for a comparison.

Importing SciPy takes as long as a sweep of a thousand members. So a command may start the process
before it has read its plan: this module imports nothing that takes time.
"""

import os
from contextlib import suppress
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread
from typing import Any

from rbstab.processes.imports import keep_imports
from rbstab.processes.workers import Worker


def start_comparison_worker() -> Worker:
    """Start a worker process.

    Its first request is a `Plan`, and its first answer is None. Each later request is the number of
    a member, and its answer is the outcome of this member, with `largest_of_finals`.

    Raises:
        WorkerDiedError: The system cannot start another process.
    """
    return Worker(_serve)


def _serve(connection: Connection) -> None:
    """Receive requests in the main thread; another thread runs the members."""
    requests: SimpleQueue[Any] = SimpleQueue()
    Thread(target=_run, args=(connection, requests), daemon=True).start()
    # The pipe is closed when the parent ends, for any reason; this process then ends at once.
    with suppress(EOFError, OSError):
        while True:
            requests.put(connection.recv())
    os._exit(0)


def _run(connection: Connection, requests: "SimpleQueue[Any]") -> None:
    """Run members; an unexpected error ends the process."""
    try:
        with keep_imports():
            import scipy.integrate  # noqa: F401 (the engine imports it late)

            from rbstab.sweep.members.scipy_comparison import ENGINE
            from rbstab.sweep.members.single import SingleRuns
        singles = SingleRuns(requests.get(), ENGINE, with_largest=True)
        connection.send(None)
        while True:
            member = requests.get()
            connection.send(singles.compute(member, member + 1).outcome)
    finally:
        os._exit(1)
