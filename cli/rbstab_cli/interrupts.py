"""Handlers of Ctrl-C and SIGTERM: the first one finishes the work, the second one stops at once.

Job systems and `kill` end a program with SIGTERM. It acts as Ctrl-C does; only the exit code
differs.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event
from typing import Any

from rbstab_cli import exit_codes

_terminated = Event()
"""Set by SIGTERM."""


def interrupt_on_sigterm() -> None:
    """Make SIGTERM raise `KeyboardInterrupt`, as Ctrl-C does.

    A process that was started with SIGTERM ignored keeps ignoring it.
    """

    def on_sigterm(_signal: int, _frame: Any) -> None:
        _terminated.set()
        raise KeyboardInterrupt

    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, on_sigterm)


def interrupted_code() -> int:
    """Return the exit code of an interrupted command: it tells Ctrl-C from SIGTERM."""
    return exit_codes.TERMINATED if _terminated.is_set() else exit_codes.INTERRUPTED


@contextmanager
def graceful_interrupts(stop: Event, interrupted: Event) -> Iterator[None]:
    """Set both events on the first interrupt; raise `KeyboardInterrupt` on the second.

    Ctrl-C and SIGTERM are interrupts. Use it last in a command: after an interrupt, further
    interrupts are ignored once the block has ended. Use it in the main thread: only that thread
    receives interrupts.
    """

    def on_interrupt(number: int, _frame: Any) -> None:
        # Nothing is printed here: another line may be half printed.
        if number == signal.SIGTERM:
            _terminated.set()
        if interrupted.is_set():
            raise KeyboardInterrupt
        interrupted.set()
        stop.set()

    before = {signal.SIGINT: signal.signal(signal.SIGINT, on_interrupt)}
    if signal.getsignal(signal.SIGTERM) is not signal.SIG_IGN:
        before[signal.SIGTERM] = signal.signal(signal.SIGTERM, on_interrupt)
    try:
        yield
    finally:
        # After an interrupt the process is about to end; another interrupt must not disturb that.
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if interrupted.is_set() else handler)
