"""Formulas as sums of products: their terms, from the operations of which they are made."""

from collections import Counter
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

from rbstab.analysis.proof.traced.program import Operation
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

AS_ARGUMENT = frozenset({"sinh", "tanh", "atan"})
"""Functions that have the sign of their argument."""

NO_SUMS = frozenset[int]()

Powers = tuple[tuple[int, int], ...]
"""A product: the indices of its factors in rising order, each with its exponent."""


def meant(number: float) -> Fraction:
    """Return the number that a double in the code or in a config means: 1/3, or a decimal."""
    simple = Fraction(number).limit_denominator(MOST_DENOMINATOR)
    return simple if float(simple) == number else Fraction(repr(number))


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
        number, powers = Fraction(1), Counter[int]()
        pending = [(index, 1)]
        while pending:
            one, exponent = pending.pop()
            kind, *operands = self._operations[one]
            if kind == CONSTANT and operands[0]:
                number *= meant(operands[0]) ** exponent
            elif kind == CONSTANT:
                number = Fraction(0)
            elif kind == NEGATE:
                number *= (-1) ** (exponent % 2)
                pending.append((operands[0], exponent))
            elif kind in {MULTIPLY, DIVIDE}:
                second = exponent if kind == MULTIPLY else -exponent
                pending += [(operands[0], exponent), (operands[1], second)]
            elif kind == POWER:
                pending.append((operands[0], exponent * operands[1]))
            else:
                powers[one] += exponent
        return number, tuple(sorted((one, n) for one, n in powers.items() if n))


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
