"""Expressions as a list of operations, each on many numbers at once.

A node is a variable, a product, or a function of one number. Between nodes stand sums with constant
factors, rational numbers that are rounded to doubles with bounds on the errors.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import groupby

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.atoms import COS, LET, SIN, VAR, Atom, Monomial
from rbstab.proof.exact.expr import Expr
from rbstab.proof.exact.rewriting import slope
from rbstab.proof.motion.rounding import UNDERFLOW, UNIT

PRODUCT, INVERSE, ROOT = "product", "inverse", "sqrt"

INTEGRALS = ("log", "atan")
"""Functions that are proved from their slopes; so their slopes are computed before them."""

BY_SLOPE = (SIN, COS, "exp", *INTEGRALS)
"""Functions that are proved from their slopes, or each from that of the other."""

Form = tuple[Fraction, tuple[tuple[int, Fraction], ...]]
"""A sum: its constant, and its nodes with their factors."""


@dataclass(frozen=True, eq=False)
class Sums:
    """Sums of nodes with constant factors, plus constants: doubles, with bounds on their errors.

    Attributes:
        places: The places of the nodes of all sums, one sum after the other, shape (terms,).
        factors: Their factors, and bounds on their errors, each of shape (terms, 1).
        begins: Where each sum begins, shape (sums,); each has a term, which may be zero.
        constants: The constants, and bounds on their errors, each of shape (sums, 1).
    """

    places: Array
    factors: tuple[Array, Array]
    begins: Array
    constants: tuple[Array, Array]

    def __len__(self) -> int:
        return len(self.begins)

    @cached_property
    def most(self) -> int:
        """The largest number of terms of a sum."""
        return int(np.diff([*self.begins, len(self.places)]).max(initial=0))


@dataclass(frozen=True, eq=False)
class Operation:
    """Nodes of one kind, none of which needs another of them.

    Attributes:
        kind: Their kind.
        nodes: Their places.
        operands: Of products both factors; of functions the argument, and the slope by it: first
            those of all nodes, then the second ones.
    """

    kind: str
    nodes: slice
    operands: Sums


@dataclass(frozen=True, eq=False)
class Program:
    """What is needed to compute some expressions, in order.

    Attributes:
        variables: The number of variables, which are the first nodes.
        operations: The operations.
        operands: Those of all nodes but the variables, as those of an operation.
        places: The places of the nodes of each kind.
        results: The expressions.
    """

    variables: int
    operations: tuple[Operation, ...]
    operands: Sums
    places: dict[str, Array]
    results: Sums

    def __len__(self) -> int:
        return self.variables + len(self.operands) // 2

    def of_kinds(self, *kinds: str) -> Array:
        """Return the places of the nodes of some kinds, shape (nodes,)."""
        return np.concatenate([self.places.get(kind, np.zeros(0, dtype=int)) for kind in kinds])


def programs(variables: int, *groups: Iterable[Expr]) -> list[Program]:
    """Return programs of expressions of the variables from 0 on.

    Args:
        variables: The number of variables.
        groups: The results of the first program, and what each further one has beside those of the
            one before. The first nodes of a program are those of the one before.
    """
    graph, forms, stages = _Graph(variables), list[Form](), list[Program]()
    order, place = list[int](), {-1 - k: k for k in range(variables)}
    operations, places = list[Operation](), dict[str, list[int]]()

    def operands(nodes: Sequence[int]) -> Sums:
        return _sums([graph.operands[k][side] for side in (0, 1) for k in nodes], place)

    for group in groups:
        forms += map(graph.form, group)
        graph.add_slopes()
        new = sorted(range(len(order), len(graph.nodes)), key=lambda k: (*graph.nodes[k][:2], k))
        place |= {k: variables + len(order) + i for i, k in enumerate(new)}
        order += new
        for (_, kind), some in groupby(new, key=lambda k: graph.nodes[k][:2]):
            nodes = list(some)
            places.setdefault(kind, []).extend(place[k] for k in nodes)
            first = place[nodes[0]]
            operations.append(Operation(kind, slice(first, first + len(nodes)), operands(nodes)))
        by_kind = {kind: np.array(some) for kind, some in places.items()}
        results = _sums(forms, place)
        stages.append(Program(variables, tuple(operations), operands(order), by_kind, results))
    return stages


class _Graph:
    """The nodes of expressions; variable k has the number -1 - k."""

    def __init__(self, variables: int) -> None:
        self.nodes: list[tuple[int, str, Atom | None]] = []
        self.operands: list[list[Form]] = []
        self._by_operands: dict[tuple[str, tuple[Form, ...]], Form] = {}
        self._forms: dict[str, Form] = {}
        self._variables = range(variables)

    def form(self, e: Expr) -> Form:
        """Return an expression as a sum of nodes."""
        if e.digest not in self._forms:
            constant, terms = Fraction(0), dict[int, Fraction]()
            for m, c in e.terms.items():
                more, nodes = self._product(m)
                constant += c * more
                for node, factor in nodes:
                    terms[node] = terms.get(node, Fraction(0)) + c * factor
            self._forms[e.digest] = constant, tuple((k, c) for k, c in terms.items() if c)
        return self._forms[e.digest]

    def _product(self, m: Monomial) -> Form:
        factors = [form for a, p in m for form in [self._power(a, p)] * abs(p)]
        while len(factors) > 1:  # the shallowest first: so there are few levels
            factors.sort(key=self._depth)
            factors[:2] = [self._node(PRODUCT, factors[:2])]
        return factors[0] if factors else (Fraction(1), ())

    def _power(self, a: Atom, p: int) -> Form:
        """Return an atom or its inverse."""
        if a.kind == VAR:
            assert isinstance(a.argument, int)
            assert a.argument in self._variables
            form: Form = Fraction(0), ((-1 - a.argument, Fraction(1)),)
        elif a.kind == LET:
            form = self.form(a.inner)
        else:
            x = self.form(a.inner)
            slopes = [self._slope_of_integral(a.kind, x)] if a.kind in INTEGRALS else []
            form = self._node(a.kind, [x, *slopes], a)
        return form if p > 0 else self._node(INVERSE, [form])

    def _slope_of_integral(self, kind: str, x: Form) -> Form:
        """Return the slope of log or atan, of x itself: its bound then holds for what x misses."""
        if kind == "log":
            return self._node(INVERSE, [x])
        zero, square = self._node(PRODUCT, [x, x])
        return self._node(INVERSE, [(zero + 1, square)])

    def _node(self, kind: str, operands: list[Form], a: Atom | None = None) -> Form:
        key = kind, tuple(operands)
        if key not in self._by_operands:
            self._by_operands[key] = Fraction(0), ((len(self.nodes), Fraction(1)),)
            self.nodes.append((1 + max(map(self._depth, operands)), kind, a))
            self.operands.append(operands)
        return self._by_operands[key]

    def _depth(self, form: Form) -> int:
        return max((self.nodes[node][0] for node, _ in form[1] if node >= 0), default=0)

    def add_slopes(self) -> None:
        """Add the slopes of all functions; those of roots and sines need the nodes themselves."""
        for k, (*_, a) in enumerate(self.nodes):  # the list grows meanwhile
            if len(self.operands[k]) == 1:
                if a is None:
                    y: Form = Fraction(0), ((k, Fraction(1)),)
                    zero, ((square, unity),) = self._node(PRODUCT, [y, y])
                    slope_form: Form = zero, ((square, -unity),)
                else:
                    slope_form = self.form(slope(a))
                self.operands[k] = [*self.operands[k], slope_form]


def _sums(forms: Sequence[Form], place: dict[int, int]) -> Sums:
    terms = [[(place[k], c) for k, c in some] or [(0, Fraction(0))] for _, some in forms]
    flat = [term for some in terms for term in some]
    begins = np.cumsum([0, *map(len, terms)])[:-1]
    factors, constants = _doubles([c for _, c in flat]), _doubles([c for c, _ in forms])
    return Sums(np.array([k for k, _ in flat], dtype=int), factors, begins, constants)


def _doubles(numbers: Sequence[Fraction]) -> tuple[Array, Array]:
    """Return numbers as a column of doubles, and bounds on the errors."""
    middles = np.array([float(c) for c in numbers]).reshape(-1, 1)
    exact = [Fraction(x) == c for x, c in zip(middles.ravel().tolist(), numbers, strict=True)]
    inexact = ~np.array(exact, dtype=bool).reshape(-1, 1)
    return middles, inexact * (UNIT * np.abs(middles) + UNDERFLOW)
