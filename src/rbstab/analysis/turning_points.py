"""Turning points of sampled signals between their samples, with estimates of their errors."""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.hermite import HermitePolynomials, hermite_polynomials
from rbstab.mechanics.numbers import Array

NODES = 4
"""The samples through which a turning point is interpolated, with their rates (degree 7)."""

ROOT_STEPS = 3
"""Steps to find where the rate of an interpolant is zero."""

CONVERGING = 0.25
"""The motion is resolved if degree 5 has at most this times the error of degree 3."""

UNRESOLVED = 10.0
"""Factor on the differences between interpolants that do not converge."""

MIN_MIDDLE_RATE = 0.5
"""If the rate of a cubic in its middle is less than this times the mean of its ends, the signal may
turn twice in the interval."""

JUMP = 0.5
"""If the rate changes in an interval by more than this times the peak per interval, the signal may
turn twice in it."""


ROWS_AT_ONCE = 32
"""Signals whose changes are in memory at once: they stay in the cache of the processor."""


class Signals(NamedTuple):
    """Sampled signals.

    Attributes:
        times: Shape (n,) for all signals, or (rows, n), s.
        values: Shape (rows, n).
        rates: The derivatives of the values, shape (rows, n).
    """

    times: Array
    values: Array
    rates: Array


class TurningPoints(NamedTuple):
    """Turning points of signals, shape (p,) each.

    Attributes:
        row: The number of the signal.
        interval: The number of the interval between two samples.
        time: s.
        value: The interpolated value.
        error: An estimate of the error of the value; infinite if there is none.
    """

    row: Array
    interval: Array
    time: Array
    value: Array
    error: Array


def turning_points(
    signals: Signals, lowest: Array, indices: Array, longest: Array | None = None
) -> TurningPoints:
    """Return the turning points at which a signal may be farther from zero than a bound.

    A signal turns where its rate changes sign between two samples. It may also turn twice between
    two samples. Intervals that look so are included, with an infinite error.

    Args:
        signals: The signals.
        lowest: The bound of each signal, shape (rows,). It must be above 0.
        indices: The sample of each signal that is farthest from zero, shape (rows,).
        longest: The length of an interval of each signal, shape (rows,), s; default the longest
            interval of all signals.
    """
    times, values, rates = signals
    rising = rates > 0
    if longest is None:
        longest = np.full(len(values), longest_interval(times))
    row, interval = _pairs(np.flatnonzero(rising[:, 1:] != rising[:, :-1]), values.shape[1] - 1)
    excess = _excess(values, rates, row, interval, longest[row])
    in_reach = excess >= lowest[row]
    row, interval = row[in_reach], interval[in_reach]
    times = np.broadcast_to(times, values.shape)
    found = TurningPoints(row, interval, *_interpolated(times, values, rates, row, interval))
    beside = _beside_largest(times, values, rates, indices)
    keys = np.unique(np.concatenate([beside, _where_rate_jumps(times, rates, lowest, longest)]))
    row, interval = _pairs(keys, values.shape[1])
    same_sign = rising[row, interval] == rising[row, interval + 1]
    row, interval = row[same_sign], interval[same_sign]
    ends = row, np.array([interval, interval + 1])
    magnitudes = np.abs(values[ends])
    reach = magnitudes.max(axis=0) + longest[row] * np.abs(rates[ends]).max(axis=0)
    in_reach = reach >= lowest[row]
    end = interval + (magnitudes[1] > magnitudes[0])
    unknown = np.full(len(row), np.inf)
    hidden = TurningPoints(row, interval, times[row, end], values[row, end], unknown)
    return TurningPoints(
        *(np.concatenate([a, b[in_reach]]) for a, b in zip(found, hidden, strict=True))
    )


def longest_interval(times: Array) -> float:
    """Return the longest interval between two samples of any row, s."""
    return float(np.diff(times).max(initial=0.0))


def _pairs(keys: Array, count: int) -> tuple[Array, Array]:
    """Return the quotients and remainders of keys."""
    row = keys // count
    return row, keys - row * count


def _excess(values: Array, rates: Array, row: Array, interval: Array, longest: Array) -> Array:
    """Return how far from zero a signal may turn between samples where its rate changes sign.

    The bound is the larger sample, plus three times the height of the intersection of the tangents.
    """
    key = row * values.shape[1] + interval
    flat, flat_rates = values.reshape(-1), rates.reshape(-1)
    up, down = np.abs(flat_rates[key]), np.abs(flat_rates[key + 1])
    height = 3.0 * longest * up * down / (up + down)
    return np.asarray(np.maximum(np.abs(flat[key]), np.abs(flat[key + 1])) + height)


def _beside_largest(times: Array, values: Array, rates: Array, indices: Array) -> Array:
    """Return the intervals beside the largest sample whose cubics almost turn, as keys."""
    rows, count = np.arange(len(values)), values.shape[1]
    row = np.concatenate([rows[indices > 0], rows[indices < count - 1]])
    interval = np.concatenate([indices[indices > 0] - 1, indices[indices < count - 1]])
    begin, end = (row, interval), (row, interval + 1)
    mean_of_ends = (rates[begin] + rates[end]) / 2
    # The rate of the cubic in the middle of the interval.
    middle = 1.5 * (values[end] - values[begin]) / (times[end] - times[begin]) - mean_of_ends / 2
    turns = middle * np.sign(mean_of_ends) < MIN_MIDDLE_RATE * np.abs(mean_of_ends)
    return np.asarray((row * count + interval)[turns])


def _where_rate_jumps(times: Array, rates: Array, lowest: Array, longest: Array) -> Array:
    """Return the intervals in which the rate changes fast, as keys."""
    largest = np.empty(len(rates))
    for first in range(0, len(rates), ROWS_AT_ONCE):
        block = slice(first, first + ROWS_AT_ONCE)
        change = rates[block, 1:] - rates[block, :-1]
        largest[block] = np.maximum(change.max(axis=1), -change.min(axis=1))
    suspect = np.flatnonzero(longest * largest > JUMP * lowest)
    h = np.diff(times[suspect])
    row, interval = np.nonzero(
        h * np.abs(np.diff(rates[suspect])) > JUMP * lowest[suspect, np.newaxis]
    )
    return np.asarray(suspect[row] * rates.shape[1] + interval)


def _interpolated(
    times: Array, values: Array, rates: Array, row: Array, interval: Array
) -> tuple[Array, Array, Array]:
    """Return the times and values of turning points, and the estimates of their errors."""
    count = values.shape[1]

    def through(first: Array, nodes: int) -> HermitePolynomials:
        chosen = row, np.clip(first, 0, count - nodes) + np.arange(nodes)[:, np.newaxis]
        return hermite_polynomials(times[chosen], values[chosen], rates[chosen])

    ends = row, np.array([interval, interval + 1])
    begin, end = times[ends]
    cubic = through(interval, 2)
    if count < NODES:
        t, value, _ = _turn(cubic, begin, end, rates[ends])
        return t, value, np.full(len(t), np.inf)
    best = through(interval - 1, NODES)
    quintics = [through(first, NODES - 1) for first in (interval - 1, interval)]
    t, value, remainder = _turn(best, begin, end, rates[ends])
    # The interpolants differ most in the middle of the interval.
    middle = (begin + end) / 2
    exact = best.values_at(middle)
    error_of_cubic = np.abs(cubic.values_at(middle) - exact)
    errors = [np.abs(quintic.values_at(middle) - exact) for quintic in quintics]
    error_of_quintic = np.maximum(*errors)
    # Of a resolved motion, degree 7 has a much smaller error than degree 5.
    error = np.where(
        error_of_quintic <= CONVERGING * error_of_cubic,
        error_of_quintic,
        UNRESOLVED * (error_of_cubic + error_of_quintic),
    )
    error = error + remainder
    return t, value, np.where(np.isfinite(value) & np.isfinite(error), error, np.inf)


def _turn(
    polynomials: HermitePolynomials, begin: Array, end: Array, rates: Array
) -> tuple[Array, Array, Array]:
    """Return where polynomials turn, their values there, and what the values may miss.

    Args:
        polynomials: Their rates have different signs at both ends.
        begin: The first end, shape (p,), s.
        end: The second end, shape (p,), s.
        rates: The rates at both ends, shape (2, p).
    """
    low, high, rising = begin, end, rates[0] > 0
    t = begin + (end - begin) * rates[0] / (rates[0] - rates[1])
    for _ in range(ROOT_STEPS):
        _, first, second = polynomials.at(t)
        is_before = (first > 0) == rising
        low, high = np.where(is_before, t, low), np.where(is_before, high, t)
        step = t - first / np.where(second != 0, second, 1.0)
        # Newton's step, or bisection if it leaves the bracket.
        t = np.where((step >= low) & (step <= high), step, (low + high) / 2)
    value, first, second = polynomials.at(t)
    curved = np.abs(second) > 0
    remainder = np.where(curved, first**2 / (2 * np.where(curved, np.abs(second), 1.0)), 0.0)
    return t, value, np.minimum(remainder, np.abs(first) * (end - begin))
