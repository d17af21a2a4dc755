"""A pipe that makes worker processes exit when their parent dies.

Only the parent has the other end open. When the parent ends for any reason, the system closes it.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from threading import Thread


@contextmanager
def parent_watch() -> Iterator[Connection]:
    """Open the pipe in the parent, and yield the end that workers pass to `exit_with_parent`."""
    # Imported late: only a parent of worker processes needs it.
    from loky.backend import get_context

    worker_end, parent_end = get_context("loky").Pipe(duplex=False)
    with worker_end, parent_end:
        yield worker_end


def exit_with_parent(pipe: Connection) -> None:
    """End this process when its parent dies. A thread waits for that.

    Args:
        pipe: The end of the pipe that `parent_watch` yielded in the parent.
    """
    Thread(target=_wait, args=(pipe,), daemon=True).start()


def _wait(pipe: Connection) -> None:
    with suppress(EOFError, OSError):
        pipe.recv_bytes()
    os._exit(1)
