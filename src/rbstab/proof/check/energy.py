"""An energy as a list of operations, each of which is checked as it is read."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from rbstab.proof.check.springs import Springs

FUNCTIONS = frozenset({"sin", "cos", "exp", "sqrt", "log", "atan"})

MOST_OPERATIONS = 5000
MOST_POWER = 64

EVALUATIONS = 400_000
"""Evaluations of an energy after which the check ends."""


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

    def all_series(
        self,
        leaves: Mapping[int, Series],
        order: int = ORDER,
        about: tuple[Sequence[Series], Sequence[Ball]] | None = None,
    ) -> list[Series]:
        """Return the series of all operations.

        Args:
            leaves: Those of its variables.
            order: The highest order.
            about: All series at the middle of a box, and the ways δ from there. Then arguments of
                functions are bounded by Taylor's theorem too.
        """
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
            if about is not None and number in self.arguments:
                x = {**x, 0: narrower(x.get(0, arb(0)), rows.value(x, about[0][number], about[1]))}
            found.append(x)
        return found

    @cached_property
    def arguments(self) -> frozenset[int]:
        """The arguments of functions, but for variables and what depends on one angle alone."""
        kinds = FUNCTIONS | {"step", "pow"}
        found = {one[-1] for one in self.operations if one[0] in kinds}
        cut = list[bool]()  # a positive part is another function on both sides of its surface
        for one in self.operations:
            cut.append(one[0] == "positive" or any(cut[k] for k in operands(one)))
        return frozenset(k for k in found if len(self.depends[k]) > 1 and not cut[k])

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
    def springs(self) -> "Springs":
        """Its springs, and its other terms."""
        from rbstab.proof.check.springs import springs_of  # which are about energies

        return springs_of(self)

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


def variables_of(U: Energy, k: int) -> list[int] | None:
    """Return the places of the variables of which an operation is the product, or None."""
    kind, *rest = U.operations[k]
    if kind == "var":
        return [U.variables.index(rest[0])]
    if kind == "times":
        one, other = (variables_of(U, j) for j in rest)
        return None if one is None or other is None else one + other
    if kind == "pow" and rest[0] == 2:
        one = variables_of(U, rest[1])
        return None if one is None else one * 2
    return None


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
