"""Timing of actions in turns, so that a drifting machine speed affects all alike."""

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from statistics import median

CALLS = 3
"""Calls of an action in one of its turns."""


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


def least_by_turns(rounds: int, *actions: Callable[[], object]) -> list[float]:
    """Return the least wall time of each action, s, after one warm-up round.

    The least of many is the time without other programs, so it serves for ratios. In a turn each
    action is called several times, as the first time follows another one's use of the caches.

    Args:
        rounds: How often each action has a turn.
        actions: They have their turns one after the other.
    """
    for action in actions:
        action()
    taken = [
        [min(_seconds(action) for _ in range(CALLS)) for action in actions] for _ in range(rounds)
    ]
    return [min(column) for column in zip(*taken, strict=True)]


def _seconds(action: Callable[[], object]) -> float:
    begin = time.perf_counter()
    action()
    return time.perf_counter() - begin


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
