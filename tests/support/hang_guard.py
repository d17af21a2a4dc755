"""A time limit for calls that may never end: the test fails and does not hang."""

import signal
import threading
from contextlib import contextmanager
from typing import Any


def within(seconds, function, *arguments):
    """Call a function, return or raise its outcome, and fail if it takes longer than `seconds`.

    The function runs in a daemon thread, which is abandoned when it does not end.
    """
    outcome: dict[str, Any] = {}

    def call():
        try:
            outcome["value"] = function(*arguments)
        except BaseException as error:  # raised again below, in the test's thread
            outcome["error"] = error

    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(seconds)
    assert not thread.is_alive(), f"still running after {seconds:g} s"
    if "error" in outcome:
        raise outcome["error"]
    return outcome["value"]


@contextmanager
def time_limit(seconds):
    """Fail if the block takes longer; it runs in the main thread, as signal handlers require.

    Not on Windows. Calls that wait inside a library, without looking at signals, are not ended.
    """

    def fail(_signal, _frame):
        raise AssertionError(f"still running after {seconds} s")

    before = signal.signal(signal.SIGALRM, fail)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
