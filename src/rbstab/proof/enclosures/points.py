"""Taylor coefficients of expressions at many points, in doubles: to round-off, without bounds.

They are those of `taylor` over boxes of no width. Newton's method and searches of small values use
them; what is proved afterwards does not depend on them.
"""

from collections.abc import Callable, Sequence
from math import factorial

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.compiled import (
    Compiled,
    Function,
    Operation,
    Sum,
    Table,
    derivatives,
)
from rbstab.proof.enclosures.intervals import Intervals
from rbstab.proof.enclosures.univariate import coefficients
from rbstab.proof.exact.expr import COS, INNER, OF, POSITIVE, SIN, STEP, Expr

Point = Callable[[int], Array]
"""A function that returns a variable at the points: its value and its slopes."""


class AtPoints:
    """The coefficients of all operations of some expressions at some points.

    Args:
        compiled: The expressions.
        point: The variables at the points.
        known: The same for other values of the variables that move alone.
    """

    def __init__(self, compiled: Compiled, point: Point, known: "AtPoints | None" = None) -> None:
        self.compiled, self.values = compiled, list[Array]()
        for k, one in enumerate(compiled.operations):
            if known is not None and k not in compiled.above_moving:
                self.values.append(known.values[k])
            elif one.kind == "variable":
                self.values.append(point(one.detail))
            else:
                given = [self.values[p] for p in one.places]
                self.values.append(_DO[one.kind](compiled, one, given))

    def dense(self, number: int, points: int) -> Array:
        """Return all coefficients of a result, shape (coefficients, points)."""
        k = self.compiled.results[number]
        found = np.zeros((len(self.compiled.exponents), points))
        found[self.compiled.operations[k].support] = self.values[k]
        return found

    def derivatives(self, number: int, points: int) -> Array:
        """Return the derivatives α! f_α."""
        factors = derivatives(self.compiled.n, self.compiled.order).factors
        return np.asarray(self.dense(number, points) * factors)


def variables_at(variables: Sequence[int], x: Array) -> Point:
    """Return variables at points x, shape (variables, points), with slopes of 1."""
    one = np.ones(x.shape[1])
    return lambda v: np.stack([x[variables.index(v)], one])


def values_at(e: Expr, q: Array) -> Array:
    """Return an expression at points q of all its variables, shape (variables, points)."""
    with np.errstate(all="ignore"):
        at = AtPoints(Compiled([e], 0, {}, 0), lambda v: q[v][None])
    return np.asarray(at.dense(0, q.shape[1])[0])


def value_at(e: Expr, q: Array) -> float:
    """Return an expression at one point q of all its variables."""
    return float(values_at(e, q[:, None])[0])


def _number(_: Compiled, one: Operation, __: list[Array]) -> Array:
    return np.asarray(one.detail.mid.reshape(1, 1))


def _sum(_: Compiled, one: Operation, given: list[Array]) -> Array:
    detail: Sum = one.detail
    found = np.zeros((len(one.support), max(x.shape[1] for x in given)))
    for c, x, rows in zip(detail.factors, given, detail.rows, strict=True):
        found[rows] += x if c is None else c * x
    if detail.c0 is not None:
        found[0] += detail.c0.lo
    return found


def _times(table: Table, x: Array, y: Array) -> Array:
    p: Array = x[table.left] * y[table.right]
    return p if len(table.begins) == len(p) else np.add.reduceat(p, table.begins, axis=0)


def _product(_: Compiled, one: Operation, given: list[Array]) -> Array:
    return _times(one.detail, *given)


def _positive(_: Compiled, __: Operation, given: list[Array]) -> Array:
    return np.concatenate([np.maximum(given[0][:1], 0.0), given[0][1:]])


def _step(_: Compiled, one: Operation, given: list[Array]) -> Array:
    found = np.zeros((len(one.support), given[0].shape[1]))
    found[0] = given[0][0] > 0
    return found


def _function(compiled: Compiled, one: Operation, given: list[Array]) -> Array:
    (x,), detail = given, one.detail
    g = _coefficients(detail, x[0], compiled.order)
    found = np.zeros((len(one.support), x.shape[1]))
    found[0] = g[0]
    u = p = x[1:]
    for k, rows in enumerate(detail.rows, start=1):
        if k > 1:
            p = _times(detail.tables[k - 2], p, u)
        found[rows] += g[k] * p
    return found


def _coefficients(function: Function, x: Array, order: int) -> list[Array]:
    """Return g^(k)(x)/k! for k up to an order."""
    if function.kind == OF:
        return list(AtPoints(function.extra, variables_at((INNER,), x[None])).dense(0, len(x)))
    if function.kind in {SIN, COS}:
        # Shifts of x by quarter turns would lose the relative accuracy of small sines.
        sine, cosine, first = np.sin(x), np.cos(x), int(function.kind == COS)
        turns = [sine, cosine, -sine, -cosine]
        return [turns[(first + k) % 4] / factorial(k) for k in range(order + 1)]
    return [one.mid for one in coefficients(function.kind, function.extra, Intervals(x, x), order)]


_DO = {
    "number": _number,
    "sum": _sum,
    "product": _product,
    "function": _function,
    POSITIVE: _positive,
    STEP: _step,
}
