"""Expressions compiled into operations on Taylor coefficients of several variables.

Each operation knows which coefficients of its result can be different from zero (sin θ1 has 4 of
the 20 of order 3), and which pairs of coefficients a product needs. `taylor` evaluates them in
intervals over boxes, or in doubles at points.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache
from itertools import combinations_with_replacement
from math import comb, factorial, prod
from typing import Any, NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.intervals import constant
from rbstab.proof.exact.atoms import COS, INNER, LET, OF, POSITIVE, SIN, STEP, VAR, Atom, monomial
from rbstab.proof.exact.expr import Expr

Exponents = tuple[int, ...]

SMALLEST = Fraction(1, 2**1000)
"""Doubles above it have a relative error of an ulp."""


@cache
def exponents(n: int, order: int) -> tuple[list[Exponents], dict[Exponents, int]]:
    """Return all multi-indices of n variables up to an order, lower first; and their places."""
    numbers = range(n)
    rows = [
        tuple(map(factors.count, numbers))
        for degree in range(order + 1)
        for factors in combinations_with_replacement(numbers, degree)
    ]
    return rows, {a: k for k, a in enumerate(rows)}


class Derivatives(NamedTuple):
    """Where derivatives are among the coefficients ∂^α f/α! of n variables.

    Attributes:
        first: The places of the first derivatives, shape (n,).
        second: Those of the second, shape (n, n).
        third: Those of the third, shape (n, n, n); empty for coefficients of a lower order.
        factors: α! of all coefficients, shape (coefficients, 1, 1).
    """

    first: Array
    second: Array
    third: Array
    factors: Array


@cache
def derivatives(n: int, order: int) -> Derivatives:
    """Return where derivatives are among coefficients up to an order of at least 2."""
    rows, place = exponents(n, order)
    unit = np.eye(n, dtype=int)
    second = unit[:, None] + unit

    def places(a: Array) -> Array:
        shape = a.shape[:-1]
        indices = [place[tuple(row)] for row in a.reshape(prod(shape), n).tolist()]
        return np.array(indices, dtype=int).reshape(shape)

    third = unit[:, None, None] + second if order > 2 else np.zeros((0, 0, 0, n), dtype=int)
    factors = np.array([float(prod(map(factorial, row))) for row in rows])[:, None, None]
    return Derivatives(places(unit), places(second), places(third), factors)


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


class Operation(NamedTuple):
    """One operation of a compiled expression.

    Attributes:
        kind: "variable", "number", "sum", "product", "function", `STEP` or `POSITIVE`.
        places: The operations whose results it takes.
        support: Its coefficients that can be different from zero, as places in `exponents`.
        detail: What else it needs: a `Sum`, a `Table`, a `Function`, or a number.
    """

    kind: str
    places: tuple[int, ...]
    support: Array
    detail: Any


Term = tuple[int, bool, float, Exponents]
"""A coefficient, whether its order is the highest, a factor, and the powers of the steps."""


class Sum(NamedTuple):
    """A sum c0 + Σ c x: c0, doubles near each c (None: 1), and where each x goes."""

    c0: Array | None
    factors: tuple[float | None, ...]
    rows: tuple[Array | slice, ...]


class Function(NamedTuple):
    """A function g(x): its kind, a number and its bound; where the powers of x go, their tables.

    For `OF` the number is the expression of one variable, compiled. With u for x without its value,
    the k-th of `rows` has the places of u^k, and the k-th of `tables` gives u^(k + 1) from it.
    """

    kind: str
    extra: Any
    least: float | None
    rows: tuple[Array, ...]
    tables: tuple[Table, ...]


class Compiled:
    """Expressions compiled for some Taylor variables up to an order.

    Args:
        results: The expressions.
        n: The number of Taylor variables.
        leaves: For each variable of the expressions the Taylor variables on which it depends.
        order: The highest order of a coefficient.
        least: Known lower bounds of atoms, such as 0 of cos θ2 where |θ2| <= π/2.
    """

    def __init__(
        self,
        results: Sequence[Expr],
        n: int,
        leaves: Mapping[int, Sequence[int]],
        order: int,
        least: Mapping[Atom, float] | None = None,
    ) -> None:
        self.n, self.order, self.leaves, self.least = n, order, leaves, least or {}
        self.exponents, self.place = exponents(n, order)
        self.orders = np.array([sum(row) for row in self.exponents])
        self.operations: list[Operation] = []
        self._nodes: dict[Any, int] = {}
        self._expansions: dict[int, list[list[Term]]] = {}
        self.results = [self._expression(e) for e in results]
        self.tightened = self._arguments()

    def _arguments(self) -> frozenset[int]:
        """Return the arguments of functions but sines, which Taylor's theorem makes sharper."""
        kinds = {STEP, POSITIVE, "function"}
        of = (
            operation
            for operation in self.operations
            if operation.kind in kinds and not _is_sine(operation)
        )
        arguments = {operation.places[0]: self.operations[operation.places[0]] for operation in of}
        # 1/cos θ and the like need no more.
        plain = {"variable", "number"}
        return frozenset(
            k
            for k, operation in arguments.items()
            if not (operation.kind in plain or _is_sine(operation))
        )

    def _add(
        self, key: Any, kind: str, places: Sequence[int], support: Sequence[int], detail: Any
    ) -> int:
        if key not in self._nodes:
            self._nodes[key] = len(self.operations)
            entries = np.array(support, dtype=int)
            self.operations.append(Operation(kind, tuple(places), entries, detail))
        return self._nodes[key]

    def _support(self, k: int) -> list[int]:
        return [int(row) for row in self.operations[k].support]

    def _expression(self, e: Expr) -> int:
        """Add an expression by Horner's scheme: take out the atom that most monomials share."""
        key = ("expression", e.digest)
        if key in self._nodes:
            return self._nodes[key]
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
            term = places[0]
            for other in places[1:]:
                term = self._product(term, other)
            # As a double, a smaller number may be far from c.
            small = abs(c) < SMALLEST
            parts.append(
                (Fraction(1), self._product(term, self._number(c))) if small else (c, term)
            )
        if not parts:
            node = self._number(c0)
        elif not c0 and len(parts) == 1 and parts[0][0] == 1:
            node = parts[0][1]
        else:
            node = self._sum(e, c0, parts)
        self._nodes[key] = node
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
        )
        return self._add(("sum", e.digest), "sum", [k for _, k in parts], support, detail)

    def _power(self, a: Atom, p: int) -> int:
        base = self._atom(a)
        return base if p == 1 else self._function("power", p, None, base)

    def _atom(self, a: Atom) -> int:
        key = ("atom", a)
        if key in self._nodes:
            return self._nodes[key]
        if a.kind == VAR:
            assert isinstance(a.argument, int)
            slopes = [1 + i for i in self.leaves.get(a.argument, ())]  # these come first
            return self._add(key, "variable", (), [0, *slopes], a.argument)
        x = self._expression(a.inner)
        if a.kind == LET:
            node = x
        elif a.kind == POSITIVE:
            node = self._add(key, POSITIVE, [x], self._support(x), None)
        elif a.kind == STEP:
            node = self._step(key, a, x)
        else:
            node = self._function(a.kind, a.extra, a, x)
        self._nodes[key] = node
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
            extra = Compiled([extra], 1, {INNER: (0,)}, max(self.order, 1))
        key = ("function", kind, a if kind == OF else extra, x)
        inner = [row for row in self._support(x) if row]
        powers, tables = [inner] if inner else [], list[Table]()
        while powers and len(powers) < self.order:
            table = self._table(powers[-1], inner)
            if not table.rows:
                break
            tables.append(table)
            powers.append(table.rows)
        ordered = sorted({0}.union(*powers))
        index = {row: i for i, row in enumerate(ordered)}
        rows = tuple(np.array([index[row] for row in power], dtype=int) for power in powers)
        least = None if a is None else self.least.get(a)
        detail = Function(kind, extra, least, rows, tuple(tables))
        return self._add(key, "function", [x], ordered, detail)

    def _table(self, left: Sequence[int], right: Sequence[int]) -> Table:
        by_row: dict[int, list[tuple[int, int]]] = {}
        for i, a in enumerate(left):
            for j, b in enumerate(right):
                row = tuple(
                    x + y for x, y in zip(self.exponents[a], self.exponents[b], strict=True)
                )
                if sum(row) <= self.order:
                    by_row.setdefault(self.place[row], []).append((i, j))
        rows = sorted(by_row)
        pairs = [pair for row in rows for pair in by_row[row]]
        begins = np.cumsum([0, *(len(by_row[row]) for row in rows)])[:-1]
        first, second = np.array(pairs, dtype=int).reshape(-1, 2).T
        return Table(rows, first, second, begins.astype(int))

    def _product(self, first: int, second: int) -> int:
        if first == second:
            return self._function("power", 2, None, first)
        first, second = sorted((first, second))
        table = self._table(self._support(first), self._support(second))
        return self._add(("product", first, second), "product", [first, second], table.rows, table)

    def expanded(self, k: int) -> list[list[Term]]:
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


def _shared(terms: Mapping[Any, Fraction]) -> tuple[Atom, int] | None:
    """Return the atom, with the sign of its power, that most monomials share; None if none do."""
    counts = Counter((a, 1 if p > 0 else -1) for m in terms for a, p in m)
    shared = [factor for factor, count in counts.items() if count > 1]
    # Steps come last: where they are known, A³(step - step·step') is then exactly zero.
    return min(
        shared,
        key=lambda factor: (factor[0].kind == STEP, -counts[factor], factor[0].order, factor[1]),
        default=None,
    )


def _is_sine(operation: Operation) -> bool:
    return operation.kind == "function" and operation.detail.kind in {SIN, COS}


def _rows(places: list[int], count: int) -> Array | slice:
    """Return the places as an index, which is faster if it is of all rows."""
    return slice(None) if len(places) == count else np.array(places)
