"""Taylor coefficients of expressions over many boxes at once, in intervals.

An expression is compiled once into a list of operations. Each knows which coefficients of its
result can be different from zero (sin θ1 has 4 of the 20 of order 3), and which pairs of
coefficients a product needs. A result is `Intervals` of shape (coefficients, boxes). The same code
gives values at points (boxes of no width), Newton steps (their middles), and proved bounds.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cache
from itertools import product as all_pairs
from math import comb, prod
from typing import Any, NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.intervals import Intervals, constant, met, outward, product
from rbstab.proof.enclosures.univariate import coefficients
from rbstab.proof.exact.expr import (
    COS,
    INNER,
    LET,
    OF,
    POSITIVE,
    SIN,
    STEP,
    VAR,
    Atom,
    Expr,
    monomial,
)

Leaf = Callable[[int], Intervals]
"""A function that returns a variable over the boxes: its value and its slopes."""

Exponents = tuple[int, ...]

ROUNDING = 2.0**-52

SMALLEST = Fraction(1, 2**1000)
"""Doubles above it have a relative error of an ulp."""


@cache
def exponents(n: int, order: int) -> tuple[list[Exponents], dict[Exponents, int]]:
    """Return all multi-indices of n variables up to an order, lower first; and their places."""
    rows = [a for a in all_pairs(range(order + 1), repeat=n) if sum(a) <= order]
    rows.sort(key=lambda a: (sum(a), tuple(-x for x in a)))
    return rows, {a: k for k, a in enumerate(rows)}


class Table(NamedTuple):
    """The pairs of coefficients whose products are summed for each coefficient of a product.

    Attributes:
        rows: The coefficients of the product, as places in `exponents`.
        left: For each pair the place among the coefficients of the first factor.
        right: The same of the second factor.
        begins: Where the pairs of each coefficient begin.
    """

    rows: list[int]
    left: Array
    right: Array
    begins: Array

    def of(self, x: Intervals, y: Intervals, *, squares: bool = False) -> Intervals:
        """Return the product of two series; `squares` says that both are the same."""
        p = product(x[self.left], y[self.right])
        if squares:
            same = self.left == self.right
            p.lo[same] = np.maximum(p.lo[same], 0.0)
        if len(self.begins) == len(self.left):
            return p
        low = np.add.reduceat(p.lo, self.begins, axis=0)
        return outward(low, np.add.reduceat(p.hi, self.begins, axis=0), ROUNDING)


class Operation(NamedTuple):
    """One operation of a compiled expression.

    Attributes:
        kind: "variable", "number", "sum", "product", "function", `STEP` or `POSITIVE`.
        places: The operations whose results it takes.
        support: Its coefficients that can be different from zero, as places in `exponents`.
        detail: What else it needs; see the functions of `_DO`.
    """

    kind: str
    places: tuple[int, ...]
    support: Array
    detail: Any


class Sum(NamedTuple):
    """A sum c0 + Σ c x: c0, doubles near each c (None: 1), where each x goes; its bounds."""

    c0: Intervals | None
    factors: tuple[float | None, ...]
    rows: tuple[Array | slice, ...]
    bounds: tuple[float, float] | None


class Function(NamedTuple):
    """A function g(x): its kind and a number; the rows of x, and the tables of its powers."""

    kind: str
    extra: Any
    atom: Atom | None
    inner: Array
    tables: tuple[Table, ...]
    rows: tuple[Array, ...]


class Compiled:
    """Expressions compiled for some Taylor variables up to an order.

    Args:
        results: The expressions.
        n: The number of Taylor variables.
        leaves: For each variable of the expressions the Taylor variables on which it depends.
        order: The highest order of a coefficient.
        least: Known lower bounds of atoms, such as 0 of cos θ2 where |θ2| <= π/2.
        moving: Variables of which several values are taken for the same values of the others.
    """

    def __init__(  # noqa: PLR0913, PLR0917 (what is known when it is compiled)
        self,
        results: Sequence[Expr],
        n: int,
        leaves: Mapping[int, Sequence[int]],
        order: int,
        least: Mapping[Atom, float] | None = None,
        moving: Sequence[int] = (),
    ) -> None:
        self.n, self.order, self.leaves, self.least = n, order, leaves, least or {}
        self.exponents, self.place = exponents(n, order)
        self.operations: list[Operation] = []
        self._known: dict[Any, int] = {}
        self._expansions: dict[int, list[list[tuple[int, bool, float, Exponents]]]] = {}
        self.results = [self._expression(e) for e in results]
        self.tightened = self._arguments()
        self.positive = [k for k, one in enumerate(self.operations) if one.kind == POSITIVE]
        self.above_positive = self._above(self.positive)
        moved = (k for k, one in enumerate(self.operations) if one.kind == "variable")
        self.above_moving = self._above([k for k in moved if self.operations[k].detail in moving])

    def _arguments(self) -> frozenset[int]:
        """Return the arguments of functions but sines, which Taylor's theorem makes sharper."""
        found = set[int]()
        for one in self.operations:
            if one.kind in {STEP, POSITIVE} or (
                one.kind == "function" and one.detail.kind not in {SIN, COS}
            ):
                found.add(one.places[0])
        plain = {
            k
            for k, one in enumerate(self.operations)
            if one.kind in {"variable", "number"}
            or (one.kind == "function" and one.detail.kind in {SIN, COS})
        }
        return frozenset(found - plain)  # 1/cos θ and the like need no more

    def _above(self, places: Sequence[int]) -> frozenset[int]:
        """Return the operations that depend on some others, with these."""
        found = set(places)
        for k, one in enumerate(self.operations):
            if found.intersection(one.places):
                found.add(k)
        return frozenset(found)

    # -- compilation ---------------------------------------------------------------------------

    def _add(
        self, key: Any, kind: str, places: Sequence[int], support: Sequence[int], detail: Any
    ) -> int:
        if key not in self._known:
            self._known[key] = len(self.operations)
            entries = np.array(support, dtype=int)
            self.operations.append(Operation(kind, tuple(places), entries, detail))
        return self._known[key]

    def _support(self, k: int) -> list[int]:
        return [int(row) for row in self.operations[k].support]

    def _expression(self, e: Expr) -> int:
        """Add an expression by Horner's scheme: take out the atom that most monomials share."""
        key = ("expression", e.digest)
        if key in self._known:
            return self._known[key]
        parts, left = list[tuple[Fraction, int]](), dict(e.terms)
        c0 = left.pop((), Fraction(0))
        while (shared := _shared(left)) is not None:
            a, sign = shared
            inner = {}
            for m in [m for m in left if dict(m).get(a, 0) * sign > 0]:
                powers = dict(m)
                powers[a] -= sign
                inner[monomial(powers.items())] = left.pop(m)
            factor = self._power(a, sign)
            parts.append((Fraction(1), self._product(factor, self._expression(Expr(inner)))))
        for m, c in left.items():
            places = [self._power(a, p) for a, p in m]
            found = places[0]
            for other in places[1:]:
                found = self._product(found, other)
            # As a double, a smaller number may be far from c.
            small = abs(c) < SMALLEST
            parts.append(
                (Fraction(1), self._product(found, self._number(c))) if small else (c, found)
            )
        if not parts:
            node = self._number(c0)
        elif not c0 and len(parts) == 1 and parts[0][0] == 1:
            node = parts[0][1]
        else:
            node = self._sum(e, c0, parts)
        self._known[key] = node
        return node

    def _number(self, c: Fraction) -> int:
        return self._add(("number", c), "number", (), [0], constant(c))

    def _sum(self, e: Expr, c0: Fraction, parts: Sequence[tuple[Fraction, int]]) -> int:
        support = sorted({0}.union(*(self._support(k) for _, k in parts)))
        index = {row: i for i, row in enumerate(support)}
        detail = Sum(
            constant(c0) if c0 else None,
            tuple(None if c == 1 else float(c) for c, _ in parts),
            tuple(_rows([index[row] for row in self._support(k)], len(support)) for _, k in parts),
            _bounds_of_sum(e),
        )
        return self._add(("sum", e.digest), "sum", [k for _, k in parts], support, detail)

    def _power(self, a: Atom, p: int) -> int:
        base = self._atom(a)
        return base if p == 1 else self._function("power", p, None, base)

    def _atom(self, a: Atom) -> int:
        key = ("atom", a)
        if key in self._known:
            return self._known[key]
        if a.kind == VAR:
            assert isinstance(a.argument, int)
            places = [self.place[_unit(i, self.n)] for i in self.leaves.get(a.argument, ())]
            return self._add(key, "variable", (), [0, *places], a.argument)
        x = self._expression(a.inner)
        if a.kind == LET:
            node = x
        elif a.kind == POSITIVE:
            node = self._add(key, POSITIVE, [x], self._support(x), None)
        elif a.kind == STEP:
            node = self._step(key, a, x)
        else:
            node = self._function(a.kind, a.extra, a, x)
        self._known[key] = node
        return node

    def _step(self, key: Any, a: Atom, x: int) -> int:
        """Add a step: where its value is not known, rows of a higher order have no bound."""
        assert a.extra is not None
        touched = {i for row in self._support(x) for i, p in enumerate(self.exponents[row]) if p}
        above = [
            k
            for k, row in enumerate(self.exponents)
            if sum(row) > a.extra and all(i in touched for i, p in enumerate(row) if p)
        ]
        return self._add(key, STEP, [x], [0, *above], None)

    def _function(self, kind: str, extra: Any, a: Atom | None, x: int) -> int:
        if kind == OF:
            extra = Outlined(extra, self.order)
        key = ("function", kind, a if kind == OF else extra, x)
        inner = [row for row in self._support(x) if row]
        support, tables, rows = {0, *inner}, list[Table](), inner
        for _ in range(2, self.order + 1):  # u², u³ where u is x without its value
            table = self._table(rows, inner)
            if not table.rows:
                break
            tables.append(table)
            rows = table.rows
            support |= set(rows)
        ordered = sorted(support)
        index = {row: i for i, row in enumerate(ordered)}

        def places(of: Sequence[int]) -> Array:
            return np.array([index[row] for row in of], dtype=int)

        detail = Function(
            kind, extra, a, places(inner), tuple(tables), tuple(places(t.rows) for t in tables)
        )
        return self._add(key, "function", [x], ordered, detail)

    def _table(self, left: Sequence[int], right: Sequence[int]) -> Table:
        found: dict[int, list[tuple[int, int]]] = {}
        for i, a in enumerate(left):
            for j, b in enumerate(right):
                row = tuple(
                    x + y for x, y in zip(self.exponents[a], self.exponents[b], strict=True)
                )
                if sum(row) <= self.order:
                    found.setdefault(self.place[row], []).append((i, j))
        rows = sorted(found)
        pairs = [pair for row in rows for pair in found[row]]
        begins = np.cumsum([0, *(len(found[row]) for row in rows)])[:-1]
        one, two = np.array(pairs, dtype=int).reshape(-1, 2).T
        return Table(rows, one, two, begins.astype(int))

    def _product(self, one: int, two: int) -> int:
        if one == two:
            return self._function("power", 2, None, one)
        one, two = sorted((one, two))
        table = self._table(self._support(one), self._support(two))
        return self._add(("product", one, two), "product", [one, two], table.rows, table)

    # -- evaluation ----------------------------------------------------------------------------

    def __call__(
        self,
        leaf: Leaf,
        about: "Values | None" = None,
        reach: Array | None = None,
        known: "Values | None" = None,
    ) -> "Values":
        """Return the coefficients of all operations over some boxes.

        Args:
            leaf: The variables over the boxes.
            about: The coefficients at the centres of the boxes. Then arguments of functions are
                bounded by Taylor's theorem too, which is far sharper than their terms.
            reach: The radii of the Taylor variables, shape (n, boxes); with `about`.
            known: The same for other values of the variables `moving` alone.
        """
        values: list[Intervals] = []
        powers: dict[Exponents, Array] = {}
        with np.errstate(all="ignore"):
            for k, one in enumerate(self.operations):
                if known is not None and k not in self.above_moving:
                    values.append(known.values[k])
                    continue
                found = _DO[one.kind](self, one, [values[p] for p in one.places], leaf)
                if about is not None and reach is not None and k in self.tightened:
                    some = about.smooth if k in self.above_positive else None
                    found = self._tighter(k, found, about.values[k], reach, powers, some)
                values.append(found)
        return Values(self, values)

    def _tighter(  # noqa: PLR0913, PLR0917 (what `__call__` knows)
        self,
        k: int,
        over: Intervals,
        at: Intervals,
        reach: Array,
        powers: dict[Exponents, Array],
        some: Array | None,
    ) -> Intervals:
        """Bound the coefficients over the boxes by those at the centres (Taylor's theorem).

        f_α(m + h) = Σ C(β, α) f_β h^(β - α), where f_β is taken over the box for the highest |β|.
        """
        spread = np.zeros(np.broadcast_shapes(over.lo.shape, at.lo.shape))
        inner, outer = at.mag, over.mag
        for i, terms in enumerate(self._expanded(k)):
            for j, top, factor, b in terms:
                if b not in powers:
                    powers[b] = np.prod([reach[n] ** p for n, p in enumerate(b) if p], axis=0)
                spread[i] += factor * (outer if top else inner)[j] * powers[b]
        spread *= 1 + 1e-12
        if some is not None:  # there are no derivatives at the centre of the others
            spread[:, ~some] = np.inf
        found = outward(at.lo - spread, at.hi + spread)
        top_rows = np.array([sum(self.exponents[row]) for row in self._support(k)]) == self.order
        found.lo[top_rows], found.hi[top_rows] = -np.inf, np.inf  # only `over` says more of these
        return met(over, found)

    def _expanded(self, k: int) -> list[list[tuple[int, bool, float, Exponents]]]:
        """Return for each coefficient of an operation which others give it, and how."""
        if k not in self._expansions:
            rows = [self.exponents[row] for row in self._support(k)]
            plan = []
            for a in rows:
                terms = []
                for j, b in enumerate(rows):
                    h = tuple(y - x for x, y in zip(a, b, strict=True))
                    if min(h) >= 0 and sum(h) > 0:
                        factor = prod(comb(y, x) for x, y in zip(a, b, strict=True))
                        terms.append((j, sum(b) == self.order, float(factor), h))
                plan.append(terms)
            self._expansions[k] = plan
        return self._expansions[k]


PIECES = 8
"""Into so many pieces the interval of the argument of an outlined expression is cut."""


class Outlined:
    """An expression of one variable, whose coefficients are bounded over pieces of an interval.

    Args:
        F: The expression of the variable `INNER`.
        order: The highest order of a coefficient.
    """

    def __init__(self, F: Expr, order: int) -> None:
        self.compiled = Compiled([F], 1, {INNER: (0,)}, max(order, 1))

    def coefficients(self, x: Intervals) -> list[Intervals]:
        """Return bounds on F^(k)(x)/k! for k up to the order, for intervals of shape (boxes,)."""
        pieces = 1 if np.array_equal(x.lo, x.hi) else PIECES
        with np.errstate(all="ignore"):
            edges = x.lo + (x.hi - x.lo) * np.linspace(0.0, 1.0, pieces + 1)[:, None]
            edges[0], edges[-1] = x.lo, x.hi
            edges = np.maximum.accumulate(np.minimum(edges, x.hi))
        lo, hi = edges[:-1].ravel(), edges[1:].ravel()
        middle = 0.5 * lo + 0.5 * hi
        at = self.compiled(_variable_at(middle, middle))
        reach = np.nextafter(np.maximum(hi - middle, middle - lo), np.inf)[None]
        over = self.compiled(_variable_at(lo, hi), at, reach).dense(0, len(lo))
        shape = (-1, pieces, len(x.lo))
        low, high = over.lo.reshape(shape).min(axis=1), over.hi.reshape(shape).max(axis=1)
        return [Intervals(a, b) for a, b in zip(low, high, strict=True)]


def _variable_at(lo: Array, hi: Array) -> Leaf:
    one = np.ones_like(lo)
    return lambda _: Intervals(np.stack([lo, one]), np.stack([hi, one]))


class Values(NamedTuple):
    """The coefficients of all operations of some expressions over some boxes."""

    compiled: Compiled
    values: list[Intervals]

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


def _shared(terms: Mapping[Any, Fraction]) -> tuple[Atom, int] | None:
    """Return the atom, with the sign of its power, that most monomials share; None if none do.

    Steps come last: where they are known, A³(step - step·step') is then exactly zero.
    """
    counts = Counter((a, 1 if p > 0 else -1) for m in terms for a, p in m)
    found = [one for one, count in counts.items() if count > 1]
    return min(
        found,
        key=lambda one: (one[0].kind == STEP, -counts[one], one[0].order, one[1]),
        default=None,
    )


def _bounds_of_sum(e: Expr) -> tuple[float, float] | None:
    """Bound a sum of a number and of sines and cosines with numbers, such as 1 + cos θ."""
    c0, size = Fraction(0), Fraction(0)
    for m, c in e.terms.items():
        if not m:
            c0 = c
        elif len(m) == 1 and m[0][1] > 0 and m[0][0].kind in {SIN, COS}:
            size += abs(c)
        else:
            return None
    low, high = constant(c0 - size), constant(c0 + size)
    return float(low.lo), float(high.hi)


def _rows(places: list[int], count: int) -> Array | slice:
    """Return the places as an index, which is faster if it is of all rows."""
    return slice(None) if len(places) == count else np.array(places)


def _unit(i: int, n: int) -> Exponents:
    return tuple(int(i == j) for j in range(n))


def _variable(_: Compiled, one: Operation, __: list[Intervals], leaf: Leaf) -> Intervals:
    return leaf(one.detail)


def _number(_: Compiled, one: Operation, __: list[Intervals], ___: Leaf) -> Intervals:
    return Intervals(one.detail.lo.reshape(1, 1), one.detail.hi.reshape(1, 1))


def _sum(_: Compiled, one: Operation, given: list[Intervals], __: Leaf) -> Intervals:
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


def _product(_: Compiled, one: Operation, given: list[Intervals], __: Leaf) -> Intervals:
    table: Table = one.detail
    return table.of(*given)


def _positive(_: Compiled, __: Operation, given: list[Intervals], ___: Leaf) -> Intervals:
    """Return x where it is positive, else 0: used only where a step of x is a factor."""
    (x,) = given
    low, high = x.lo.copy(), x.hi.copy()
    low[0], high[0] = np.maximum(low[0], 0.0), np.maximum(high[0], 0.0)
    return Intervals(low, high)


def _step(_: Compiled, one: Operation, given: list[Intervals], __: Leaf) -> Intervals:
    """Return 1, 0, or [0, 1] where it is not known."""
    (x,) = given
    low, high = (x.lo[:1] > 0).astype(float), (x.hi[:1] > 0).astype(float)
    unknown = np.repeat(np.where(low < high, np.inf, 0.0), len(one.support) - 1, axis=0)
    return Intervals(np.concatenate([low, -unknown]), np.concatenate([high, unknown]))


def _function(compiled: Compiled, one: Operation, given: list[Intervals], _: Leaf) -> Intervals:
    """Return Σ g_k u^k, where u is x without its value, and g_k is the k-th coefficient of g."""
    (x,), detail = given, one.detail
    least = None if detail.atom is None else compiled.least.get(detail.atom)
    if detail.kind == OF:
        g = detail.extra.coefficients(x[0])
    else:
        g = coefficients(detail.kind, detail.extra, x[0], compiled.order, least)
    low = np.zeros((len(one.support), x.lo.shape[1]))
    high = low.copy()
    low[0], high[0] = g[0].lo, g[0].hi
    if len(detail.inner):
        u = x[1:]
        first = product(g[1][None], u)
        low[detail.inner] += first.lo
        high[detail.inner] += first.hi
        p = u
        for k, (table, rows) in enumerate(zip(detail.tables, detail.rows, strict=True), start=2):
            p = table.of(p, u, squares=k == 2)
            term = product(g[k][None], p)
            low[rows] += term.lo
            high[rows] += term.hi
    found = outward(low, high, 2 * ROUNDING)
    found.lo[0], found.hi[0] = g[0].lo, g[0].hi  # exactly: 1/cos θ then has a bound at its pole
    return found


_DO: dict[str, Callable[[Compiled, Operation, list[Intervals], Leaf], Intervals]] = {
    "variable": _variable,
    "number": _number,
    "sum": _sum,
    "product": _product,
    "function": _function,
    POSITIVE: _positive,
    STEP: _step,
}
