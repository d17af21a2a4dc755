"""Peaks of a sampled quantity, at or between its samples."""

import numpy as np

from rbstab.mechanics.numbers import Array


def indices_of_largest(values: Array) -> Array:
    """Return the index of the value farthest from zero, or of the first NaN, on the last axis."""
    return np.asarray(np.abs(values).argmax(axis=-1))


def peaks_at_samples(
    times: Array, values: Array, rates: Array, indices: Array | None = None
) -> tuple[Array, Array]:
    """Return the peaks of many quantities, and their times.

    For each quantity, only the two cubics beside its largest sample are searched.

    Args:
        times: Shape (n,), s, ascending.
        values: Shape (..., n).
        rates: Their derivatives, of the same shape.
        indices: The result of `indices_of_largest`, if it is known.

    Returns:
        The values farthest from zero with their signs, and their times, s, each of shape (...).
    """
    largest = (indices_of_largest(values) if indices is None else indices)[..., np.newaxis]
    around = np.clip(largest + np.array([-1, 0, 1]), 0, len(times) - 1)
    # The places in all values as one row, which numpy takes fastest.
    first = np.arange(largest.size).reshape(largest.shape) * len(times)
    value, rate = (array.reshape(-1).take(first + around) for array in (values, rates))
    start, h = times[around[..., :-1]], np.diff(times[around])
    # Beside the first or last sample, one interval has zero length and no turning point.
    turning = _turning_points(h, value[..., :-1], value[..., 1:], rate[..., :-1], rate[..., 1:])
    candidates = np.concatenate([value[..., 1:2], *(height for _, height in turning)], axis=-1)
    instants = np.concatenate([times[largest], *(start + s * h for s, _ in turning)], axis=-1)
    # The sample comes first: if it is NaN, all candidates are NaN and argmax selects it.
    farthest = np.where(np.isnan(candidates), -1.0, np.abs(candidates)).argmax(axis=-1)
    chosen = farthest[..., np.newaxis]
    peak, when = (np.take_along_axis(array, chosen, -1)[..., 0] for array in (candidates, instants))
    return peak, when


def _turning_points(
    h: Array, start: Array, end: Array, start_rate: Array, end_rate: Array
) -> list[tuple[Array, Array]]:
    """Return both turning points s of each cubic p(s), 0 < s < 1, and p at these points.

    Both numbers are NaN for a point that does not exist.

    Args:
        h: The lengths of the intervals.
        start: p(0).
        end: p(1).
        start_rate: The derivative at 0 by time, p'(0)/h.
        end_rate: The same at 1.
    """
    linear, last = h * start_rate, h * end_rate
    quadratic = 3 * (end - start) - 2 * linear - last
    cubic = 2 * (start - end) + linear + last
    with np.errstate(all="ignore"):
        # Roots of p' = linear + 2 quadratic s + 3 cubic s², in the form without cancellation.
        root = np.sqrt(quadratic**2 - 3 * cubic * linear)
        q = -(quadratic + np.copysign(root, quadratic))
        found = []
        for s in (q / (3 * cubic), linear / q):
            turning = start + s * (linear + s * (quadratic + s * cubic))
            inside = (s > 0) & (s < 1)
            found.append((np.where(inside, s, np.nan), np.where(inside, turning, np.nan)))
    return found
