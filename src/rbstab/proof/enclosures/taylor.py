"""Taylor coefficients of compiled expressions over many boxes at once, or at many points.

A result is an array of shape (coefficients, 2, boxes) with proved bounds (`intervals`); or of shape
(coefficients, 1, points), in doubles: to round-off, without bounds. Newton's method and searches of
small values use these; what is proved afterwards does not depend on them.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.compiled import (
    Compiled,
    Exponents,
    Function,
    Operation,
    Sum,
    Table,
    derivatives,
)
from rbstab.proof.enclosures.intervals import SIGNS, UNBOUNDED, outward, product
from rbstab.proof.enclosures.univariate import coefficients
from rbstab.proof.exact.atoms import INNER, OF, POSITIVE, STEP
from rbstab.proof.exact.expr import Expr

Variables = Mapping[int, Array]
"""Each variable over the boxes: its value and its slopes, shape (1 + slopes, 2 or 1, boxes)."""

ROUNDING = 2.0**-52

PIECES = 8
"""Into so many pieces the interval of the argument of an outlined expression is cut."""


class Values:
    """The coefficients of all operations of some expressions over some boxes.

    Args:
        compiled: The expressions.
        variables: The variables over the boxes.
        about: The coefficients at the centres of the boxes. Then arguments of functions are
            bounded by Taylor's theorem too, which is far sharper than their terms.
        reach: The radii of the Taylor variables, shape (n, boxes); with `about`.
    """

    def __init__(
        self,
        compiled: Compiled,
        variables: Variables,
        about: "Values | None" = None,
        reach: Array | None = None,
    ) -> None:
        self.compiled, self.values = compiled, list[Array]()
        self.shape = next(iter(variables.values())).shape[1:]
        powers: dict[Exponents, Array] = {}
        with np.errstate(all="ignore"):
            for k, operation in enumerate(compiled.operations):
                if operation.kind == "variable":
                    value = variables[operation.detail]
                else:
                    value = _DO[operation.kind](
                        self, operation, *(self.values[p] for p in operation.places)
                    )
                if about is not None and reach is not None and k in compiled.tightened:
                    value = self._tighter(k, value, about, reach, powers)
                self.values.append(value)

    def _tighter(
        self, k: int, over: Array, about: "Values", reach: Array, powers: dict[Exponents, Array]
    ) -> Array:
        """Bound the coefficients over the boxes by those at the centres (Taylor's theorem)."""
        compiled, at = self.compiled, about.values[k]
        inner, outer = np.abs(at).max(axis=1), np.abs(over).max(axis=1)
        # A function of a number, as on the face of a stop, has one column for all boxes.
        spread = np.zeros(np.broadcast_shapes(outer.shape, inner.shape, about.smooth.shape))
        # f_α(m + h) = Σ C(β, α) f_β h^(β - α), where f_β is taken over the box for the highest |β|.
        for i, terms in enumerate(compiled.expanded(k)):
            for j, top, factor, b in terms:
                if b not in powers:
                    powers[b] = np.prod([reach[n] ** p for n, p in enumerate(b) if p], axis=0)
                spread[i] += factor * (outer if top else inner)[j] * powers[b]
        spread *= 1 + 1e-12
        spread[:, ~about.smooth] = np.inf  # there are no derivatives at the centre of some
        # Of the highest order only `over` says more.
        spread[compiled.orders[compiled.operations[k].support] == compiled.order] = np.inf
        tighter = outward(at + SIGNS * spread[:, None])
        tighter[:, 0] = np.fmax(tighter[:, 0], over[:, 0])
        tighter[:, 1] = np.fmin(tighter[:, 1], over[:, 1])
        return tighter

    @cached_property
    def smooth(self) -> Array:
        """Whether each expression of the kind `POSITIVE` is above zero, shape (boxes,)."""
        both = zip(self.compiled.operations, self.values, strict=True)
        above = [value[0, 0] > 0 for operation, value in both if operation.kind == POSITIVE]
        return np.asarray(np.all(above or np.ones((1, self.shape[1]), dtype=bool), axis=0))

    def coefficients(self, number: int) -> Array:
        """Return all coefficients of a result, shape (coefficients, 2 or 1, boxes)."""
        k = self.compiled.results[number]
        full = np.zeros((len(self.compiled.exponents), *self.shape))
        full[self.compiled.operations[k].support] = self.values[k]
        return full

    def derivatives(self, number: int) -> Array:
        """Return the derivatives α! f_α; third ones are rounded by an ulp that does not count."""
        factors = derivatives(self.compiled.n, self.compiled.order).factors
        return np.asarray(self.coefficients(number) * factors)


def unit_slopes(numbers: Sequence[int], x: Array) -> dict[int, Array]:
    """Return variables over boxes or at points x, (variables, 2 or 1, boxes), with slopes of 1."""
    unity = np.ones(x.shape[1:])
    return {v: np.stack([row, unity]) for v, row in zip(numbers, x, strict=True)}


def values_at(e: Expr, q: Array) -> Array:
    """Return an expression at points q of all its variables, shape (variables, points)."""
    at = Values(Compiled([e], 0, {}, 0), dict(enumerate(q[:, None, None])))
    return at.coefficients(0)[0, 0]


def value_at(e: Expr, q: Array) -> float:
    """Return an expression at one point q of all its variables."""
    return float(values_at(e, q[:, None])[0])


def _number(values: Values, operation: Operation) -> Array:
    number: Array = operation.detail[None, : values.shape[0]]
    return number


def _sum(values: Values, operation: Operation, *given: Array) -> Array:
    """Return c0 + Σ c x; the error of a sum of n numbers is at most n ulps of Σ |c x|."""
    detail: Sum = operation.detail
    total = np.zeros((len(operation.support), values.shape[0], max(x.shape[2] for x in given)))
    size = np.zeros_like(total)
    for c, x, rows in zip(detail.factors, given, detail.rows, strict=True):
        term = x if c is None else c * x if c > 0 else c * x[:, ::-1]
        total[rows] += term
        size[rows] += np.abs(term)
    if values.shape[0] == 2:  # the numbers c, their products, and Σ |c x| are rounded
        total += SIGNS * (size * ((len(given) + 4) * ROUNDING))
    if detail.c0 is not None:
        total[0] += detail.c0[: values.shape[0]]
    return outward(total, 2 * ROUNDING)


def _times(table: Table, x: Array, y: Array, *, squares: bool = False) -> Array:
    """Return the product of two series; `squares` says that both are the same."""
    p = product(x[table.left], y[table.right])
    if squares:
        same = table.left == table.right
        p[same] = np.maximum(p[same], 0.0)
    if len(table.begins) == len(table.left):
        return p
    return outward(np.add.reduceat(p, table.begins, axis=0), ROUNDING)


def _product(_: Values, operation: Operation, x: Array, y: Array) -> Array:
    return _times(operation.detail, x, y)


def _positive(_: Values, __: Operation, x: Array) -> Array:
    """Return x where it is positive, else 0: used only where a step of x is a factor."""
    return np.concatenate([np.maximum(x[:1], 0.0), x[1:]])


def _step(_: Values, operation: Operation, x: Array) -> Array:
    """Return 1, 0, or [0, 1] where it is not known: then there is no bound on its rows."""
    value = (x[:1] > 0).astype(float)
    unknown = np.where(value[:, :1] < value[:, -1:], UNBOUNDED[: len(x[0])], 0.0)
    return np.concatenate([value, *[unknown] * (len(operation.support) - 1)])


def _function(values: Values, operation: Operation, x: Array) -> Array:
    """Return Σ g_k u^k, where u is x without its value, and g_k is the k-th coefficient of g."""
    detail: Function = operation.detail
    g = _coefficients(detail, x[0], values.compiled.order)
    composed = np.zeros((len(operation.support), *x.shape[1:]))
    u = p = x[1:]
    for k, rows in enumerate(detail.rows, start=1):
        if k > 1:
            p = _times(detail.tables[k - 2], p, u, squares=k == 2)
        composed[rows] += product(g[k], p)
    composed = outward(composed, 2 * ROUNDING)
    composed[0] = g[0]  # exactly: 1/cos θ then has a bound at its pole
    return composed


def _coefficients(function: Function, x: Array, order: int) -> list[Array]:
    """Return g^(k)(x)/k! for k up to an order, each of the shape of x."""
    if function.kind == OF:
        return list(_outlined(function.extra, x))
    least = function.least if len(x) == 2 else None
    return coefficients(function.kind, function.extra, x, order, least)


def _outlined(compiled: Compiled, x: Array) -> Array:
    """Bound F^(k)(x)/k! of an expression of the variable `INNER`, over pieces of intervals."""
    if len(x) == 1 or np.array_equal(*x):
        return Values(compiled, unit_slopes((INNER,), x[None])).coefficients(0)
    edges = x[0] + (x[1] - x[0]) * np.linspace(0.0, 1.0, PIECES + 1)[:, None]
    edges[0], edges[-1] = x
    edges = np.maximum.accumulate(np.minimum(edges, x[1]))
    lo, hi = edges[:-1].reshape(1, -1), edges[1:].reshape(1, -1)
    middle = 0.5 * lo + 0.5 * hi
    at = Values(compiled, unit_slopes((INNER,), np.stack([middle, middle], 1)))
    reach = np.nextafter(np.maximum(hi - middle, middle - lo), np.inf)
    over = Values(compiled, unit_slopes((INNER,), np.stack([lo, hi], 1)), at, reach)
    by_piece = over.coefficients(0).reshape(-1, 2, PIECES, x.shape[1])
    return np.stack([by_piece[:, 0].min(axis=1), by_piece[:, 1].max(axis=1)], 1)


_DO: dict[str, Callable[..., Array]] = {
    "number": _number,
    "sum": _sum,
    "product": _product,
    "function": _function,
    POSITIVE: _positive,
    STEP: _step,
}
