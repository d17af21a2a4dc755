"""Processes that do not outlive their parent, however it ends: a pipe that it alone holds open."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from threading import Thread


@contextmanager
def parent_watch() -> Iterator[Connection]:
    """What loky's processes are given to `hold`, by the process that begins them."""
    # Imported late: only what begins processes needs it.
    from loky.backend import get_context

    theirs, ours = get_context("loky").Pipe(duplex=False)
    with theirs, ours:
        yield theirs


def exit_with_parent(line: Connection) -> None:
    """Ends this process as soon as nobody holds the other end."""
    Thread(target=_wait, args=(line,), daemon=True).start()


def _wait(line: Connection) -> None:
    with suppress(EOFError, OSError):
        line.recv_bytes()
    os._exit(1)
