"""A pipe by which worker processes notice that their parent has died, and exit.

The parent alone holds the other end open, so the system closes it however the parent ends.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from threading import Thread


@contextmanager
def parent_watch() -> Iterator[Connection]:
    """Open the pipe in the parent; the workers pass what is yielded to `exit_with_parent`."""
    # Imported late: only a parent of worker processes needs it.
    from loky.backend import get_context

    theirs, ours = get_context("loky").Pipe(duplex=False)
    with theirs, ours:
        yield theirs


def exit_with_parent(line: Connection) -> None:
    """End this process as soon as its parent has died.

    Args:
        line: What `parent_watch` yielded in the parent.
    """
    Thread(target=_wait, args=(line,), daemon=True).start()


def _wait(line: Connection) -> None:
    with suppress(EOFError, OSError):
        line.recv_bytes()
    os._exit(1)
