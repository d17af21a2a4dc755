"""Handlers of Ctrl-C and SIGTERM: the first one finishes the work, the second one stops at once.

Job systems and `kill` end a program with SIGTERM. It acts as Ctrl-C does; only the exit code
differs.
"""

import signal
import sys
import time
from _thread import interrupt_main, start_new_thread
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, main_thread
from typing import Any

from rbstab_cli import exit_codes

REPEAT_DELAY = 0.05
"""s until an interrupt that was lost is repeated."""

_terminated = Event()
"""Set by SIGTERM."""


def handle_interrupts() -> None:
    """Make SIGTERM raise `KeyboardInterrupt`, as Ctrl-C does, and let neither be lost.

    A process that was started with SIGTERM ignored keeps ignoring it.
    """

    def on_sigterm(_signal: int, _frame: Any) -> None:
        _terminated.set()
        raise KeyboardInterrupt

    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, on_sigterm)
    sys.unraisablehook = _repeat_lost_interrupt


def stop_handling() -> None:
    """Let SIGTERM and Ctrl-C end the process from now on: its work is done.

    Otherwise one in the last milliseconds would end Python with a traceback.
    """
    for number in (signal.SIGTERM, signal.SIGINT):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)


def _repeat_lost_interrupt(lost: "sys.UnraisableHookArgs") -> None:
    """Interrupt again after an interrupt that Python has dropped."""
    # Python drops every exception in a destructor or in the callback of a weak reference, where a
    # signal may happen to arrive.
    if not isinstance(lost.exc_value, KeyboardInterrupt):
        sys.__unraisablehook__(lost)
        return
    number = signal.SIGTERM if _terminated.is_set() else signal.SIGINT
    # Starting a `threading.Timer` waits until its thread runs. On a busy machine the interrupt
    # would come back meanwhile, and be dropped here.
    start_new_thread(_interrupt_main_thread, (number,))


def _interrupt_main_thread(number: signal.Signals) -> None:
    # Not at once: the destructor has not ended.
    time.sleep(REPEAT_DELAY)
    if hasattr(signal, "pthread_kill"):
        # It wakes a thread that waits.
        signal.pthread_kill(main_thread().ident or 0, number)
    else:
        interrupt_main(number)


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
