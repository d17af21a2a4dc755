"""Ctrl-C, once to end in good order and twice to end at once."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event
from typing import Any


@contextmanager
def ending_in_order(stop: Event, interrupted: Event) -> Iterator[None]:
    """Lets the first interrupt set both events, and the second one raise `KeyboardInterrupt`.

    It must be the last thing that a command does before it ends: once interrupted, further
    interrupts have no effect behind it. It must be used in the main thread, for interrupts reach
    no other.
    """

    def stop_if_failed(_signal: int, _frame: Any) -> None:
        # Nothing is printed here, where any other line may be half printed.
        if interrupted.is_set():
            raise KeyboardInterrupt
        interrupted.set()
        stop.set()

    before = signal.signal(signal.SIGINT, stop_if_failed)
    try:
        yield
    finally:
        # Once interrupted, the process is about to end, and no interrupt should spoil that.
        signal.signal(signal.SIGINT, signal.SIG_IGN if interrupted.is_set() else before)
