"""The time up to which a chaotic motion is reproducible in double precision."""

from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from rbstab.integrate.problem import Problem, Trajectory
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array

NUMERICAL_ERRORS = (ArithmeticError, ValueError, np.linalg.LinAlgError)
"""Exceptions raised if a small linear system contains infinities."""

TRUST_TOLERANCE = 1e-4
"""If two runs differ by more than this times the largest entry, they are not reproducible."""

NEGLIGIBLE = 1e-9
"""rad, rad/s, m, m/s: a vector that never exceeds this contains only round-off."""

Sampled = tuple[float, Array, RunStatus | None]
"""The time and the state of a sample, and a status if the run ends there early."""


def perturbed_start(problem: Problem, least: float = 0.0) -> Array:
    """Return the start of the second run: one unit in the last place away in every state.

    Args:
        problem: The problem of the first run.
        least: The least change of a state.
    """
    return np.maximum(np.nextafter(problem.start, np.inf), problem.start + least)


def trusted_until(run: Trajectory, second: Iterator[Sampled], size: int = 12) -> float:
    """Return the time of the last sample that does not depend on the last digit of the start.

    The trusted time ends when two runs differ by more than `TRUST_TOLERANCE` times the largest
    value of Θ, Ω, E or F (X or V). After that, both runs are equally valid in double precision.

    Args:
        run: The run.
        second: The samples of a second run, from `perturbed_start`.
        size: The number of states that are compared: those of the body.

    Returns:
        The time, s. It is NaN if the deadline ends the second run before the two runs differ:
        then the time is not known.
    """
    if run.status is RunStatus.TIME_LIMIT:
        return np.nan
    # The largest value is taken over all axes, because a held axis contains only round-off.
    states = run.states[:, :size]
    largest_values = np.abs(states).reshape(len(run.times), -1, 3).max(axis=(0, 2))
    scale = np.repeat(np.maximum(largest_values, NEGLIGIBLE), 3)
    trusted = float(run.times[0])
    # A failure of the second run also ends the trusted time.
    with suppress(*NUMERICAL_ERRORS):
        for row, (time, state, status) in enumerate(second):
            is_same_sample = row < len(run.times) and time == run.times[row]
            if is_same_sample:
                difference = np.abs(state[: len(scale)] - states[row])
                if not (difference <= TRUST_TOLERANCE * scale).all():
                    break
                trusted = time
            if status is RunStatus.TIME_LIMIT and trusted < run.times[-1]:
                return np.nan
            if not is_same_sample:
                break
    return trusted
