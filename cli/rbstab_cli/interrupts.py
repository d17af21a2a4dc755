"""Handler of Ctrl-C: the first one finishes the running work, the second one stops at once."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event
from typing import Any


@contextmanager
def graceful_interrupts(stop: Event, interrupted: Event) -> Iterator[None]:
    """Set both events on the first interrupt; raise `KeyboardInterrupt` on the second.

    Use it last in a command: after an interrupt, further interrupts are ignored once the block has
    ended. Use it in the main thread: only that thread receives interrupts.
    """

    def on_interrupt(_signal: int, _frame: Any) -> None:
        # Nothing is printed here: another line may be half printed.
        if interrupted.is_set():
            raise KeyboardInterrupt
        interrupted.set()
        stop.set()

    before = signal.signal(signal.SIGINT, on_interrupt)
    try:
        yield
    finally:
        # After an interrupt the process is about to end; another interrupt must not disturb that.
        signal.signal(signal.SIGINT, signal.SIG_IGN if interrupted.is_set() else before)
