"""How finely motions are sampled again, to find their peaks between samples."""

import numpy as np

from rbstab.mechanics.numbers import Array

PARTS = 4
"""The parts into which an interval is divided."""

MIN_INTERVALS = 8
"""A motion with fewer intervals is sampled finer."""

INTERVALS_PER_STEP = 4
"""If a motion is sampled finer, it has at least this many intervals for each step."""

MAX_SAMPLES = 20_001
"""Motions are not sampled finer than this. The peaks of faster ones are unknown."""


def refinements(steps: Array, samples: int, most: int) -> Array:
    """Return into how many parts the intervals of members are divided, shape (m,).

    It is 1 if there is an interval for each step.

    Args:
        steps: The steps of members, shape (m,).
        samples: The number of samples.
        most: The largest number of samples.
    """
    needed = np.maximum(steps, MIN_INTERVALS) / (samples - 1)
    parts = np.where(needed > 1.0, np.exp2(np.ceil(np.log2(INTERVALS_PER_STEP * needed))), 1.0)
    return np.clip(parts, 1, max(1, (most - 1) // (samples - 1))).astype(int)


def refined(times: Array, parts: int) -> Array:
    """Return times with each interval divided into parts, with the same ends."""
    return np.linspace(times[0], times[-1], parts * (len(times) - 1) + 1)
