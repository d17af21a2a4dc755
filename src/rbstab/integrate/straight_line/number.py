"""A kind of number that records the operations of the equations.

A trace is a list of operations in an order in which they can be computed. Equal operations are
recorded once. Operations with a known result are not recorded: x + 0, 0·x, 1·x, -(-x). As long as
all numbers are finite, this changes no bit of a result, except the sign of a zero.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, NoReturn

import numpy as np

from rbstab.mechanics.numbers import FUNCTIONS

ADD, SUBTRACT, MULTIPLY, DIVIDE = "+", "-", "*", "/"
NEGATE, POWER = "neg", "**"
INPUT, CONSTANT = "input", "constant"


class NotTraceableError(TypeError):
    """The equations do with a number what a trace cannot record, such as a comparison."""


class Operation(NamedTuple):
    """An operation of a trace.

    Attributes:
        kind: What it does, or `INPUT` or `CONSTANT`; the name of a function of one number.
        operands: The indices of its operands in the trace; the value of a constant.
        varies: Whether its result depends on an input that varies.
    """

    kind: str
    operands: tuple[Any, ...]
    varies: bool


class Trace:
    """The operations of some equations.

    Attributes:
        operations: The operations, each after its operands.
    """

    def __init__(self) -> None:
        self.operations: list[Operation] = []
        self._indices: dict[tuple[str, tuple[Any, ...]], int] = {}

    def input(self, *, varies: bool) -> "TracedNumber":
        """Add an input, and return it.

        Args:
            varies: False for a number that stays the same for many evaluations.
        """
        return TracedNumber(self, self._append(Operation(INPUT, (), varies)))

    def index_of(self, number: Any) -> int:
        """Return the index of a number of this trace, or of a constant.

        Raises:
            NotTraceableError: It is neither a real finite number nor one of this trace.
        """
        if isinstance(number, TracedNumber) and number.trace is self:
            return number.index
        if isinstance(number, int | float | np.integer) and math.isfinite(number):
            return self._recorded(CONSTANT, (float(number),), varies=False)
        raise NotTraceableError(f"a traced number cannot be combined with {number!r}")

    def record(self, kind: str, *operands: Any) -> "TracedNumber":
        """Record an operation on numbers, and return its result."""
        indices = tuple(self.index_of(operand) for operand in operands)
        if kind in (ADD, MULTIPLY):
            # Both are commutative, also in rounding.
            indices = tuple(sorted(indices))
        varies = any(self.operations[index].varies for index in indices)
        return TracedNumber(self, self._recorded(kind, indices, varies=varies))

    def _recorded(self, kind: str, operands: tuple[Any, ...], *, varies: bool) -> int:
        # A float is a key with its sign: 0.0 and -0.0 are equal.
        key = kind, tuple(map(repr, operands)) if kind == CONSTANT else operands
        index = self._indices.get(key)
        if index is None:
            index = self._indices[key] = self._append(Operation(kind, operands, varies))
        return index

    def _append(self, operation: Operation) -> int:
        self.operations.append(operation)
        return len(self.operations) - 1


class TracedNumber:
    """A number whose operations are recorded in a trace.

    It has no value. A comparison, a conversion to a float or to a bool raises an error, because the
    equations must not branch on a value.

    Args:
        trace: The trace.
        index: The index of the operation that gives this number.
    """

    __slots__ = ("index", "trace")

    def __init__(self, trace: Trace, index: int) -> None:
        self.trace, self.index = trace, index

    def __add__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented  # numpy takes over, entry by entry
        if _is(other, 0.0):
            return self
        negated = _negated(other)
        if negated is not None:
            return self.trace.record(SUBTRACT, self, negated)
        negated = _negated(self)
        if negated is not None:
            return self.trace.record(SUBTRACT, other, negated)
        return self.trace.record(ADD, self, other)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        if _is(other, 0.0):
            return self
        negated = _negated(other)
        if negated is not None:
            return self + negated
        return self.trace.record(SUBTRACT, self, other)

    def __rsub__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else -self + other

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        if _is(other, 0.0):
            return 0.0
        if _is(other, 1.0):
            return self
        if _is(other, -1.0):
            return -self
        for factor, cofactor in ((self, other), (other, self)):
            negated = _negated(factor)
            if negated is not None:
                return -(negated * cofactor)
        return self.trace.record(MULTIPLY, self, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        if _is(other, 1.0):
            return self
        negated = _negated(self)
        if negated is not None:
            return -(negated / other)
        return self.trace.record(DIVIDE, self, other)

    def __rtruediv__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        if _is(other, 0.0) and not self.trace.operations[self.index].varies:
            # A zero in the inverse of a constant matrix. Only a divisor that varies can become 0.
            return 0.0
        return self.trace.record(DIVIDE, other, self)

    def __neg__(self) -> "TracedNumber":
        negated = _negated(self)
        return negated if negated is not None else self.trace.record(NEGATE, self)

    def __pos__(self) -> "TracedNumber":
        return self

    def __pow__(self, exponent: Any) -> Any:
        if isinstance(exponent, np.ndarray):
            return NotImplemented
        if not isinstance(exponent, int | float | np.integer) or exponent != int(exponent):
            # A float of Python to the power of another one may be complex, where numpy has NaN.
            raise NotTraceableError(f"a traced number to the power of {exponent!r}")
        return self.trace.record(POWER, self, int(exponent))

    def _refuse(self, *_: Any) -> NoReturn:
        raise NotTraceableError("a traced number has no value that could be compared or converted")

    # Without these methods Python would compare identities, and take every number to be true.
    __bool__ = __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = _refuse
    __float__ = __int__ = __complex__ = __hash__ = _refuse


def _method(name: str) -> Callable[[TracedNumber], TracedNumber]:
    """Return the method of a function of one number, such as `sin`."""
    return lambda number: number.trace.record(name, number)


for _name in FUNCTIONS:
    setattr(TracedNumber, _name, _method(_name))


def _is(number: Any, value: float) -> bool:
    return isinstance(number, int | float | np.integer) and bool(number == value)


def _negated(number: Any) -> TracedNumber | None:
    """Return x if a number is recorded as -x, else None."""
    if not isinstance(number, TracedNumber):
        return None
    operation = number.trace.operations[number.index]
    if operation.kind != NEGATE:
        return None
    return TracedNumber(number.trace, operation.operands[0])
