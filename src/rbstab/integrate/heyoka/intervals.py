"""Integration over intervals between which the parameters change, such as legs of inputs."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.mechanics.numbers import Array

GRID_END = hy.taylor_outcome.time_limit
"""heyoka's name for the end of a grid."""


class Intervals(NamedTuple):
    """The intervals of one run.

    Attributes:
        edges: Their ends, s, ascending; two may be equal.
        times: The samples, s, from the first edge to the last one. One at an edge belongs to the
            interval that begins there.
        step_limit: The largest number of steps.
    """

    edges: list[float]
    times: Array
    step_limit: int


def propagate(
    integrator: Any,
    intervals: Intervals,
    callback: Callable[[Any], bool],
    begin: Callable[[int], None],
    end: Callable[[int], None],
) -> tuple[Any, int, Array]:
    """Integrate over intervals.

    Args:
        integrator: heyoka's integrator, at the first edge.
        intervals: The intervals and the samples.
        callback: Called after every step; returns whether the run continues.
        begin: Called with the number of an interval before it; sets the parameters.
        end: Called with the number of each interval but the last after it; may change the state.

    Returns:
        heyoka's outcome, the number of steps, and the computed samples, shape (n, states).
    """
    edges, times, steps = intervals.edges, intervals.times.tolist(), 0
    rows = [*intervals.times.searchsorted(edges[:-1]).tolist(), len(times)]
    samples = [np.zeros((0, len(integrator.state)))]
    outcome = GRID_END
    for number, (low, high) in enumerate(pairwise(edges)):
        begin(number)
        wanted, is_last = times[rows[number] : rows[number + 1]], number == len(edges) - 2
        if low < high:
            first = int(not wanted or wanted[0] != low)
            grid = [*([low] if first else []), *wanted, *([] if is_last else [high])]
            outcome, _, _, taken, _, found = integrator.propagate_grid(
                grid, max_steps=intervals.step_limit - steps, callback=callback
            )
            steps += taken
            samples.append(found[first : first + len(wanted)])
        if outcome != GRID_END or is_last:
            break
        if steps >= intervals.step_limit:
            # heyoka takes a limit of zero for none.
            outcome = hy.taylor_outcome.step_limit
            break
        end(number)
    return outcome, steps, np.concatenate(samples)
