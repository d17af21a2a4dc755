"""An energy as a list of operations, each of which is checked as it is read."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from flint import arb, arb_mat, fmpq

from rbstab.proof.check.findings import RefusedError, TooLongError
from rbstab.proof.check.taylor import (
    ORDER,
    Ball,
    Series,
    coefficients,
    constant,
    narrower,
    over_box,
    summed,
    through,
    times,
)

FUNCTIONS = frozenset({"sin", "cos", "exp", "sqrt", "log", "atan"})

MOST_OPERATIONS = 5000
MOST_POWER = 64

EVALUATIONS = 400_000
"""Evaluations of an energy after which the check ends."""

ANGLES = (0, 1, 2)

Operation = tuple[Any, ...]

About = tuple[Sequence[Series], Mapping[int, Ball]] | None
"""All series at the middle of a box, and the ways δ from there."""


class Energy:
    """An energy, as a list of operations.

    Args:
        operations: The operations, with exact numbers.
        free: The numbers of its variables besides Θ.
    """

    def __init__(self, operations: Sequence[Operation], free: Sequence[int] = ()) -> None:
        self.operations, self.free = list(operations), tuple(free)
        self.last: Mapping[int, Ball] = {}  # where a minimiser was found
        self.count = 0
        self._sums = {
            k: (arb(operation[1]), [(arb(c), j) for c, j in operation[2]])
            for k, operation in enumerate(self.operations)
            if operation[0] == "sum"
        }

    def __call__(
        self,
        leaves: Mapping[int, Series],
        order: int = ORDER,
        about: About = None,
    ) -> list[Series]:
        """Return the series of all operations; the last one is that of the energy.

        Args:
            leaves: Those of its variables, and of steps that are variables too (`share_of`).
            order: The highest order.
            about: If it is given, arguments of functions are bounded by Taylor's theorem too.
        """
        self.count += 1
        if self.count > EVALUATIONS:
            raise TooLongError("the check takes too long")
        series = list[Series]()
        for number, (kind, *rest) in enumerate(self.operations):
            match kind:
                case "var":
                    x = leaves[rest[0]]
                case "sum":
                    c0, terms = self._sums[number]
                    x = summed((c, series[k]) for c, k in terms)
                    if c0 != 0:
                        x[()] = constant(x) + c0
                case "times":
                    x = times(series[rest[0]], series[rest[1]], order)
                case "step":
                    x = leaves.get(share_of(rest[1])) or _step(series[rest[1]])
                case "positive":
                    of = series[rest[0]]
                    # Beyond a surface too, all terms beside its step are those of its one side.
                    x = of if share_of(rest[0]) in leaves else _positive(of)
                case _:
                    of = series[rest[-1]]
                    g = coefficients(kind, constant(of), rest[0] if kind == "pow" else 0)
                    x = through(g, of, order)
            if about is not None and number in self.arguments:
                x = {**x, (): narrower(constant(x), over_box(x, about[0][number], about[1]))}
            series.append(x)
        return series

    # -- what its operations are about ----------------------------------------------------------

    @property
    def terms(self) -> Sequence[tuple[Any, int]]:
        """The factors and operations of the last sum."""
        kind, *rest = self.operations[-1]
        if kind != "sum":
            raise RefusedError("the energy is no sum")
        terms: Sequence[tuple[Any, int]] = rest[1]
        return terms

    def quadratic(self, numbers: Sequence[int]) -> tuple[arb_mat, list[tuple[Any, int]]]:
        """Return K of the terms ½ x'Kx of the last sum, for some variables x, and its others."""
        K, others = arb_mat(len(numbers), len(numbers)), list[tuple[Any, int]]()
        for c, k in self.terms:
            factors = self.products[k]
            if len(factors) == 2 and set(numbers).issuperset(factors):
                i, j = map(numbers.index, factors)
                K[i, j] += arb(c)
                K[j, i] += arb(c)
            else:
                others.append((c, k))
        return K, others

    def with_terms(self, terms: Sequence[tuple[Any, int]]) -> "Energy":
        """Return another sum of the same operations, with the same constant."""
        last = ("sum", self.operations[-1][1], tuple(terms))
        return Energy([*self.operations[:-1], last], self.free)

    @cached_property
    def arguments(self) -> frozenset[int]:
        """The arguments of functions, but for what depends on one angle alone, or on steps."""
        kinds = FUNCTIONS | {"step", "pow"}
        candidates = {operation[-1] for operation in self.operations if operation[0] in kinds}
        return frozenset(
            k for k in candidates if len(self.depends[k]) > 1 and min(self.depends[k]) >= 0
        )

    @cached_property
    def depends(self) -> list[frozenset[int]]:
        """The numbers of the variables on which each operation depends, and of its steps."""
        variables = list[frozenset[int]]()
        for operation in self.operations:
            match operation:
                case "var", number:
                    direct = {number}
                case ("step", _, k) | ("positive", k):
                    direct = {share_of(k)}
                case _:
                    direct = set()
            variables.append(frozenset(direct).union(*(variables[k] for k in operands(operation))))
        return variables

    @cached_property
    def jumps(self) -> frozenset[int]:
        """The arguments of steps at which forces jump."""
        return frozenset(
            operation[2] for operation in self.operations if operation[:2] == ("step", 1)
        )

    @cached_property
    def products(self) -> list[tuple[int, ...]]:
        """For each operation the one or two variables whose product it is; none if it is none."""
        variables = list[tuple[int, ...]]()
        for operation in self.operations:
            factors: tuple[int, ...] = ()
            match operation:
                case "var", number:
                    factors = (number,)
                case ("times", i, j) | ("pow", 2, i as j) if variables[i] and variables[j]:
                    factors = variables[i] + variables[j]
            variables.append(factors if len(factors) < 3 else ())
        return variables


def share_of(argument: int) -> int:
    """Return the number of the variable that may stand for a step of an operation; or back."""
    return -1 - argument


def _step(x: Series) -> Series:
    """Return 0 or 1, or both where it is not known."""
    v = constant(x)
    if v > 0:
        return {(): arb(1)}
    return {} if v <= 0 else {(): arb(0.5, 0.5)}


def _positive(x: Series) -> Series:
    """Return x where it may be positive: it stands beside a step of x (`switches`)."""
    v = constant(x)
    if v <= 0:
        return {}
    return x if v > 0 else {**x, (): arb(v.upper() / 2, v.upper() / 2)}


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
    return Energy(
        [_checked(k, operation, variables) for k, operation in enumerate(operations)], free
    )


def _checked(number: int, operation: Any, variables: Sequence[int]) -> Operation:
    """Return an operation with exact numbers; refuse what is none."""
    exact: Operation = ()
    try:
        match operation:
            case "sum", c0, *rest:
                terms = zip(map(rational, rest[::2]), rest[1::2], strict=True)
                exact = ("sum", rational(c0), tuple(terms))
            case ("var", int(n)) if n in variables:
                exact = ("var", n)
            case ("times", int(), int()) | ("step", 1 | 2 | 3, int()):
                exact = tuple(operation)
            case ("pow", int(n), int()) if abs(n) <= MOST_POWER:
                exact = tuple(operation)
            case (str(kind), int()) if kind in FUNCTIONS | {"positive"}:
                exact = tuple(operation)
        if not (exact and all(type(k) is int and 0 <= k < number for k in operands(exact))):
            raise ValueError
    except (TypeError, ValueError, ZeroDivisionError) as error:
        raise RefusedError(f"operation {number + 1} of the energy cannot be read") from error
    return exact


def rational(text: Any) -> Any:
    """Return the exact number of a text such as "-3/8".

    Raises:
        ValueError: It is none.
    """
    if not isinstance(text, str):
        raise ValueError(f"{text!r} is no rational number")
    above, _, below = text.partition("/")
    return fmpq(int(above), int(below or "1"))
