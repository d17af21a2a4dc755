"""Formulas as sums of products: their terms, from the operations of which they are made."""

from collections import Counter
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import NamedTuple

from rbstab.analysis.proof.formulas.program import Operation
from rbstab.integrate.straight_line.number import (
    ADD,
    CONSTANT,
    DIVIDE,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
)

MOST_DENOMINATOR = 1000
"""A constant of the code that is the double nearest to such a fraction means it: 1/3."""

WHOLE = 2.0**53
"""From here on all doubles are whole numbers, and mean their shortest decimals."""

AS_ARGUMENT = frozenset({"sinh", "tanh", "atan"})
"""Functions that have the sign of their argument."""

MOST_TERMS = 10_000
"""The most terms of a sum; a formula with more of them is not shown to be anything."""

NO_SUMS = frozenset[int]()

Powers = tuple[tuple[int, int], ...]
"""A product: the indices of its factors in rising order, each with its exponent."""


@lru_cache(10_000)
def meant(number: float) -> Fraction:
    """Return the number that a double in the code or in a config means: 1/3, or a decimal."""
    decimal = Fraction(repr(number))
    if abs(number) >= WHOLE:
        return decimal
    simple = Fraction(number).limit_denominator(MOST_DENOMINATOR)
    return simple if float(simple) == number else decimal


class Term(NamedTuple):
    """A number times a product."""

    number: Fraction
    powers: Powers

    @property
    def odd(self) -> list[int]:
        """The factors with an odd exponent."""
        return [index for index, exponent in self.powers if exponent % 2]


class Terms:
    """The terms of the results of operations.

    Args:
        operations: The operations.
    """

    def __init__(self, operations: Sequence[Operation]) -> None:
        self._operations = operations
        self._products: list[tuple[Fraction, Powers]] = []

    @cached_property
    def variables(self) -> frozenset[int]:
        """The sums x that are not to be expanded: as in (Σ m_ij x_i) x_j, or x tanh(x)."""
        return frozenset(one for one in self._variables() if self.is_sum(one))

    def _variables(self) -> Iterator[int]:
        for kind, *operands in self._operations:
            if kind == MULTIPLY:
                for one, other in (operands, operands[::-1]):
                    if self.is_sum(one) and one in self._inner_sums(other):
                        yield one
            elif kind in AS_ARGUMENT:
                yield from (factor for factor, _ in self.product(operands[0])[1])

    def _inner_sums(self, index: int) -> set[int]:
        """Return the sums that are terms of a sum, or factors of its terms."""
        found, pending = set[int](), [index]
        while pending:
            one = pending.pop()
            kind, *operands = self._operations[one]
            if kind not in {ADD, SUBTRACT, NEGATE}:
                found |= {factor for factor, _ in self.product(one)[1] if self.is_sum(factor)}
                continue
            if one != index:
                found.add(one)
            pending += operands
        return found

    def of(self, index: int, kept: frozenset[int], sign: int = 1) -> Iterator[Term]:
        """Yield the terms of a sum, some inner sums of which are kept as they are."""
        kind, *operands = self._operations[index]
        if kind == NEGATE:
            yield from self.of(operands[0], kept, -sign)
        elif self.is_sum(index) and index not in kept:
            yield from self.of(operands[0], kept, sign)
            yield from self.of(operands[1], kept, sign if kind == ADD else -sign)
        else:
            number, powers = self.product(index)
            yield from self._expanded(Term(sign * number, powers), kept)

    def _expanded(self, term: Term, kept: frozenset[int]) -> Iterator[Term]:
        """Yield the terms of a product some of whose factors are sums."""
        single = (one for one, exponent in term.powers if exponent == 1)
        inner = next((one for one in single if self.is_sum(one) and one not in kept), None)
        if inner is None:
            yield term
            return
        rest = without(term.powers, [inner])
        for other in self.of(inner, kept):
            found = rest
            for one, exponent in other.powers:
                found = times(found, one, exponent)
            yield from self._expanded(Term(term.number * other.number, found), kept)

    def is_sum(self, index: int) -> bool:
        """Return whether a result is a sum or a difference."""
        return self._operations[index][0] in {ADD, SUBTRACT}

    def product(self, index: int) -> tuple[Fraction, Powers]:
        """Return a product as a number and its factors; a divisor is one of a power below 0."""
        for one in range(len(self._products), index + 1):
            self._products.append(self._product(one))
        return self._products[index]

    def _product(self, index: int) -> tuple[Fraction, Powers]:
        """Return the product of an operation, from those of its operands."""
        kind, *operands = self._operations[index]
        if kind == CONSTANT:
            return meant(operands[0]), ()
        if kind == NEGATE:
            number, powers = self._products[operands[0]]
            return -number, powers
        if kind == POWER:
            return _raised(self._products[operands[0]], operands[1])
        if kind not in {MULTIPLY, DIVIDE}:
            return Fraction(1), ((index, 1),)
        number, powers = self._products[operands[0]]
        factor, others = _raised(self._products[operands[1]], 1 if kind == MULTIPLY else -1)
        total = Counter(dict(powers))
        for one, exponent in others:
            total[one] += exponent
        return number * factor, tuple(sorted((one, n) for one, n in total.items() if n))


def _raised(product: tuple[Fraction, Powers], exponent: int) -> tuple[Fraction, Powers]:
    """Return a product to a power; x⁰ is 1, and 1/0, which has no value, is taken for 0."""
    number, powers = product
    if exponent == 0:
        return Fraction(1), ()
    raised = number**exponent if number else Fraction(0)
    return raised, tuple((one, n * exponent) for one, n in powers)


def times(powers: Powers, index: int, exponent: int) -> Powers:
    """Return a product with one more factor."""
    found = dict(powers)
    found[index] = found.get(index, 0) + exponent
    return tuple(sorted((one, n) for one, n in found.items() if n))


def without(powers: Powers, indices: Sequence[int]) -> Powers:
    """Return a product divided by some factors."""
    found = powers
    for index in indices:
        found = times(found, index, -1)
    return found
