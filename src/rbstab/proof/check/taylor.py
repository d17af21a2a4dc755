"""An energy as a list of operations, and its Taylor coefficients in balls.

A series has the coefficients f_α = ∂^α f/α! for |α| up to 3, by the number of α. One that is not
there is zero at all points, also where others have no bound.
"""

from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from itertools import product
from typing import Any

from flint import arb, fmpq

from rbstab.proof.check.findings import RefusedError, TooLongError

Ball = Any
"""An `arb` of python-flint, which has no types."""

Series = dict[int, Ball]

ORDER = 3

FUNCTIONS = frozenset({"sin", "cos", "exp", "sqrt", "log", "atan"})

MOST_OPERATIONS = 5000
MOST_POWER = 64

EVALUATIONS = 400_000
"""Evaluations of an energy after which the check ends."""

UNKNOWN = arb("nan")
"""A ball that is compared with nothing: the coefficient has no bound."""


class Rows:
    """The numbers of the multi-indices α of some variables, lower orders first.

    Args:
        n: The number of variables.
        order: The highest order. Rows of a lower order have the same numbers.
    """

    def __init__(self, n: int, order: int = ORDER) -> None:
        rows = [a for a in product(range(order + 1), repeat=n) if sum(a) <= order]
        self.order, self.rows = order, sorted(rows, key=lambda a: (sum(a), a))
        place = {a: k for k, a in enumerate(self.rows)}
        unit = [tuple(int(i == j) for j in range(n)) for i in range(n)]
        self.first = [place[u] for u in unit]

        def plus(*rows: tuple[int, ...]) -> tuple[int, ...]:
            return tuple(map(sum, zip(*rows, strict=True)))

        def factor(a: tuple[int, ...]) -> int:
            return 6 if max(a) == 3 else 2 if max(a) == 2 else 1

        # The product of two coefficients belongs to the sum of their multi-indices.
        self.sums = [
            {j: place[s] for j, b in enumerate(self.rows) if (s := plus(a, b)) in place}
            for a in self.rows
        ]
        pairs = [[plus(a, b) for b in unit] for a in unit]
        self.second = [[(place[a], factor(a)) for a in row] for row in pairs]
        self.third = (
            []
            if order < ORDER
            else [
                [[(place[plus(a, b)], factor(plus(a, b))) for b in unit] for a in row]
                for row in pairs
            ]
        )

    def times(self, x: Series, y: Series) -> Series:
        """Return the product of two series."""
        found: Series = {}
        for i, v in x.items():
            sums = self.sums[i]
            for j, w in y.items():
                k = sums.get(j)
                if k is not None:
                    p = v * w
                    found[k] = found[k] + p if k in found else p
        return found

    def through(self, g: Sequence[Ball], x: Series) -> Series:
        """Return g(x), from the Taylor coefficients of g at the value of x."""
        u = {k: v for k, v in x.items() if k}
        found, power = {0: g[0]}, u
        for k in range(1, self.order + 1):
            for i, v in power.items():
                found[i] = found[i] + g[k] * v if i in found else g[k] * v
            if k < self.order:
                power = self.times(power, u)
        return found


rows_of = cache(Rows)


def coefficients(kind: str, v: Ball, power: int = 0) -> list[Ball]:
    """Return g(v), g'(v), g''(v)/2 and g'''(v)/6 of a function."""
    if kind in ("sin", "cos"):
        s, c = v.sin_cos()
        return [s, c, -s / 2, -c / 6] if kind == "sin" else [c, -s, -c / 2, s / 6]
    if kind == "exp":
        e = v.exp()
        return [e, e, e / 2, e / 6]
    if kind == "sqrt":
        r = v.sqrt()
        return [r, 1 / (2 * r), -1 / (8 * r * v), 1 / (16 * r * v * v)]
    if kind == "log":
        return [v.log(), 1 / v, -1 / (2 * v * v), 1 / (3 * v * v * v)]
    if kind == "atan":
        d = 1 / (1 + v * v)
        return [v.atan(), d, -v * d * d, (3 * v * v - 1) * d * d * d / 3]
    assert kind == "pow"
    found, c = list[Ball](), fmpq(1)
    for k in range(ORDER + 1):
        found.append(arb(c) * whole_power(v, power - k) if c else arb(0))
        c = c * (power - k) / (k + 1)
    return found


def whole_power(v: Ball, n: int) -> Ball:
    """Return a whole power of a ball; an even one is not negative."""
    if n < 0:
        return 1 / whole_power(v, -n)
    if n < 2:
        return v if n else arb(1)
    if n % 2:
        return v * whole_power(v, n - 1)
    half = whole_power(v, n // 2)
    square = half * half
    if square > 0:
        return square
    return arb(square.abs_upper() / 2, square.abs_upper() / 2)


class Energy:
    """An energy, as a list of operations.

    Args:
        operations: The operations; their form is that of the module `record`.
        variables: The numbers of its variables.

    Raises:
        RefusedError: They are no list of operations on these variables.
    """

    def __init__(
        self, operations: Sequence[Sequence[Any]], variables: Sequence[int] = (0, 1, 2)
    ) -> None:
        self.operations = [_checked(k, one, variables) for k, one in enumerate(operations)]
        if not 0 < len(self.operations) <= MOST_OPERATIONS:
            raise RefusedError("the energy has no operations, or too many")
        self.variables, self.n = tuple(variables), len(variables)
        self._prepare()

    def __call__(self, leaves: Mapping[int, Series], order: int = ORDER) -> Series:
        """Return its series up to an order, for those of its variables."""
        return self.all_series(leaves, order)[-1]

    def all_series(self, leaves: Mapping[int, Series], order: int = ORDER) -> list[Series]:
        """Return the series of all operations."""
        rows = self.rows if order == ORDER else rows_of(self.n, order)
        self.count += 1
        if self.count > EVALUATIONS:
            raise TooLongError("the check takes too long")
        found = list[Series]()
        for number, (kind, *rest) in enumerate(self.operations):
            if kind == "var":
                x = leaves[rest[0]]
            elif kind == "sum":
                x = self._sum(*self._sums[number], found)
            elif kind == "times":
                x = rows.times(found[rest[0]], found[rest[1]])
            elif kind == "step":
                x = self._step(rows, rest[0], found[rest[1]])
            elif kind == "positive":
                x = self._positive(found[rest[0]])
            else:
                of = found[rest[-1]]
                g = coefficients(kind, of.get(0, arb(0)), rest[0] if kind == "pow" else 0)
                x = rows.through(g, of)
            found.append(x)
        return found

    @staticmethod
    def _sum(c0: Ball, terms: Sequence[tuple[Ball, int]], found: Sequence[Series]) -> Series:
        total: Series = {} if c0 == 0 else {0: c0}
        for c, k in terms:
            for i, v in found[k].items():
                total[i] = total[i] + c * v if i in total else c * v
        return total

    @staticmethod
    def _step(rows: Rows, smooth: int, x: Series) -> Series:
        """Return 0 or 1. Where it is not known, derivatives that do not exist have no bound."""
        v = x.get(0, arb(0))
        if v > 0:
            return {0: arb(1)}
        if v <= 0:
            return {}
        touched = {i for row in x for i, p in enumerate(rows.rows[row]) if p}
        found = {0: arb(0.5, 0.5)}
        for k, row in enumerate(rows.rows):
            if sum(row) > smooth and all(i in touched for i, p in enumerate(row) if p):
                found[k] = UNKNOWN
        return found

    @staticmethod
    def _positive(x: Series) -> Series:
        """Return x where it may be positive: it stands beside a step of x (`switches`)."""
        v = x.get(0, arb(0))
        if v <= 0:
            return {}
        return x if v > 0 else {**x, 0: arb(v.upper() / 2, v.upper() / 2)}

    def with_operations(
        self, operations: Sequence[Any], variables: Sequence[int] | None = None
    ) -> "Energy":
        """Return an energy with other operations, made from those of this one."""
        found = object.__new__(Energy)
        found.operations = list(operations)
        found.variables = self.variables if variables is None else tuple(variables)
        found.n = len(found.variables)
        found._prepare()
        return found

    def _prepare(self) -> None:
        self.last: Sequence[Ball] = ()  # where a minimiser was found
        self.rows, self.count = rows_of(self.n), 0
        self._sums = {
            k: (arb(one[1]), [(arb(c), j) for c, j in one[2]])
            for k, one in enumerate(self.operations)
            if one[0] == "sum"
        }

    @property
    def free(self) -> tuple[int, ...]:
        """The numbers of its variables besides Θ."""
        return self.variables[3:]

    # -- what its operations are about ----------------------------------------------------------

    @cached_property
    def depends(self) -> list[frozenset[int]]:
        """The numbers of the variables on which each operation depends."""
        found = list[frozenset[int]]()
        for one in self.operations:
            own = frozenset({one[1]}) if one[0] == "var" else frozenset[int]()
            found.append(own.union(*(found[k] for k in operands(one))))
        return found

    @property
    def steps(self) -> list[int]:
        """The operations that are steps."""
        return [k for k, one in enumerate(self.operations) if one[0] == "step"]


def operands(operation: Sequence[Any]) -> list[int]:
    """Return the numbers of the operations whose results one takes."""
    kind, *rest = operation
    if kind == "sum":
        return [k for _, k in rest[1]]
    return [] if kind == "var" else list(rest) if kind == "times" else [rest[-1]]


def _checked(number: int, operation: Sequence[Any], variables: Sequence[int]) -> tuple[Any, ...]:
    """Return an operation with exact numbers; refuse what is none."""
    try:
        kind, *rest = operation
        if kind == "sum":
            terms = tuple(zip(map(rational, rest[1::2]), rest[2::2], strict=True))
            found: tuple[Any, ...] = ("sum", rational(rest[0]), terms)
        elif kind == "var":
            (name,) = rest
            found = ("var", name)
            if type(name) is not int or name not in variables:
                raise ValueError
        elif kind in ("times", "pow", "step"):
            one, other = rest
            found = (kind, one, other)
            if type(one) is not int or abs(one) > (number if kind == "times" else MOST_POWER):
                raise ValueError
            if kind == "step" and one not in (1, 2, 3):
                raise ValueError
        else:
            (of,) = rest
            found = (kind, of)
            if kind not in FUNCTIONS and kind != "positive":
                raise ValueError
        if not all(type(k) is int and 0 <= k < number for k in operands(found)):
            raise ValueError
    except (TypeError, ValueError, ZeroDivisionError) as error:
        raise RefusedError(f"operation {number + 1} of the energy cannot be read") from error
    return found


def rational(text: Any) -> Any:
    """Return the exact number of a text such as "-3/8".

    Raises:
        ValueError: It is none.
    """
    if not isinstance(text, str):
        raise ValueError(f"{text!r} is no rational number")
    above, _, below = text.partition("/")
    return fmpq(int(above), int(below or "1"))
