"""An energy as a list of operations, each of which is checked as it is read."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from flint import arb, fmpq

from rbstab.proof.check.findings import RefusedError, TooLongError
from rbstab.proof.check.taylor import (
    ORDER,
    UNKNOWN,
    Ball,
    Rows,
    Series,
    coefficients,
    narrower,
    rows_of,
)

FUNCTIONS = frozenset({"sin", "cos", "exp", "sqrt", "log", "atan"})

MOST_OPERATIONS = 5000
MOST_POWER = 64

EVALUATIONS = 400_000
"""Evaluations of an energy after which the check ends."""

ANGLES = (0, 1, 2)

Operation = tuple[Any, ...]


class Energy:
    """An energy, as a list of operations.

    Args:
        operations: The operations, with exact numbers.
        variables: The numbers of its variables.
    """

    def __init__(self, operations: Sequence[Operation], variables: Sequence[int] = ANGLES) -> None:
        self.operations, self.variables = list(operations), tuple(variables)
        self.n = len(self.variables)
        self.last: Sequence[Ball] = ()  # where a minimiser was found
        self.rows, self.count = rows_of(self.n), 0
        self._sums = {
            k: (arb(one[1]), [(arb(c), j) for c, j in one[2]])
            for k, one in enumerate(self.operations)
            if one[0] == "sum"
        }

    def __call__(
        self,
        leaves: Sequence[Series],
        order: int = ORDER,
        about: tuple[Sequence[Series], Sequence[Ball]] | None = None,
    ) -> list[Series]:
        """Return the series of all operations; the last one is that of the energy.

        Args:
            leaves: Those of its variables.
            order: The highest order.
            about: All series at the middle of a box, and the ways δ from there. Then arguments of
                functions are bounded by Taylor's theorem too.
        """
        rows = rows_of(self.n, order)
        self.count += 1
        if self.count > EVALUATIONS:
            raise TooLongError("the check takes too long")
        found = list[Series]()
        for number, (kind, *rest) in enumerate(self.operations):
            if kind == "var":
                x = leaves[self.variables.index(rest[0])]
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
            if about is not None and number in self.arguments:
                x = {**x, 0: narrower(x.get(0, arb(0)), rows.value(x, about[0][number], about[1]))}
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

    # -- what its operations are about ----------------------------------------------------------

    @property
    def free(self) -> tuple[int, ...]:
        """The numbers of its variables besides Θ."""
        return self.variables[3:]

    @property
    def terms(self) -> Sequence[tuple[Any, int]]:
        """The factors and operations of the last sum."""
        kind, *rest = self.operations[-1]
        if kind != "sum":
            raise RefusedError("the energy is no sum")
        terms: Sequence[tuple[Any, int]] = rest[1]
        return terms

    def with_terms(self, terms: Sequence[tuple[Any, int]]) -> "Energy":
        """Return another sum of the same operations."""
        last = ("sum", fmpq(0), tuple(terms))
        return Energy([*self.operations[:-1], last], self.variables)

    @cached_property
    def arguments(self) -> frozenset[int]:
        """The arguments of functions, but for variables and what depends on one angle alone."""
        kinds = FUNCTIONS | {"step", "pow"}
        found = {one[-1] for one in self.operations if one[0] in kinds}
        cut = list[bool]()  # a positive part is another function on both sides of its surface
        for one in self.operations:
            cut.append(one[0] == "positive" or any(cut[k] for k in operands(one)))
        return frozenset(k for k in found if len(self.depends[k]) > 1 and not cut[k])

    @cached_property
    def depends(self) -> list[frozenset[int]]:
        """The numbers of the variables on which each operation depends."""
        found = list[frozenset[int]]()
        for one in self.operations:
            own = frozenset({one[1]}) if one[0] == "var" else frozenset[int]()
            found.append(own.union(*(found[k] for k in operands(one))))
        return found

    @cached_property
    def steps(self) -> list[int]:
        """The operations that are steps."""
        return [k for k, one in enumerate(self.operations) if one[0] == "step"]

    @cached_property
    def products(self) -> list[tuple[int, ...] | None]:
        """For each operation the places of one or two variables whose product it is, or None."""
        found = list[tuple[int, ...] | None]()
        for one in self.operations:
            factors: tuple[int, ...] = ()
            match one:
                case "var", number:
                    factors = (self.variables.index(number),)
                case ("times", i, j) | ("pow", 2, i as j):
                    first, second = found[i], found[j]
                    factors = first + second if first and second else ()
            found.append(factors if 0 < len(factors) < 3 else None)
        return found


def operands(operation: Operation) -> list[int]:
    """Return the numbers of the operations whose results one takes."""
    kind, *rest = operation
    if kind == "sum":
        return [k for _, k in rest[1]]
    return [] if kind == "var" else list(rest) if kind == "times" else [rest[-1]]


def read_energy(operations: Sequence[Any], free: Sequence[Any] = ()) -> Energy:
    """Return the energy of a record.

    Args:
        operations: The operations; their form is that of the module `record`.
        free: The numbers of the variables besides Θ.

    Raises:
        RefusedError: They are no list of operations on these variables.
    """
    if not all(type(k) is int and k > 2 for k in free) or len(set(free)) < len(free):
        raise RefusedError("the variables besides Θ are not numbered")
    if not 0 < len(operations) <= MOST_OPERATIONS:
        raise RefusedError("the energy has no operations, or too many")
    variables = (*ANGLES, *free)
    return Energy([_checked(k, one, variables) for k, one in enumerate(operations)], variables)


def _checked(number: int, operation: Any, variables: Sequence[int]) -> Operation:
    """Return an operation with exact numbers; refuse what is none."""
    found: Operation = ()
    try:
        match operation:
            case "sum", c0, *rest:
                terms = zip(map(rational, rest[::2]), rest[1::2], strict=True)
                found = ("sum", rational(c0), tuple(terms))
            case ("var", int(n)) if n in variables:
                found = ("var", n)
            case ("times", int(), int()) | ("step", 1 | 2 | 3, int()):
                found = tuple(operation)
            case ("pow", int(n), int()) if abs(n) <= MOST_POWER:
                found = tuple(operation)
            case (str(kind), int()) if kind in FUNCTIONS | {"positive"}:
                found = tuple(operation)
        if not (found and all(type(k) is int and 0 <= k < number for k in operands(found))):
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
