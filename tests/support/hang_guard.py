"""A guard against runs that never end: a test must fail, not hang."""

import threading
from collections.abc import Callable
from typing import Any


def within(seconds: float, function: Callable[..., Any], *arguments: Any) -> Any:
    """What a function returns or raises, if it does so in time.

    It runs in a daemon thread, which is left behind where it does not end.
    """
    outcome: dict[str, Any] = {}

    def call() -> None:
        try:
            outcome["value"] = function(*arguments)
        except BaseException as error:  # handed on to the test
            outcome["error"] = error

    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(seconds)
    assert not thread.is_alive(), f"still running after {seconds:g} s"
    if "error" in outcome:
        raise outcome["error"]
    return outcome["value"]
