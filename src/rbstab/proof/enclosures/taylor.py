"""Taylor coefficients of compiled expressions over many boxes at once, in intervals.

A result is `Intervals` of shape (coefficients, boxes), with proved bounds. Boxes of no width give
them at points.
"""

from collections.abc import Callable, Sequence

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.compiled import (
    Compiled,
    Exponents,
    Operation,
    Sum,
    Table,
    derivatives,
)
from rbstab.proof.enclosures.intervals import Intervals, met, outward, product
from rbstab.proof.enclosures.univariate import coefficients
from rbstab.proof.exact.expr import INNER, OF, POSITIVE, STEP

Leaf = Callable[[int], Intervals]
"""A function that returns a variable over the boxes: its value and its slopes."""

ROUNDING = 2.0**-52

PIECES = 8
"""Into so many pieces the interval of the argument of an outlined expression is cut."""


class Values:
    """The coefficients of all operations of some expressions over some boxes.

    Args:
        compiled: The expressions.
        leaf: The variables over the boxes.
        about: The coefficients at the centres of the boxes. Then arguments of functions are
            bounded by Taylor's theorem too, which is far sharper than their terms.
        reach: The radii of the Taylor variables, shape (n, boxes); with `about`.
        known: The same for other values of the variables `moving` alone.
    """

    def __init__(
        self,
        compiled: Compiled,
        leaf: Leaf,
        about: "Values | None" = None,
        reach: Array | None = None,
        known: "Values | None" = None,
    ) -> None:
        self.compiled, self.values = compiled, list[Intervals]()
        powers: dict[Exponents, Array] = {}
        with np.errstate(all="ignore"):
            for k, one in enumerate(compiled.operations):
                if known is not None and k not in compiled.above_moving:
                    self.values.append(known.values[k])
                    continue
                if one.kind == "variable":
                    found = leaf(one.detail)
                else:
                    found = _DO[one.kind](compiled, one, [self.values[p] for p in one.places])
                if about is not None and reach is not None and k in compiled.tightened:
                    found = self._tighter(k, found, about, reach, powers)
                self.values.append(found)

    def _tighter(
        self, k: int, over: Intervals, about: "Values", reach: Array, powers: dict[Exponents, Array]
    ) -> Intervals:
        """Bound the coefficients over the boxes by those at the centres (Taylor's theorem).

        f_α(m + h) = Σ C(β, α) f_β h^(β - α), where f_β is taken over the box for the highest |β|.
        """
        compiled, at = self.compiled, about.values[k]
        spread = np.zeros(np.broadcast_shapes(over.lo.shape, at.lo.shape))
        inner, outer = at.mag, over.mag
        for i, terms in enumerate(compiled.expanded(k)):
            for j, top, factor, b in terms:
                if b not in powers:
                    powers[b] = np.prod([reach[n] ** p for n, p in enumerate(b) if p], axis=0)
                spread[i] += factor * (outer if top else inner)[j] * powers[b]
        spread *= 1 + 1e-12
        if k in compiled.above_positive:  # there are no derivatives at the centre of some
            spread[:, ~about.smooth] = np.inf
        found = outward(at.lo - spread, at.hi + spread)
        # Of the highest order only `over` says more.
        top_rows = compiled.orders[compiled.operations[k].support] == compiled.order
        found.lo[top_rows], found.hi[top_rows] = -np.inf, np.inf
        return met(over, found)

    @property
    def smooth(self) -> Array:
        """Whether each expression of the kind `POSITIVE` is above zero, shape (boxes,)."""
        above = [self.values[k].lo[0] > 0 for k in self.compiled.positive]
        return np.asarray(np.all(np.broadcast_arrays(*above), axis=0))

    def dense(self, number: int, boxes: int) -> Intervals:
        """Return all coefficients of a result, shape (coefficients, boxes)."""
        k = self.compiled.results[number]
        low = np.zeros((len(self.compiled.exponents), boxes))
        high = low.copy()
        support = self.compiled.operations[k].support
        low[support], high[support] = self.values[k].lo, self.values[k].hi
        return Intervals(low, high)

    def derivatives(self, number: int, boxes: int) -> Intervals:
        """Return the derivatives α! f_α; third ones are rounded by an ulp that does not count."""
        found = self.dense(number, boxes)
        factors = derivatives(self.compiled.n, self.compiled.order).factors
        return Intervals(found.lo * factors, found.hi * factors)


def variables_over(variables: Sequence[int], lo: Array, hi: Array) -> Leaf:
    """Return variables between lo and hi, both of shape (variables, boxes), with slopes of 1."""
    one = np.ones(lo.shape[1])

    def leaf(v: int) -> Intervals:
        i = variables.index(v)
        return Intervals(np.stack([lo[i], one]), np.stack([hi[i], one]))

    return leaf


def _outlined(compiled: Compiled, x: Intervals) -> list[Intervals]:
    """Bound F^(k)(x)/k! of an expression of the variable `INNER`, over pieces of intervals."""
    pieces = 1 if np.array_equal(x.lo, x.hi) else PIECES
    edges = x.lo + (x.hi - x.lo) * np.linspace(0.0, 1.0, pieces + 1)[:, None]
    edges[0], edges[-1] = x.lo, x.hi
    edges = np.maximum.accumulate(np.minimum(edges, x.hi))
    lo, hi = edges[:-1].reshape(1, -1), edges[1:].reshape(1, -1)
    middle = 0.5 * lo + 0.5 * hi
    at = Values(compiled, variables_over((INNER,), middle, middle))
    reach = np.nextafter(np.maximum(hi - middle, middle - lo), np.inf)
    over = Values(compiled, variables_over((INNER,), lo, hi), at, reach).dense(0, lo.size)
    shape = (-1, pieces, len(x.lo))
    low, high = over.lo.reshape(shape).min(axis=1), over.hi.reshape(shape).max(axis=1)
    return [Intervals(a, b) for a, b in zip(low, high, strict=True)]


def _times(table: Table, x: Intervals, y: Intervals, *, squares: bool = False) -> Intervals:
    """Return the product of two series; `squares` says that both are the same."""
    p = product(x[table.left], y[table.right])
    if squares:
        same = table.left == table.right
        p.lo[same] = np.maximum(p.lo[same], 0.0)
    if len(table.begins) == len(table.left):
        return p
    low = np.add.reduceat(p.lo, table.begins, axis=0)
    return outward(low, np.add.reduceat(p.hi, table.begins, axis=0), ROUNDING)


def _number(_: Compiled, one: Operation, __: list[Intervals]) -> Intervals:
    return Intervals(one.detail.lo.reshape(1, 1), one.detail.hi.reshape(1, 1))


def _sum(_: Compiled, one: Operation, given: list[Intervals]) -> Intervals:
    """Return c0 + Σ c x; the error of a sum of n numbers is at most n ulps of Σ |c x|."""
    detail: Sum = one.detail
    shape = (len(one.support), max(x.lo.shape[1] for x in given))
    low, high, below, above = (np.zeros(shape) for _ in range(4))
    for c, x, rows in zip(detail.factors, given, detail.rows, strict=True):
        ends = (x.lo, x.hi) if c is None else (c * x.lo, c * x.hi)[:: 1 if c > 0 else -1]
        low[rows] += ends[0]
        high[rows] += ends[1]
        below[rows] += np.abs(ends[0])
        above[rows] += np.abs(ends[1])
    ulps = (len(given) + 4) * ROUNDING  # the numbers c, their products, and Σ |c x| are rounded
    low -= ulps * below
    high += ulps * above
    if detail.c0 is not None:
        low[0] += detail.c0.lo
        high[0] += detail.c0.hi
    found = outward(low, high, 2 * ROUNDING)
    if detail.bounds is not None:
        found.lo[0] = np.maximum(found.lo[0], detail.bounds[0])
        found.hi[0] = np.minimum(found.hi[0], detail.bounds[1])
    return found


def _product(_: Compiled, one: Operation, given: list[Intervals]) -> Intervals:
    return _times(one.detail, *given)


def _positive(_: Compiled, __: Operation, given: list[Intervals]) -> Intervals:
    """Return x where it is positive, else 0: used only where a step of x is a factor."""
    (x,) = given
    low, high = x.lo.copy(), x.hi.copy()
    low[0], high[0] = np.maximum(low[0], 0.0), np.maximum(high[0], 0.0)
    return Intervals(low, high)


def _step(_: Compiled, one: Operation, given: list[Intervals]) -> Intervals:
    """Return 1, 0, or [0, 1] where it is not known."""
    (x,) = given
    low, high = (x.lo[:1] > 0).astype(float), (x.hi[:1] > 0).astype(float)
    unknown = np.repeat(np.where(low < high, np.inf, 0.0), len(one.support) - 1, axis=0)
    return Intervals(np.concatenate([low, -unknown]), np.concatenate([high, unknown]))


def _function(compiled: Compiled, one: Operation, given: list[Intervals]) -> Intervals:
    """Return Σ g_k u^k, where u is x without its value, and g_k is the k-th coefficient of g."""
    x, detail = given[0], one.detail
    least = None if detail.atom is None else compiled.least.get(detail.atom)
    if detail.kind == OF:
        g = _outlined(detail.extra, x[0])
    else:
        g = coefficients(detail.kind, detail.extra, x[0], compiled.order, least)
    low = np.zeros((len(one.support), x.lo.shape[1]))
    high = low.copy()
    low[0], high[0] = g[0].lo, g[0].hi
    u = p = x[1:]
    for k, rows in enumerate(detail.rows, start=1):
        if k > 1:
            p = _times(detail.tables[k - 2], p, u, squares=k == 2)
        term = product(g[k][None], p)
        low[rows] += term.lo
        high[rows] += term.hi
    found = outward(low, high, 2 * ROUNDING)
    found.lo[0], found.hi[0] = g[0].lo, g[0].hi  # exactly: 1/cos θ then has a bound at its pole
    return found


_DO: dict[str, Callable[[Compiled, Operation, list[Intervals]], Intervals]] = {
    "number": _number,
    "sum": _sum,
    "product": _product,
    "function": _function,
    POSITIVE: _positive,
    STEP: _step,
}
