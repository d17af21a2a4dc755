"""A program: the operations of a formula of the three angles, in an order to compute them in.

An operation is a list of its kind and its operands: ["theta", axis], ["constant", number], or a
kind and the indices of earlier operations, as in ["*", 0, 3] or ["sin", 2]. That of "**" are an
index and a whole number. A constant stands for all numbers that round to it. "square_above" is
max(x, 0)², which has a continuous slope.

A formula that depends on X or the own states too has ["length", place], an entry of x = [X, D]. One
that is stored has those of X alone, or those of the own states of one element.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

from rbstab.integrate.straight_line.number import (
    ADD,
    CONSTANT,
    DIVIDE,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
    Trace,
)
from rbstab.integrate.straight_line.number import Operation as Recorded
from rbstab.mechanics.numbers import FUNCTIONS

THETA = "theta"

LENGTH = "length"
"""The kind of an entry of x = [X, D], or of x = D if the body is held."""

SQUARE_ABOVE = "square_above"
"""max(x, 0)². No code has it: it is what a switch comes to (`switching.py`)."""

OPERATIONS = frozenset({ADD, SUBTRACT, MULTIPLY, DIVIDE, NEGATE, POWER, SQUARE_ABOVE, *FUNCTIONS})
"""The kinds that have operands."""

BINARY = frozenset({ADD, SUBTRACT, MULTIPLY, DIVIDE})

MOST_OPERATIONS = 5_000

Operation = tuple[Any, ...]


@dataclass(frozen=True)
class Program:
    """The operations of one formula; the last one is its result.

    Args:
        operations: The operations.
    """

    operations: tuple[Operation, ...]

    @property
    def of_angles(self) -> bool:
        """Whether it depends on Θ alone."""
        return all(kind != LENGTH for kind, *_ in self.operations)

    @cached_property
    def fixed(self) -> tuple[int, ...]:
        """The places of the operations whose results depend on Θ alone."""
        found = set[int]()
        for place, operation in enumerate(self.operations):
            if operation[0] != LENGTH and found.issuperset(indices_of(operation)):
                found.add(place)
        return tuple(sorted(found))

    @cached_property
    def used_by_others(self) -> frozenset[int]:
        """Those among them that the other operations need, or that are the result."""
        fixed, last = set(self.fixed), len(self.operations) - 1
        others = (one for place, one in enumerate(self.operations) if place not in fixed)
        needed = {last, *(index for one in others for index in indices_of(one))}
        return frozenset(needed & fixed)

    @property
    def periodic(self) -> bool:
        """Whether θ1 and θ3 are used in sines and cosines alone, so that whole turns do nothing."""
        turning = {
            place
            for place, operation in enumerate(self.operations)
            if operation[0] == THETA and operation[1] != 1
        }
        others = [one for one in self.operations if one[0] not in {"sin", "cos"}]
        used = {index for operation in others for index in indices_of(operation)}
        return turning.isdisjoint(used | {len(self.operations) - 1})


def indices_of(operation: Operation) -> Sequence[int]:
    """Return the indices of the operations whose results an operation needs."""
    kind, *operands = operation
    if kind == POWER:
        return operands[:1]
    return operands if kind in OPERATIONS else ()


def check(operations: Sequence[Operation], *, lengths: int = 0) -> None:
    """Raise `ValueError` if operations are no program.

    Args:
        operations: The operations.
        lengths: The number of entries of X, or of own states, on which the formula may depend too.
    """
    if not 0 < len(operations) <= MOST_OPERATIONS:
        raise ValueError(f"a formula has none, or more than {MOST_OPERATIONS} operations")
    for place, operation in enumerate(operations):
        if not _is_valid(operation, place, {THETA: 3, LENGTH: lengths}):
            raise ValueError(f"operation {place} of a formula is none")


def _is_valid(operation: Operation, place: int, variables: Mapping[str, int]) -> bool:
    kind, *operands = operation
    if kind in variables:
        (number,) = operands if len(operands) == 1 else (None,)
        return type(number) is int and number in range(variables[kind])
    if kind == CONSTANT:
        return len(operands) == 1 and type(operands[0]) is float and math.isfinite(operands[0])
    needed = indices_of(operation)
    if not all(type(index) is int and 0 <= index < place for index in needed):
        return False
    if kind == POWER:
        return len(operands) == 2 and type(operands[1]) is int
    return kind in OPERATIONS and len(operands) == (2 if kind in BINARY else 1)


def operations_of(trace: Trace, inputs: Mapping[int, Operation]) -> list[Operation]:
    """Return all operations of a trace.

    Args:
        trace: The trace.
        inputs: What stands for each input of the trace, by its index.
    """
    return [
        inputs.get(index) or _stated(trace, operation)
        for index, operation in enumerate(trace.operations)
    ]


def _stated(trace: Trace, operation: Recorded) -> Operation:
    """Return an operation of a trace; there the exponent of a power is a constant of its own."""
    kind, operands, _ = operation
    if kind != POWER:
        return (kind, *operands)
    base, exponent = operands
    return (kind, base, int(trace.operations[exponent].operands[0]))


def program_of(trace: Trace, result: int, inputs: Mapping[int, Operation]) -> Program:
    """Return the operations of a trace that a result needs; arguments as of `operations_of`."""
    return part_of(operations_of(trace, inputs), result)


def part_of(operations: Sequence[Operation], result: int) -> Program:
    """Return the operations that a result needs, from its index among them."""
    needed = needed_by(operations, [result])
    places = {index: place for place, index in enumerate(needed)}
    return Program(tuple(_moved(operations[index], places) for index in needed))


def counted_from(first: int, program: Program) -> Program:
    """Return a formula whose entries of x are counted from the given one."""
    return Program(
        tuple(
            (kind, operands[0] - first) if kind == LENGTH else (kind, *operands)
            for kind, *operands in program.operations
        )
    )


def needed_by(operations: Sequence[Operation], results: Collection[int]) -> list[int]:
    """Return the indices of the operations that some results need, in their order."""
    needed = set(results)
    for index in range(max(results, default=-1), -1, -1):
        if index in needed:
            needed.update(indices_of(operations[index]))
    return sorted(needed)


def variables_of(operations: Sequence[Operation], results: Collection[int]) -> set[str]:
    """Return the kinds of variables on which some results depend."""
    leaves = (operations[index] for index in needed_by(operations, results))
    return {leaf[0] for leaf in leaves if not indices_of(leaf)} - {CONSTANT}


def _moved(operation: Operation, places: Mapping[int, int]) -> Operation:
    """Return an operation with other indices."""
    kind, *operands = operation
    count = len(indices_of(operation))
    return (kind, *(places[index] for index in operands[:count]), *operands[count:])


def computed(
    program: Program,
    leaf: Callable[[Operation], Any],
    combine: Callable[..., Any],
    known: Mapping[int, Any] = MappingProxyType({}),
) -> list[Any]:
    """Return the results of all operations of a program in some kind of number.

    Args:
        program: The program.
        leaf: Returns the number of an operation without operands.
        combine: Returns the result of an operation, from its kind and its operands.
        known: Results that need not be computed, by their places.
    """
    found: list[Any] = []
    for place, operation in enumerate(program.operations):
        indices = indices_of(operation)
        if place in known:
            found.append(known[place])
        elif indices:
            kind, *operands = operation
            numbers = [found[index] for index in indices]
            found.append(combine(kind, *numbers, *operands[len(indices) :]))
        else:
            found.append(leaf(operation))
    return found
