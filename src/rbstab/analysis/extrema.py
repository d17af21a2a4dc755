"""Extrema and last crossings of quantities along the steps of motions.

A step has values and rates at both ends. They bound what the quantity does between them, roughly:
so a few steps remain in which an extremum or a crossing may be. There the first three derivatives
at both ends give a polynomial of degree 7. Its difference from the one of degree 5, through two
derivatives, is the estimate of its error. If that is too large, the step is divided.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array

RELATIVE = 1e-5
"""A step is divided if the error of an extremum is more than this times the extremum."""

ABSOLUTE = 1e-9
"""m or rad; the same for small extrema. A smaller quantity has no extremum but round-off."""

OF_TIME = 1e-5
"""A step is divided if the error of a crossing is more than this times its time."""

REACH = 0.5
"""A quantity stays within the values that its tangents at the ends of a step reach after this part
of the step. The hull of a cubic needs a third."""

ORDERS = 4
"""A value and three derivatives."""

DIFFERENCE = 2e-4
"""Their second and third ones are differences over this part of a step."""

PARTS = 8
"""A polynomial is evaluated at the ends of this many parts of a step."""

ROOT_STEPS = 8
"""Most steps to find a root of a polynomial in one of these parts."""


Watch = Callable[[Array, Any], Array]
"""A function of states and times."""


class Steps(NamedTuple):
    """The steps of m members, one after the other, with q quantities.

    Attributes:
        first: The first step of each member, shape (m,).
        begin: The begin of each step, shape (n,), s.
        length: Shape (n,), s. A step of no length is a jump.
        table: The values and rates at both ends of the steps, shape (2, 2, q, n): by end, then by
            order.
        derivatives: Returns the second and third derivatives of quantities at both ends of steps,
            shape (2, 2, p), given the numbers of the quantities and of the steps, shape (p,) each.
        divide: Returns a step as several ones; None where it cannot be divided.
    """

    first: Array
    begin: Array
    length: Array
    table: Array
    derivatives: Callable[[Array, Array], Array]
    divide: "Callable[[int], Steps | None]" = lambda _: None

    @property
    def members(self) -> Array:
        """The member of each step, shape (n,)."""
        counts = np.diff(np.append(self.first, len(self.begin)))
        return np.repeat(np.arange(len(self.first)), counts)

    @property
    def values(self) -> Array:
        """The values at the begin and at the end of the steps, shape (2, q, n)."""
        return self.table[:, 0]

    def reach(self, sign: int = 0, rows: slice = slice(None)) -> Array:
        """Return how far from zero quantities may be in steps, shape (q, n); with a sign, how high.

        Args:
            sign: 1 for the highest value; 0 for the largest magnitude.
            rows: The quantities.
        """
        sized = np.abs if sign == 0 else np.asarray
        inner = REACH * self.length
        (begin, leaving), (end, arriving) = self.table[:, :, rows]
        farthest = np.maximum(sized(begin), sized(end))
        np.maximum(farthest, sized(begin + inner * leaving), out=farthest)
        return np.maximum(farthest, sized(end - inner * arriving), out=farthest)


def along(observe: Watch, rates: Watch, y: Array, t: Array, length: Array) -> Array:
    """Return second and third derivatives of quantities of motions at states, shape (2, q, ...).

    Args:
        observe: Returns the quantities and their rates, shape (2, q, ...), at states of shape
            (states, ...) and times of shape (...).
        rates: Returns the rates of the states.
        y: The states.
        t: The times, s.
        length: The lengths of the steps, s. Where it is 0, the derivatives have no meaning.
    """
    tau = DIFFERENCE * np.where(length > 0, length, 1e-6)
    first = rates(y, t)
    before, after = (rates(y + h * first, t + h) for h in (-tau, tau))
    second = (after - before) / (2.0 * tau)
    slope = observe(y, t)[1]
    before, after = (observe(y + h * (first + 0.5 * h * second), t + h)[1] for h in (-tau, tau))
    third = (after - 2.0 * slope + before) / (tau * tau)
    return np.array([(after - before) / (2.0 * tau), third])


def sampled_steps(times: Array, values: Array) -> Steps:
    """Return the intervals between samples as steps, of which only the ends are known.

    Args:
        times: Shape (n,), s, at least two.
        values: Shape (q, n).
    """
    table = np.zeros((2, 2, len(values), len(times) - 1))
    table[:, 0] = values[:, :-1], values[:, 1:]
    first = np.zeros(1, dtype=int)
    return Steps(
        first, times[:-1], np.diff(times), table, lambda _, step: np.zeros((2, 2, len(step)))
    )


class Extrema(NamedTuple):
    """The values of quantities farthest from zero, of shape (q, m) each.

    Attributes:
        value: With its sign.
        time: s.
        error: The estimated error of the value.
    """

    value: Array
    time: Array
    error: Array


class Crossings(NamedTuple):
    """The last times at which a quantity is at or above its level, shape (m,), and their errors, s.

    A time is 0 if the quantity is always below, and NaN if it is not below at the end.
    """

    time: Array
    error: Array


def _hermite(derivatives: int) -> Array:
    """Return the matrix from the data of a step to the coefficients of its polynomial."""
    # The data are value and derivatives by the share of the step, at its begin and then at its end;
    # the polynomial is that through so many derivatives.
    orders, terms = derivatives + 1, 2 * (derivatives + 1)
    rows = np.zeros((terms, terms))
    for order in range(orders):
        rows[order, order] = math.factorial(order)
        rows[orders + order, order:] = [math.perm(j, order) for j in range(order, terms)]
    padded = np.zeros((2 * ORDERS, 2 * ORDERS))
    used = [*range(orders), *range(ORDERS, ORDERS + orders)]
    padded[np.ix_(range(terms), used)] = np.linalg.inv(rows)
    return padded


BEST, LOWER = _hermite(3), _hermite(2)
SHARES = np.linspace(0.0, 1.0, PARTS + 1)
_POWERS = np.arange(2 * ORDERS)
AT_SHARES = np.power.outer(SHARES, _POWERS) @ BEST
SLOPES_AT_SHARES = np.power.outer(SHARES, _POWERS[:-1]) @ (_POWERS[1:, np.newaxis] * BEST[1:])


def _combined(matrix: Array, data: Array) -> Array:
    """Return a product of matrices; the bits of a column do not depend on the number of columns."""
    product = matrix[:, :1] * data[0]
    for column, row in zip(matrix.T[1:], data[1:], strict=True):
        product += column[:, np.newaxis] * row
    return np.asarray(product)


class _Polynomials(NamedTuple):
    """Polynomials on steps, p of them, with the points at which they are looked at."""

    coefficients: Array  # by the powers of the share of the step, shape (8, p)
    errors: Array  # the same of the estimates of their errors
    # The `SHARES`, and then the turning point in each part of the step, shape (points, p); -1 in a
    # part without one.
    shares: Array
    values: Array  # the values there; 0 in a part without a turning point

    @classmethod
    def of(cls, steps: Steps, quantity: Array, step: Array) -> "_Polynomials":
        """Return the polynomials of quantities on steps."""
        ends = steps.table[:, :, quantity, step], steps.derivatives(quantity, step)
        data = np.concatenate(ends, axis=1)
        for order in range(1, ORDERS):
            data[:, order:] *= steps.length[step]
        data = data.reshape(2 * ORDERS, -1)
        best, at_shares = _combined(BEST, data), _combined(AT_SHARES, data)
        slopes = _combined(SLOPES_AT_SHARES, data)
        part, number = np.nonzero((slopes[:-1] > 0) != (slopes[1:] > 0))
        turning, sign = best[:, number], np.where(slopes[part, number] > 0, 1.0, -1.0)

        def slope(s: Array) -> Array:
            return sign * np.array(_evaluated(turning, s)[1:])

        shares = np.full((len(SHARES) + PARTS, len(step)), -1.0)
        shares[: len(SHARES)] = SHARES[:, np.newaxis]
        values = np.vstack([at_shares, np.zeros((PARTS, len(step)))])
        turn = len(SHARES) + part, number
        shares[turn] = _root(SHARES[part], SHARES[part + 1], slope)
        values[turn] = _evaluated(turning, shares[turn])[0]
        return cls(best, best - _combined(LOWER, data), shares, values)

    def errors_at(self, s: Array) -> Array:
        """Return the estimated errors of the values at shares of the steps, shape (..., p)."""
        return np.abs(_evaluated(self.errors, s)[0])

    def farthest(self) -> tuple[Array, Array]:
        """Return the shares of the steps farthest from zero, and the values there."""
        best = np.abs(self.values).argmax(axis=0), np.arange(self.values.shape[1])
        return self.shares[best], self.values[best]

    def last_above(self, level: Array) -> tuple[Array, Array]:
        """Return whether each polynomial reaches its level, and the last share at which it does."""
        share = np.where(self.values >= level, self.shares, -1.0).max(axis=0)
        low = np.maximum(share, 0.0)
        high = SHARES[np.minimum(np.searchsorted(SHARES, low, side="right"), PARTS)]

        def excess(s: Array) -> tuple[Array, Array]:
            value, slope, _ = _evaluated(self.coefficients, s)
            return value - level, slope

        return share >= 0, _root(low, high, excess)

    def grazing(self, level: Array) -> Array:
        """Return whether a turning point is at the level of each polynomial within its error."""
        shares, values = self.shares[PARTS + 1 :], self.values[PARTS + 1 :]
        near = np.abs(values - level) <= self.errors_at(shares)
        return np.any(near & (shares >= 0), axis=0)


def _evaluated(coefficients: Array, s: Array) -> tuple[Array, Array, Array]:
    """Return values, first and second derivatives of polynomials at shares of steps, shape (p,)."""
    value = coefficients[-1]
    first = second = np.zeros_like(value)
    for coefficient in coefficients[-2::-1]:
        second = second * s + 2.0 * first
        first = first * s + value
        value = value * s + coefficient
    return value, first, second


def _root(low: Array, high: Array, value_and_slope: Callable[[Array], Any]) -> Array:
    """Return where values fall through zero, between shares at which they are above and below."""
    s = 0.5 * (low + high)
    for _ in range(ROOT_STEPS):
        value, slope = value_and_slope(s)
        low, high = np.where(value >= 0, s, low), np.where(value >= 0, high, s)
        step = s - value / np.where(slope != 0, slope, np.inf)
        # It is Newton's method, or bisection where that leaves the bracket.
        s = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
    return np.asarray(s)


def farthest_from_zero(steps: Steps) -> Extrema:
    """Return the extrema of all quantities of all members."""
    members = steps.members
    ends = np.abs(steps.values).max(axis=0)
    largest = np.maximum.reduceat(ends, steps.first, axis=1)
    lowest = np.maximum(largest, ABSOLUTE)[:, members]
    quantity, step = np.nonzero(steps.reach() > lowest)
    inner = _inner_extrema(steps, quantity, step, largest[quantity, members[step]])
    at_quantity, at_step = np.nonzero(ends == largest[:, members])
    begin, end = (side[at_quantity, at_step] for side in steps.values)
    is_end = np.abs(end) > np.abs(begin)
    time = steps.begin[at_step] + is_end * steps.length[at_step]
    candidates = Extrema(
        np.append(inner.value, np.where(is_end, end, begin)),
        np.append(inner.time, time),
        np.append(inner.error, np.zeros(len(time))),
    )
    group = np.append(quantity, at_quantity) * len(steps.first) + np.append(
        members[step], members[at_step]
    )
    return _chosen(candidates, group, np.arange(len(group)) >= len(quantity), largest.shape)


def _chosen(candidates: Extrema, group: Array, is_end: Array, shape: tuple[int, ...]) -> Extrema:
    """Return the extremum of each group: the first of those that are alike within their errors."""
    size = np.abs(candidates.value)
    largest, upper, error = np.zeros((3, math.prod(shape)))
    np.maximum.at(largest, group, size)
    np.maximum.at(upper, group, size + candidates.error)
    np.maximum.at(error, group, np.where(size == largest[group], candidates.error, 0.0))
    alike = size + candidates.error + error[group] >= largest[group]
    # An end of a step is the extremum only if no other point is like it.
    order = np.lexsort((candidates.time, is_end, ~alike, group))
    _, places = np.unique(group[order], return_index=True)
    chosen = order[places]
    value, time = np.full((2, len(largest)), np.nan)
    value[group[chosen]], time[group[chosen]] = candidates.value[chosen], candidates.time[chosen]
    return Extrema(*(a.reshape(shape) for a in (value, time, upper - np.abs(value))))


def _inner_extrema(steps: Steps, quantity: Array, step: Array, largest: Array) -> Extrema:
    """Return the extrema of quantities in steps, by the numbers of both; shape (p,) each."""
    polynomials = _Polynomials.of(steps, quantity, step)
    share, value = polynomials.farthest()
    error = np.where(np.isfinite(value), polynomials.errors_at(share), np.inf)
    value = np.where(np.isfinite(value), value, steps.values[0][quantity, step])
    time = steps.begin[step] + share * steps.length[step]
    # The errors are compared with the largest magnitude at the end of a step of the same member.
    vague = error > np.maximum(RELATIVE * np.maximum(np.abs(value), largest), ABSOLUTE)
    for number in np.unique(step[vague]).tolist():
        parts = steps.divide(number)
        if parts is None:
            continue
        finer = farthest_from_zero(parts)
        places = np.flatnonzero(vague & (step == number))
        for target, source in zip((value, time, error), finer, strict=True):
            target[places] = source[quantity[places], 0]
    return Extrema(value, time, error)


def last_above(steps: Steps, quantity: int, level: Array) -> Crossings:
    """Return when a quantity is at or above its level for the last time.

    Args:
        steps: The steps.
        quantity: The number of the quantity.
        level: The level of each member, shape (m,).
    """
    members, count = steps.members, len(steps.first)
    last = np.append(steps.first[1:], len(steps.begin)) - 1
    time, error = np.zeros((2, count))
    not_below = ~(steps.values[1][quantity, last] < level)
    time[not_below] = error[not_below] = np.nan
    highest = steps.reach(1, slice(quantity, quantity + 1))[0]
    candidates = np.flatnonzero((highest >= level[members]) & ~not_below[members])
    while len(candidates):
        # The last candidate of each member; those before it wait.
        final = np.append(members[candidates[1:]] != members[candidates[:-1]], [True])
        step, candidates = candidates[final], candidates[~final]
        crossings, reached = _crossings_in(steps, quantity, step, level[members[step]])
        of = members[step][reached]
        time[of], error[of] = crossings.time[reached], crossings.error[reached]
        candidates = candidates[~np.isin(members[candidates], of)]
    return Crossings(time, error)


def _crossings_in(
    steps: Steps, quantity: int, step: Array, level: Array
) -> tuple[Crossings, Array]:
    """Return the last crossing in each step, shape (p,), and whether the level is reached there."""
    polynomials = _Polynomials.of(steps, np.full(len(step), quantity), step)
    reached, share = polynomials.last_above(level)
    reached |= steps.values[0][quantity, step] >= level
    length = steps.length[step]
    slope = np.abs(_evaluated(polynomials.coefficients, share)[1])
    with np.errstate(all="ignore"):
        error = np.minimum(polynomials.errors_at(share) / slope, 1.0) * length
    error = np.where(np.isfinite(error), error, length)
    time = steps.begin[step] + share * length
    # A level that the quantity only just reaches is decided by shorter steps, too.
    vague = (error > OF_TIME * time) | polynomials.grazing(level)
    for place in np.flatnonzero(vague).tolist():
        parts = steps.divide(int(step[place]))
        if parts is None:
            continue
        finer = last_above(parts, quantity, level[place : place + 1])
        reached[place] = finer.time[0] != 0
        end_reached = np.isnan(finer.time[0])
        time[place] = steps.begin[step[place]] + length[place] if end_reached else finer.time[0]
        error[place] = 0.0 if end_reached else finer.error[0]
    return Crossings(time, error), reached
