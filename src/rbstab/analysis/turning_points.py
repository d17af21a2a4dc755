"""Turning points of sampled signals between their samples, with estimates of their errors."""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.hermite import HermitePolynomials, HermiteTable, hermite_table
from rbstab.mechanics.numbers import Array

NODES = 4
"""The samples through which a turning point is interpolated, with their rates (degree 7)."""

MORE_NODES = 6
"""The same if `NODES` are not accurate enough (degree 11)."""

ESTIMATES = {NODES: ((3,), 2), MORE_NODES: ((5, 4), 3)}
"""By the number of samples of an interpolant: those of the interpolants whose largest difference
from it is the estimate of its error, and those of the ones that must be worse if it converges."""

ROOT_STEPS = 3
"""Steps to find where the rate of an interpolant is zero."""

CONVERGING = 0.25
"""The motion is resolved if the estimated error is at most this times that of a lower degree."""

UNRESOLVED = 10.0
"""Factor on the differences between interpolants that do not converge."""

MIN_MIDDLE_RATE = 0.5
"""If the rate of a cubic in its middle is less than this times the mean of its ends, the signal may
turn twice in the interval."""

JUMP = 0.5
"""If the rate changes in an interval by more than this times the peak per interval, the signal may
turn twice in it."""


ROWS_AT_ONCE = 128
"""Signals that are scanned at once: they stay in the cache of the processor."""


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
    times: Array, values: Array, rates: Array, lowest: Array, indices: Array
) -> TurningPoints:
    """Return the turning points at which a signal may be farther from zero than a bound.

    A signal turns where its rate changes sign between two samples. It may also turn twice between
    two samples. Intervals that look so are included, with an infinite error.

    Args:
        times: Shape (n,) for all signals, or (rows, n), s.
        values: Shape (rows, n).
        rates: The derivatives of the values, shape (rows, n).
        lowest: The bound of each signal, shape (rows,). It must be above 0.
        indices: The sample of each signal that is farthest from zero, shape (rows,).
    """
    # The longest interval of each signal, s. It does not depend on the other signals.
    longest = np.broadcast_to(np.diff(times).max(axis=-1, initial=0.0), lowest.shape)
    turns, jumps = _scanned(rates, JUMP * lowest / longest)
    row, interval = _pairs(turns, values.shape[1])
    in_reach = _excess(values, rates, turns, longest[row]) >= lowest[row]
    row, interval = row[in_reach], interval[in_reach]
    found = TurningPoints(row, interval, *_interpolated(times, values, rates, row, interval))
    beside = _beside_largest(times, values, rates, indices)
    row, interval = _pairs(np.unique(np.concatenate([beside, jumps])), values.shape[1])
    same_sign = (rates[row, interval] > 0) == (rates[row, interval + 1] > 0)
    row, interval = row[same_sign], interval[same_sign]
    ends = row, np.array([interval, interval + 1])
    magnitudes = np.abs(values[ends])
    reach = magnitudes.max(axis=0) + longest[row] * np.abs(rates[ends]).max(axis=0)
    in_reach = reach >= lowest[row]
    end = interval + (magnitudes[1] > magnitudes[0])
    unknown = np.full(len(row), np.inf)
    hidden = TurningPoints(row, interval, _times_at(times, row, end), values[row, end], unknown)
    return TurningPoints(
        *(np.concatenate([a, b[in_reach]]) for a, b in zip(found, hidden, strict=True))
    )


def through_more_samples(
    times: Array, values: Array, rates: Array, found: TurningPoints
) -> TurningPoints:
    """Return turning points interpolated through `MORE_NODES` samples, where this is more accurate.

    Args:
        times: Shape (n,), s.
        values: Shape (rows, n).
        rates: The derivatives of the values, shape (rows, n).
        found: Turning points of these signals.
    """
    # Without an estimate, the rate may not change its sign in the interval.
    some = np.flatnonzero(np.isfinite(found.error))
    if values.shape[1] < MORE_NODES or not len(some):
        return found
    row, interval = found.row[some], found.interval[some]
    interpolated = _interpolated(times, values, rates, row, interval, MORE_NODES)
    better = interpolated[2] < found.error[some]
    time, value, error = found.time.copy(), found.value.copy(), found.error.copy()
    for target, new in zip((time, value, error), interpolated, strict=True):
        target[some[better]] = new[better]
    return found._replace(time=time, value=value, error=error)


def _pairs(keys: Array, count: int) -> tuple[Array, Array]:
    """Return the quotients and remainders of keys."""
    row = keys // count
    return row, keys - row * count


def _times_at(times: Array, row: Array, index: Array) -> Array:
    """Return some samples of signals; `times` has the shape (n,) or (rows, n)."""
    return times[index] if times.ndim == 1 else times[row, index]


def _scanned(rates: Array, largest_change: Array) -> tuple[Array, Array]:
    """Return the intervals in which rates change their sign, and those in which they jump, as keys.

    Args:
        rates: Shape (rows, n).
        largest_change: A larger change of a rate is a jump, shape (rows,).
    """
    rows, count = rates.shape
    turns, jumps = [], []
    is_turn = np.zeros((min(rows, ROWS_AT_ONCE), count), dtype=bool)
    is_jump, change = np.zeros_like(is_turn), np.zeros(is_turn.shape)
    for first in range(0, rows, ROWS_AT_ONCE):
        some = rates[first : first + ROWS_AT_ONCE]
        some_turn, some_jump, some_change = (a[: len(some)] for a in (is_turn, is_jump, change))
        # All rows as one: numpy is slower on many short rows.
        flat, flat_change = some.reshape(-1), some_change.reshape(-1)
        rising = flat > 0
        np.not_equal(rising[1:], rising[:-1], out=some_turn.reshape(-1)[:-1])
        np.subtract(flat[1:], flat[:-1], out=flat_change[:-1])
        np.abs(flat_change, out=flat_change)
        bound = largest_change[first : first + ROWS_AT_ONCE, np.newaxis]
        np.greater(some_change, bound, out=some_jump)
        # No interval follows the last sample of a row.
        some_turn[:, -1] = some_jump[:, -1] = False
        turns.append(np.flatnonzero(some_turn) + first * count)
        jumps.append(np.flatnonzero(some_jump) + first * count)
    if not rows:
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    return np.concatenate(turns), np.concatenate(jumps)


def _excess(values: Array, rates: Array, keys: Array, longest: Array) -> Array:
    """Return how far from zero a signal may turn between samples where its rate changes sign.

    The bound is the larger sample, plus three times the height of the intersection of the tangents.
    """
    flat, flat_rates = values.reshape(-1), rates.reshape(-1)
    up, down = np.abs(flat_rates[keys]), np.abs(flat_rates[keys + 1])
    height = 3.0 * longest * up * down / (up + down)
    return np.asarray(np.maximum(np.abs(flat[keys]), np.abs(flat[keys + 1])) + height)


def _beside_largest(times: Array, values: Array, rates: Array, indices: Array) -> Array:
    """Return the intervals beside the largest sample whose cubics almost turn, as keys."""
    rows, count = np.arange(len(values)), values.shape[1]
    row = np.concatenate([rows[indices > 0], rows[indices < count - 1]])
    interval = np.concatenate([indices[indices > 0] - 1, indices[indices < count - 1]])
    begin, end = (row, interval), (row, interval + 1)
    mean_of_ends = (rates[begin] + rates[end]) / 2
    # The rate of the cubic in the middle of the interval.
    h = _times_at(times, *end) - _times_at(times, *begin)
    middle = 1.5 * (values[end] - values[begin]) / h - mean_of_ends / 2
    turns = middle * np.sign(mean_of_ends) < MIN_MIDDLE_RATE * np.abs(mean_of_ends)
    return np.asarray((row * count + interval)[turns])


def _interpolated(  # noqa: PLR0913, PLR0917 (samples and nodes)
    times: Array, values: Array, rates: Array, row: Array, interval: Array, nodes: int = NODES
) -> tuple[Array, Array, Array]:
    """Return the times and values of turning points, and the estimates of their errors."""
    if not len(row):
        # Short signals often have none, and some hundred calls on empty arrays take time.
        nothing = np.zeros(0)
        return nothing, nothing, nothing
    begin, end = _times_at(times, row, interval), _times_at(times, row, interval + 1)
    slopes = rates[row, np.array([interval, interval + 1])]
    if values.shape[1] < NODES:
        cubic = _table(times, values, rates, row, interval, 2).through(0, 2)
        t, value, _ = _turn(cubic, begin, end, slopes)
        return t, value, np.full(len(t), np.inf)
    best, error = _best_polynomials(times, values, rates, row, interval, nodes)
    t, value, remainder = _turn(best, begin, end, slopes)
    error = error + remainder
    return t, value, np.where(np.isfinite(value) & np.isfinite(error), error, np.inf)


def _table(  # noqa: PLR0913, PLR0917 (samples and nodes)
    times: Array, values: Array, rates: Array, row: Array, first: Array, nodes: int
) -> HermiteTable:
    """Return the divided differences of some samples of each row, from the first one."""
    chosen = first + np.arange(nodes)[:, np.newaxis]
    return hermite_table(_times_at(times, row, chosen), values[row, chosen], rates[row, chosen])


def _best_polynomials(  # noqa: PLR0913, PLR0917 (samples and nodes)
    times: Array, values: Array, rates: Array, row: Array, interval: Array, nodes: int
) -> tuple[HermitePolynomials, Array]:
    """Return the polynomials through some samples around intervals, and their estimated errors."""
    count = values.shape[1]
    # As many samples before as after each interval; beside the ends, the nearest samples.
    first = np.clip(interval - (nodes // 2 - 1), 0, count - nodes)
    table = _table(times, values, rates, row, first, nodes)
    best = table.through(0, nodes)
    # The interpolants differ most in the middle of the interval.
    middle = (_times_at(times, row, interval) + _times_at(times, row, interval + 1)) / 2
    exact = best.values_at(middle)

    def error_through(fewer: int) -> Array:
        """Return the largest error of the polynomials through fewer samples around the interval."""
        runs = [table.through(offset, fewer) for offset in range(nodes - fewer + 1)]
        errors = [np.abs(run.values_at(middle) - exact) for run in runs]
        before = (fewer - 1) // 2
        # An odd number of samples has one more before the interval, or one more after it.
        starts = [interval - before, interval - before + fewer % 2]
        chosen = [np.clip(start, 0, count - fewer) - first for start in starts[: 1 + fewer % 2]]
        return np.max([np.choose(offsets, errors) for offsets in chosen], axis=0)

    estimates, lower = ESTIMATES[nodes]
    estimate = np.max([error_through(fewer) for fewer in estimates], axis=0)
    error_of_lower = error_through(lower)
    # Of a resolved motion, a higher degree has a much smaller error.
    error = np.where(
        estimate <= CONVERGING * error_of_lower,
        estimate,
        UNRESOLVED * (error_of_lower + estimate),
    )
    return best, error


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
