"""Timing by turns, so that a machine whose speed drifts favours nobody."""

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from statistics import median


def by_turns(rounds: int, *actions: Callable[[], float]) -> list[float]:
    """The median of what each action returns, after one round that is not counted.

    Args:
        rounds: How often each action is called.
        actions: Each returns the seconds that it wants to be judged by.
    """
    for action in actions:
        action()
    taken = [[action() for action in actions] for _ in range(rounds)]
    return [median(column) for column in zip(*taken, strict=True)]


def seconds_of(command: Sequence[str]) -> float:
    """The wall time of a whole process."""
    begin = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - begin


def python(code: str) -> list[str]:
    """The command that runs Python code in the present environment."""
    return [sys.executable, "-c", code]


def line(what: str, value: float, unit: str, limit: str) -> None:
    """One result: what was measured, its value, and what it should be."""
    print(f"{what:<64} {value:9.3g} {unit:<6} {limit}", flush=True)
