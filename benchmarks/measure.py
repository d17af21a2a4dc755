"""Timing of actions in turns, so that a drifting machine speed affects all alike."""

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from statistics import median


def by_turns(rounds: int, *actions: Callable[[], float]) -> list[float]:
    """Return the median of each action's results, after one warm-up round.

    Args:
        rounds: How often each action is called.
        actions: Each returns its time, s.
    """
    for action in actions:
        action()
    taken = [[action() for action in actions] for _ in range(rounds)]
    return [median(column) for column in zip(*taken, strict=True)]


def seconds_of(command: Sequence[str]) -> float:
    """Return the wall time of a whole process, s."""
    begin = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - begin


def python(code: str) -> list[str]:
    """Return the command that runs Python code in this environment."""
    return [sys.executable, "-c", code]


def line(name: str, value: float, unit: str, limit: str) -> None:
    """Print one result: its name, its value, and its limit."""
    print(f"{name:<64} {value:9.3g} {unit:<6} {limit}", flush=True)
